# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plots of a flight with matplotlib."""
