# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of pairs of satellites, and of the tetrahedron of four, that do not depend on expectations."""

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from satform.control.protocol import FlightSetting
from satform.evaluation.collision import LARGEST_ECCENTRICITY, radial_normal_distances
from satform.evaluation.pairs import ClosestApproaches
from satform.numeric.elementwise import norm
from satform.orbits.tetrahedron import glassmeier_quality
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord
from satform.record.stretch import Stretch
from satform_tools.console import number

MOST_SATELLITES = 8
"""Satellites whose pairs are listed one by one."""

PAIR_HEADINGS = (
    "pair",
    "smallest distance [m]",
    "at [s]",
    "least radial/normal distance [m]",
)
"""Headings of the table of pairs."""

_MOST_STATES = 2000
"""States at most whose radial/normal distance is computed."""


@dataclass(frozen=True)
class PairSummary:
    """Two satellites' flight in figures.

    Attributes:
        first: name of a satellite.
        second: name of the other one.
        smallest_distance: m.
        closest_at: simulated time of it, s.
        radial_normal_distance: least distance in the radial/normal plane over a revolution, of states at
            equal intervals, m; NaN about an eccentric chief.
    """

    first: str
    second: str
    smallest_distance: float
    closest_at: float
    radial_normal_distance: float

    def row(self) -> tuple[str, ...]:
        """Texts under `PAIR_HEADINGS`."""
        figures = (self.smallest_distance, self.closest_at, self.radial_normal_distance)
        return (f"{self.first}, {self.second}", *map(number, figures))


def pair_summaries(record: FlightRecord, setting: FlightSetting | None) -> tuple[PairSummary, ...]:
    """The pairs of a formation of few satellites; none of a larger one.

    Args:
        record: of the flight.
        setting: its chief; None where it is not known.
    """
    count = len(record.satellites)
    if not 1 < count <= MOST_SATELLITES:
        return ()
    pairs = tuple(combinations(range(count), 2))
    stretch = Stretch(0, record.steps + 1, tuple(range(count)), of_bodies=True)
    closest = ClosestApproaches(stretch, record.step, lambda found: found.time[:, 0])
    closest.update(FlightBlock.of(record))
    found = closest.approaches()
    distances, times = norm(found.separation)[0].tolist(), found.time[0].tolist()
    figures = zip(distances, times, _radial_normal(record, pairs, setting), strict=True)
    names = combinations(record.satellites, 2)
    return tuple(PairSummary(*both, *own) for both, own in zip(names, figures, strict=True))


def least_tetrahedron_quality(record: FlightRecord) -> float:
    """Glassmeier's quality factor, the least of the flight; NaN unless there are four satellites."""
    if len(record.satellites) != 4:
        return math.nan
    return float(np.min(glassmeier_quality(record.position)))


def tetrahedron_text(quality: float) -> str:
    """The least quality factor in words; empty where there is none."""
    return "" if math.isnan(quality) else f"least tetrahedron quality {number(quality)} (3 is regular)"


def _radial_normal(
    record: FlightRecord, pairs: tuple[tuple[int, int], ...], setting: FlightSetting | None
) -> list[float]:
    chief = None if setting is None else setting.chief
    if setting is None or (chief is not None and chief.eccentricity > LARGEST_ECCENTRICITY):
        return [math.nan] * len(pairs)
    every = max(1, (record.steps + 1) // _MOST_STATES)
    motion = np.concatenate((record.position[::every], record.velocity[::every]), axis=-1)
    distances = radial_normal_distances(motion, pairs, np.array([setting.mean_motion]))
    least: list[float] = distances.min(axis=0).tolist()
    return least
