# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Gyrostat and wheels, pointing references and the tracking law.

Imports `communication` and below.
"""
