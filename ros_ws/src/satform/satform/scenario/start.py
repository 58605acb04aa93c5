# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What cannot be flown from where satellites start."""

from collections.abc import Sequence

import numpy as np

from satform.consensus.graph import Graph
from satform.control.protocol import Motion
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Path
from satform.scenario.parts import SatelliteSpec

_SAMPLES = 33
"""Places along a curve at which its reference is looked at."""

_LARGEST = 1e100
"""Of a reference's components in SI units; squares of it are finite still."""

_LONGEST_PERIOD = 1e15
"""Of generalised arc length, m; as the largest number that a scenario has."""


def start_position(satellite: SatelliteSpec) -> Array:
    """Where a satellite without `start` starts, LVLH, m, shape (3,).

    Args:
        satellite: with all that it takes from `satellite_defaults`.
    """
    assert satellite.curve is not None  # noqa: S101 - the scenario's validator has seen to it
    path = Path(satellite.curve.build(), np.asarray(satellite.scale), satellite.path_parameter)
    arc_length = np.asarray(satellite.arc_length, dtype=np.float64)
    start: Array = path.curve.point(path.angle(arc_length)).position + np.array(satellite.position_error)
    return start


def coincident_with_followed(
    satellites: Sequence[SatelliteSpec], graph: Graph, starts: Sequence[Motion | None]
) -> list[tuple[int, str]]:
    """Satellites that start where the one is that they are to keep a distance from.

    Args:
        satellites: complete ones, in the order of the graph's rows.
        graph: who follows whom.
        starts: motion of those that have a `start`; None for the others, which start on their references.

    Returns:
        Index of each such satellite, and a sentence.
    """
    positions = [
        start_position(satellite) if start is None else start.position
        for satellite, start in zip(satellites, starts, strict=True)
    ]
    found = []
    for index, satellite in enumerate(satellites):
        for other in graph.neighbours(index):
            if np.array_equal(positions[index], positions[other]):
                sentence = (
                    f"satellite {satellite.name} starts in the same place as {satellites[other].name}, which "
                    "it follows: from there no direction leads to the distance that it is to keep"
                )
                found.append((index, sentence))
    return found


def singular_references(satellites: Sequence[SatelliteSpec], nominal_period: float) -> list[tuple[int, str]]:
    """Satellites whose reference is not a finite motion somewhere along its curve.

    Args:
        satellites: complete ones.
        nominal_period: about the time of one period along the curve, s.

    Returns:
        Index of each such satellite, the first of those on the same curve, and a sentence.
    """
    found, seen = [], set()
    for index, satellite in enumerate(satellites):
        shape = (repr(satellite.curve), satellite.scale, satellite.path_parameter)
        if satellite.curve is None or shape in seen:
            continue
        seen.add(shape)
        sentence = _singular(satellite, nominal_period)
        if sentence:
            found.append((index, f"{sentence}: give curve or scale another size"))
    return found


def _singular(satellite: SatelliteSpec, nominal_period: float) -> str:
    """Why a satellite's reference is no finite motion; empty where it is one."""
    assert satellite.curve is not None  # noqa: S101 - the caller has seen to it
    with np.errstate(all="ignore"):
        try:
            path = Path(satellite.curve.build(), np.asarray(satellite.scale), satellite.path_parameter)
        except ArithmeticError:
            return f"the curve of satellite {satellite.name} is too small or too large to be worked with"
        period = float(path.period)
        if not period <= _LONGEST_PERIOD:
            return (
                f"a period of satellite {satellite.name}, the perimeter divided by scale, is {period:g} m of "
                f"generalised arc length, which is more than {_LONGEST_PERIOD:g} m"
            )
        arc_lengths = np.linspace(0.0, 1.0, _SAMPLES) * period
        motion = path.reference(arc_lengths, np.full(_SAMPLES, period / nominal_period), np.zeros(_SAMPLES))
        parts = np.concatenate((motion.position, motion.velocity, motion.acceleration), axis=-1)
    if np.all(np.abs(parts) < _LARGEST):
        return ""
    return f"the reference of satellite {satellite.name} is not a finite motion all along its curve"


def beyond_distance(satellite: SatelliteSpec, largest: float) -> str:
    """Why a satellite's curve leads too far from the chief; empty where it does not.

    Args:
        satellite: complete one, with a reference that is finite.
        largest: distance from the chief, m.
    """
    assert satellite.curve is not None  # noqa: S101 - the caller has seen to it
    path = Path(satellite.curve.build(), np.asarray(satellite.scale), satellite.path_parameter)
    arc_lengths = np.linspace(0.0, 1.0, _SAMPLES) * float(path.period)
    farthest = float(np.max(np.linalg.norm(path.curve.point(path.angle(arc_lengths)).position, axis=-1)))
    if farthest <= largest:
        return ""
    return (
        f"the curve of satellite {satellite.name} leads {farthest:g} m from the chief, beyond the limit of "
        f"{largest:g} m (limits.distance)"
    )
