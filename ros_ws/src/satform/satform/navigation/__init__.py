# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Navigation filters: estimates of motion from the readings of sensors, alone and with neighbours.

Imports `equipment` and below.
"""
