# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Sensors: specifications, measurement models, and the channels that the plant samples."""
