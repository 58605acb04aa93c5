# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellite formations without ROS: dynamics, control, consensus, scenarios, the in-process run."""

__version__ = "0.2.0"
