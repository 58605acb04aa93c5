# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight against what its scenario expects of it."""

import math
from collections.abc import Iterable

from satform.evaluation.sampled_loops import sampled_loops
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform.scenario.expectation import Expectation, Loops, Verdict

_TIME_SLACK = 1e-9
"""Relative slack between two times that are meant to be the same."""


def evaluate(scenario: Scenario, record: FlightRecord) -> list[Verdict]:
    """Every expectation of a scenario against the record of its flight, in order.

    Args:
        scenario: that was flown.
        record: of the flight. Where it ended early, those expectations are missed that look at more of the
            flight than there is.
    """
    return judge(scenario.expect, record, lambda: sampled_loops(scenario))


def judge(
    expectations: Iterable[Expectation], record: FlightRecord, loops: Loops | None = None
) -> list[Verdict]:
    """Expectations against a flight's record, in order; as `evaluate`.

    Args:
        expectations: to be judged.
        record: of the flight.
        loops: gives the scenario's sampled loops; what is expected of them is missed when left out.
    """
    flown = math.inf if record.early_end is None else record.steps * record.step * (1 + _TIME_SLACK)
    return [
        expectation.judge(record, loops)
        if expectation.ends(math.inf) + (record.step if expectation.of_steps else 0.0) <= flown
        else expectation.verdict(math.nan)
        for expectation in expectations
    ]
