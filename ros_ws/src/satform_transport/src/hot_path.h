// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Types of the Python module satform_transport.hot_path.

#ifndef SATFORM_TRANSPORT__HOT_PATH_H_
#define SATFORM_TRANSPORT__HOT_PATH_H_

#define PY_SSIZE_T_CLEAN
#include <Python.h>

extern PyTypeObject message_waiter_type;
extern PyTypeObject number_check_type;

#endif  // SATFORM_TRANSPORT__HOT_PATH_H_
