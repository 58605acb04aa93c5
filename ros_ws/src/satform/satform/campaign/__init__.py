# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns: many cases of one scenario, which differ in what is dispersed, and how and where they are flown.

Imports `evaluation` and below.
"""
