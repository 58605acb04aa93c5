# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a satellite at rest in other axes than LVLH needs of the rest of a scenario."""

from collections.abc import Sequence

from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.common.spec import Complaint
from satform.dynamics.protocol import DynamicsSpec
from satform.orbits.curve_specs import InertialPointSpec
from satform.scenario.environment import environment_of
from satform.scenario.parts import SatelliteSpec

MOST_STEPS = 200_000
"""Control periods of a flight: where the axes point is computed for all of them before the first one."""


def inertial_point_complaints(
    satellites: Sequence[SatelliteSpec], dynamics: DynamicsSpec, steps: int
) -> list[Complaint]:
    """Field and sentence of each fault.

    Args:
        satellites: complete ones, in their order.
        dynamics: the truth model.
        steps: control periods of the flight.
    """
    moving = {own.name for own in satellites if isinstance(own.curve, InertialPointSpec)}
    found: list[Complaint] = []
    dated = not moving or environment_of(dynamics) is not None
    for index, own in enumerate(satellites):
        if own.name in moving and not dated:
            kind = getattr(dynamics, "kind", type(dynamics).__name__)
            sentence = (
                f"curve of {own.name}: an inertial_point needs a truth model that knows the date and the "
                f"chief's orbit plane, cw_perturbed or inertial; found {kind}"
            )
            found.append((("satellites", index), sentence))
        if own.name in moving and steps > MOST_STEPS:
            sentence = (
                f"curve of {own.name}: an inertial_point is flown for at most {MOST_STEPS} control periods, "
                f"and this flight has {steps}; lengthen the step or shorten the flight"
            )
            found.append((("satellites", index), sentence))
        pointing = None if own.attitude is None else own.attitude.pointing
        if isinstance(pointing, SatellitePointingSpec) and pointing.target in moving:
            sentence = (
                f"attitude of {own.name}: it cannot point at {pointing.target}, whose curve is an "
                "inertial_point: where that is does not follow from the arc length that it sends"
            )
            found.append((("satellites", index), sentence))
    return found
