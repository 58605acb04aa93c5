# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Impulsive transfers, transfer plans and patrol plans, and the guidance that flies them.

Imports `control` and below.
"""
