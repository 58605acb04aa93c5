# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Describes scenarios before they fly, and all fields of a scenario."""
