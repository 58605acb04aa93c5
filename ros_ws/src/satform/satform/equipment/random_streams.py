# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the random streams: thrusters, navigation and links draw independently of each other.

A stream is an argument of `satform.numeric.seeded_numbers`. `satform.flight.plant` makes those of thrusters
and navigation, `satform.communication.channel_model` those of links.
"""

THRUSTER_STREAM = 1_000_001
"""Stream of the thrusters' errors."""
NAVIGATION_STREAM = 1_000_002
"""Stream of the navigation's white noise."""
LINK_STREAM = 1_000_003
"""Stream of what happens to messages on their way."""
