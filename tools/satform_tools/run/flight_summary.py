# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a flight that do not depend on its expectations: errors, delta-v, thruster events, distances."""

import math
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np

from satform.control.protocol import FlightSetting
from satform.evaluation.arc_lengths import arc_length_spread
from satform.evaluation.findings import findings, mean_after_settling
from satform.evaluation.reducers import ExtremeOf
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord
from satform.record.stretch import TIME_SLACK, Stretch
from satform_tools.console import number
from satform_tools.run.pair_figures import PairSummary, least_tetrahedron_quality, pair_summaries

FINAL_FRACTION = 0.2
"""Fraction of the flight at its end over which final errors are taken."""

_MOST_PAIRS = 1000
"""Largest number of pairs of satellites of which the distance is measured."""


@dataclass(frozen=True)
class SatelliteSummary:
    """One satellite's flight in figures.

    Attributes:
        name: of the satellite.
        final_error: largest distance to its reference in the last part of the flight, m.
        final_sliding_variable: largest component in the last part of the flight, m/s.
        mean_control: mean magnitude of the commanded acceleration in the last part of the flight, m/s^2.
        largest_control: largest magnitude in the whole flight, m/s^2.
        delta_v: spent over the whole flight, m/s.
        delta_v_per_orbit: m/s; NaN of a flight that is shorter than a revolution of the chief.
        propellant_used: kg; NaN without a thruster.
        saturated_steps: steps with a command above the thrust limit.
        below_minimum_impulse_steps: steps with a command below the minimum impulse.
        propellant_depleted_steps: steps with a command beyond the remaining propellant.
        absent: steps in which it did not fly; excluded from the errors.
        mean_nees: mean normalised estimation error squared of its filter after the flight's first fifth, 6
            for a consistent one; NaN without a filter.
        mean_innovation: likewise of its normalised innovation squared.
        rejected: measurements that its filter rejected.
    """

    name: str
    final_error: float
    final_sliding_variable: float
    mean_control: float
    largest_control: float
    delta_v: float
    delta_v_per_orbit: float
    propellant_used: float
    saturated_steps: int
    below_minimum_impulse_steps: int
    propellant_depleted_steps: int
    absent: int
    mean_nees: float
    mean_innovation: float
    rejected: int

    def row(self) -> tuple[str, ...]:
        """Its name, errors, controls and delta-v as texts, in the order of the attributes."""
        figures = (self.final_error, self.final_sliding_variable, self.mean_control, self.largest_control)
        return (self.name, *map(number, (*figures, self.delta_v, self.delta_v_per_orbit)))


@dataclass(frozen=True)
class Summary:
    """A whole flight in figures.

    Attributes:
        duration: simulated time flown, s.
        final_from: start of the last part of the flight, s.
        satellites: one entry for each.
        spread_at_start: largest minus smallest generalised arc length, m; NaN for a lone satellite.
        spread_at_end: the same at the end, m.
        smallest_distance: between any two satellites, m; NaN for a lone satellite.
        pairs: of a formation of few satellites.
        tetrahedron_quality: Glassmeier's factor, the least of the flight; NaN unless of four satellites.
        findings: sentences about what a user should know although nothing was expected of it.
    """

    duration: float
    final_from: float
    satellites: tuple[SatelliteSummary, ...]
    spread_at_start: float
    spread_at_end: float
    smallest_distance: float
    pairs: tuple[PairSummary, ...] = ()
    tetrahedron_quality: float = math.nan
    findings: tuple[str, ...] = ()

    def data(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def summarise(record: FlightRecord, setting: FlightSetting | None = None) -> Summary:
    """A flight in figures.

    Args:
        record: of at least one step.
        setting: chief of the flight; None where it is not known.

    Returns:
        The figures, NaN where the flight has none.
    """
    final = math.floor((1.0 - FINAL_FRACTION) * record.steps)
    several = len(record.satellites) > 1
    block = FlightBlock.of(record)
    spread = arc_length_spread(record)
    return Summary(
        duration=record.steps * record.step,
        final_from=final * record.step,
        satellites=tuple(
            _satellite(record, block, column, final, _orbits(record, setting))
            for column in range(len(record.satellites))
        ),
        spread_at_start=float(spread[0]) if several else math.nan,
        spread_at_end=float(spread[-1]) if several else math.nan,
        smallest_distance=_smallest_distance(record),
        pairs=pair_summaries(record, setting),
        tetrahedron_quality=least_tetrahedron_quality(record),
        findings=findings(record),
    )


def _orbits(record: FlightRecord, setting: FlightSetting | None) -> float:
    """Revolutions of the chief; NaN of less than one."""
    flown = math.nan if setting is None else record.steps * record.step * setting.mean_motion / math.tau
    return flown if flown >= 1.0 - TIME_SLACK else math.nan


def _satellite(
    record: FlightRecord, block: FlightBlock, column: int, final: int, orbits: float
) -> SatelliteSummary:
    delta_v = float(np.sum(record.effort[:, column]))
    control = record.control[:, column]
    rejected = record.rejected_measurements[:, column]
    return SatelliteSummary(
        name=record.satellites[column],
        final_error=_largest(block, "tracking_error", column, final),
        final_sliding_variable=_largest(block, "sliding_variable", column, final),
        mean_control=float(np.mean(control[final:])) if record.steps else math.nan,
        largest_control=_largest(block, "control", column, 0),
        delta_v=delta_v,
        delta_v_per_orbit=delta_v / orbits,
        propellant_used=float(record.propellant[0, column] - record.propellant[-1, column]),
        saturated_steps=int(record.saturated_steps[-1, column]),
        below_minimum_impulse_steps=int(record.below_minimum_impulse_steps[-1, column]),
        propellant_depleted_steps=int(record.propellant_depleted_steps[-1, column]),
        absent=int(np.count_nonzero(record.absent[:, column])),
        mean_nees=mean_after_settling(record.estimation_error_squared, column),
        mean_innovation=mean_after_settling(record.innovation, column),
        rejected=int(np.max(rejected, initial=0.0, where=~np.isnan(rejected))),
    )


def _largest(block: FlightBlock, quantity: str, column: int, first: int) -> float:
    """Largest magnitude of a satellite's quantity from a step on, in the steps in which it flies."""
    largest = ExtremeOf(Stretch(first, block.steps, (column,)), quantity, transform=np.abs)
    largest.update(block)
    return float(largest.figures()[0])


def _smallest_distance(record: FlightRecord) -> float:
    pairs = list(combinations(range(len(record.satellites)), 2))[:_MOST_PAIRS]
    apart = [np.linalg.norm(record.position[:, i] - record.position[:, j], axis=-1).min() for i, j in pairs]
    return float(min(apart)) if apart else math.nan
