# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight against what its scenario expects of it."""

import math
from collections.abc import Iterable, Sequence

from satform.control.protocol import FlightSetting
from satform.evaluation.flight_figures import FlightFigures
from satform.evaluation.sampled_loops import sampled_loops
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord
from satform.record.reducer import FlightShape
from satform.record.stretch import TIME_SLACK
from satform.scenario import Scenario
from satform.scenario.expectation import Expectation, Loops, Verdict


def evaluate(scenario: Scenario, record: FlightRecord) -> list[Verdict]:
    """Every expectation of a scenario against the record of its flight, in order.

    Args:
        scenario: that was flown.
        record: of the flight. Where it ended early, those expectations are missed that look at more of the
            flight than there is.
    """
    return judge(scenario.expect, record, lambda: sampled_loops(scenario), scenario.setting)


def judge(
    expectations: Iterable[Expectation],
    record: FlightRecord,
    loops: Loops | None = None,
    setting: FlightSetting | None = None,
) -> list[Verdict]:
    """Expectations against a flight's record, in order; as `evaluate`.

    Args:
        expectations: to be judged.
        record: of the flight.
        loops: gives the scenario's sampled loops; what is expected of them is missed when left out.
        setting: chief of the flight; what is expected of its orbits is missed when left out.
    """
    flown = math.inf if record.early_end is None else record.steps * record.step * (1 + TIME_SLACK)
    expected = tuple(expectations)
    judged = [
        index
        for index, expectation in enumerate(expected)
        if expectation.ends(math.inf) + (record.step if expectation.of_steps else 0.0) <= flown
    ]
    found = figures_of([expected[index] for index in judged], record, loops, setting)
    figures = dict(zip(judged, found, strict=True))
    return [expectation.verdict(figures.get(index, math.nan)) for index, expectation in enumerate(expected)]


def figures_of(
    expectations: Sequence[Expectation],
    record: FlightRecord,
    loops: Loops | None,
    setting: FlightSetting | None = None,
) -> list[float]:
    """The figures of expectations, each quantity that several of them need derived once.

    Args:
        expectations: whose figures are meant.
        record: of the flight.
        loops: gives the scenario's sampled loops; None where they are not known.
        setting: chief of the flight; None where it is not known.

    Returns:
        One for each, NaN for what the record does not hold.
    """
    figures = FlightFigures(expectations, FlightShape.of(record, setting))
    figures.update(FlightBlock.of(record))
    found: list[float] = figures.figures()[:, 0].tolist()
    for index in (*figures.whole_records, *figures.of_loops):
        found[index] = expectations[index].figure(record, loops)
    return found
