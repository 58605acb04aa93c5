# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The node of one satellite, and the programs of one satellite and of several in one process.

Imports `runtime` and `transport`.
"""
