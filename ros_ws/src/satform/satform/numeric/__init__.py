# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arithmetic with reproducible bits: element-wise vector algebra, stacking of dataclasses, time derivatives.

Imports `common` only.
"""
