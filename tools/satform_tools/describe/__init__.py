# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Descriptions of a scenario before it flies, and of everything that a scenario may contain."""
