# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Thrusters, sensors, and the numbers of their random streams. Imports `control` and below."""
