# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The flight: plant, flight software of a satellite, in-process simulation, checkpoints.

Imports `scenario` and below.
"""
