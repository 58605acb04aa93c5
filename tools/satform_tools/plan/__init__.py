# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Impulses and orbits computed before a flight, printed as tables or JSON."""
