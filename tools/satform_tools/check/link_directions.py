# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warning about directions of links to turned antennas about an eccentric chief."""

import math

import numpy as np

from satform.communication.antennas import IsotropicSpec
from satform.communication.physical_links import OpticalSpec, PhysicalSpec, RadioSpec
from satform.orbits.chief import KeplerianChief
from satform.scenario import Scenario

_LEAST_ANGLE = math.radians(0.1)
"""Angle below which an error of the direction is not worth a sentence, rad."""

_SAMPLES = 360
"""Moments of a revolution that are looked at."""


def link_direction_warnings(scenario: Scenario) -> list[str]:
    """A sentence where links are directed and body axes are those about a circular orbit of the chief."""
    links, chief = scenario.links, scenario.chief
    if links is None or chief is None or chief.eccentricity == 0.0:
        return []
    turned = any(scenario.satellite(index).attitude is not None for index in range(len(scenario.satellites)))
    channels = [link.channel for link in (links.default, *links.edges)]
    if not turned or not any(channel is not None and _is_directed(channel) for channel in channels):
        return []
    error = _largest_error(chief)
    if error < _LEAST_ANGLE:
        return []
    return [
        "links: antennas and terminals turn with attitudes relative to a circular orbit of the chief, whose "
        f"eccentricity is {chief.eccentricity:g}; directions of links are wrong by up to "
        f"{math.degrees(error):.3g} deg"
    ]


def _is_directed(channel: PhysicalSpec) -> bool:
    """Whether the budget depends on the direction of the other satellite."""
    if isinstance(channel, OpticalSpec):
        return channel.field_of_regard < math.pi
    assert isinstance(channel, RadioSpec)  # noqa: S101 - there is no third kind
    return not (isinstance(channel.antenna, IsotropicSpec) and isinstance(channel.receiving, IsotropicSpec))


def _largest_error(chief: KeplerianChief) -> float:
    """Largest angle between the chief and a uniform motion along its orbit that starts with it, rad."""
    times = np.linspace(0.0, chief.period, _SAMPLES)
    start = chief.true_anomaly(0.0)
    errors = [chief.true_anomaly(time) - start - chief.mean_motion * time for time in times.tolist()]
    return float(np.max(np.abs(errors)))
