# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a flight by subject, and the expectations that judge it. Imports `flight` and below."""
