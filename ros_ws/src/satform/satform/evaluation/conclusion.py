# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said of a flight's expectations: how many were met, and how many were not judged."""

from collections.abc import Sequence

from satform.scenario import Scenario
from satform.scenario.expectation import Verdict


def conclusion_of(scenario: Scenario, verdicts: Sequence[Verdict]) -> str:
    """What came of a whole flight, without a full stop.

    Args:
        scenario: that was flown.
        verdicts: one for each of its expectations.
    """
    left = excluded(scenario)
    if not verdicts:
        return f"Flown to the end and not judged: {left or 'the scenario expects nothing'}"
    met = sum(verdict.met for verdict in verdicts)
    count = len(verdicts)
    words = f"As expected: {count} of {count} met" if met == count else f"MISSED: {count - met} of {count}"
    return f"{words}; {left}: not judged" if left else words


def excluded(scenario: Scenario) -> str:
    """How many expectations a flight is too short for, in words; empty when it is for none."""
    count = len(scenario.omitted_expectations)
    if count == 0:
        return ""
    return (
        "1 expectation needs a longer flight" if count == 1 else f"{count} expectations need a longer flight"
    )
