# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who takes part and over which communication graph, step by step; faults.

Imports `navigation` and below.
"""
