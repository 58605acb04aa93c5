# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures speed: functions that return figures, and their printing."""
