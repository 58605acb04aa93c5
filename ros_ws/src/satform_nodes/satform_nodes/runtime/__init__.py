# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Life of a node process: start, parameters, real-time loop, signals, diagnostics.

Imports `transport` alone.
"""
