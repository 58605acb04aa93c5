# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements of speed: functions that return rows, and their printing."""
