// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Python module satform_transport.hot_path: what the nodes of satform do at every message of a step.
//
// Plain C against the headers of Python and rcl: both are needed for the messages of this workspace anyway, and two
// types with seven methods need no generator of bindings.

#include "hot_path.h"

static PyModuleDef definition = {
  PyModuleDef_HEAD_INIT,
  .m_name = "hot_path",
  .m_doc = "Waits for the messages of a step, takes them, and validates their numbers.",
  .m_size = -1,
};

PyMODINIT_FUNC PyInit_hot_path(void)
{
  if (PyType_Ready(&message_waiter_type) < 0 || PyType_Ready(&number_check_type) < 0) {
    return NULL;
  }
  PyObject * module = PyModule_Create(&definition);
  if (module == NULL) {
    return NULL;
  }
  if (PyModule_AddObjectRef(module, "MessageWaiter", (PyObject *)&message_waiter_type) < 0 ||
    PyModule_AddObjectRef(module, "NumberCheck", (PyObject *)&number_check_type) < 0)
  {
    Py_DECREF(module);
    return NULL;
  }
  return module;
}
