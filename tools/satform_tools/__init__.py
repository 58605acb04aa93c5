# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: runs, reports and checks of satellite formations."""
