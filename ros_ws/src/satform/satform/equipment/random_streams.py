# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the random streams: thrusters, sensors, filters and links draw independently of each other.

A stream is an argument of `satform.numeric.seeded_numbers`. `satform.flight.plant` makes those of thrusters
and sensors, `satform.communication.channel_model` those of links, `satform.navigation` those of filters.
"""

THRUSTER_STREAM = 1_000_001
"""Stream of the thrusters' errors."""
NAVIGATION_STREAM = 1_000_002
"""Stream of the navigation's white noise."""
LINK_STREAM = 1_000_003
"""Stream of what happens to messages on their way."""
SENSOR_STREAM = 1_000_004
"""Stream of the errors of the sensors' channels, numbered by `channel_number`."""
PRIOR_STREAM = 1_000_005
"""Stream of the errors of what satellites know at the start."""
FILTER_STREAM = 1_000_006
"""Stream of what navigation filters draw."""
ATTITUDE_PRIOR_STREAM = 1_000_007
"""Stream of the errors of what satellites know of their attitudes at the start."""

MOST_CHANNELS = 4096
"""Channels that the sensors of a satellite have at most."""


def channel_number(satellite: int, channel: int) -> int:
    """Number of a channel among those of all satellites.

    Args:
        satellite: index of the satellite.
        channel: index among the channels of the satellite.
    """
    return satellite * MOST_CHANNELS + channel
