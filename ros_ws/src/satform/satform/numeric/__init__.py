# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arithmetic with reproducible bits: element-wise algebra, stacking, time derivatives, seeded numbers.

Imports `common` only.
"""
