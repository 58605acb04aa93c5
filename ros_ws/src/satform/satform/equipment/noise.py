# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Streams of what is random in equipment and on links, which keep their numbers apart."""

THRUSTER_STREAM = 1_000_001
"""Stream of the thrusters' errors."""
NAVIGATION_STREAM = 1_000_002
"""Stream of the navigation's white noise."""
LINK_STREAM = 1_000_003
"""Stream of what happens to messages on their way."""
