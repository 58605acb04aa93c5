# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Thrusters, sensors, filters and the noise that they draw. Imports `control` and below."""
