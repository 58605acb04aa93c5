# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inspecting a running formation from outside, without disturbing it."""
