# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The explorer finds every deliberate fault of the protocol, with a shortest history that leads to it."""

import os
from contextlib import ExitStack
from unittest.mock import patch

import pytest
from protocol_explorer import Outcome
from protocol_mutations import MUTATIONS
from protocol_search import CompiledExplorer
from test_protocol_explored import LONG, flight

QUICK = 15
"""Actions of a history up to which a fault is looked for in the short tests, too."""

FOUND = {
    "a satellite does not wait for the status of a state's version": (
        3,
        18,
        "has other bits",
    ),
    "a neighbour forgets the final announcement of a lost satellite": (
        3,
        17,
        "is counted as lost",
    ),
    "a neighbour does not use the final announcement of a lost satellite": (
        3,
        12,
        "has other bits",
    ),
    "the plant takes a late command for one of the present step": (
        3,
        14,
        "has other bits",
    ),
    "the plant goes on to apply the command of a lost satellite": (
        3,
        13,
        "has other bits",
    ),
    "the plant takes commands of a lost satellite": (3, 12, "has other bits"),
    "a rejoined satellite does not go on from its checkpoint": (
        3,
        26,
        "has other bits",
    ),
    "a checkpoint counts though the command before it has not arrived": (
        3,
        28,
        "cannot be repeated",
    ),
    "a satellite rejoins at whatever state comes first": (3, 17, "has other bits"),
    "a message for the next step counts for the present one": (
        3,
        10,
        "has other bits",
    ),
    "a satellite acts without the messages of all neighbours": (
        3,
        5,
        "has other bits",
    ),
    "a satellite acts once more at a repeated state": (
        3,
        8,
        "after it has acted",
    ),
    "the plant does not wait for the last command": (3, 5, "has other bits"),
    "the plant does not publish a state again": (3, 24, "is counted as lost"),
    "a satellite publishes nothing again": (3, 19, "is counted as lost"),
    "a satellite publishes its command again, but not its message": (
        3,
        21,
        "is counted as lost",
    ),
    "a changed graph takes effect within the step": (3, 25, "is counted as lost"),
    "a satellite that has commanded is lost at once": (
        3,
        15,
        "by another formation",
    ),
    "a satellite that waits for the last message of a lost one is blamed": (
        3,
        19,
        "is counted as lost",
    ),
    "the first message of a rejoined satellite is used at once": (
        3,
        26,
        "has other bits",
    ),
    "commands of the step before still count": (3, 11, "has other bits"),
    "the plant waits for a satellite that is lost": (
        3,
        7,
        "does not go on",
    ),
    "a neighbour does not accept the new process of a satellite": (
        4,
        43,
        "is counted as lost",
    ),
    "the plant reads the end of a former process after the offer of the present one": (
        3,
        16,
        "counts against the present one",
    ),
    "the plant waits for ever": (3, 7, "does not go on"),
    "a satellite flies on though it is lost": (3, 13, "knows that it is lost"),
    "a satellite comes back within a step": (3, 18, "has other bits"),
}
"""Of each fault: with how many steps of two satellites and one disturbance it is found, the length of the
shortest history, and what does not hold then."""


def explored(name: str, steps: int) -> Outcome:
    """What the explorer finds in a protocol with a fault."""
    with ExitStack() as patches:
        for owner, attribute, value in MUTATIONS[name]():
            patches.enter_context(patch.object(owner, attribute, value))
        return CompiledExplorer(flight(2, steps), budget=1, cuts=True).explore()


def test_there_are_at_least_twenty_faults() -> None:
    assert len(MUTATIONS) >= 20
    assert set(FOUND) == set(MUTATIONS)


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_fault_of_the_protocol_is_found(name: str) -> None:
    steps, length, sentence = FOUND[name]
    whole = sentence == "does not go on"
    if (whole or length > QUICK) and LONG not in os.environ:
        pytest.skip(f"NOT TESTED: takes some seconds; set {LONG}=1")
    outcome = explored(name, steps)
    assert sentence in outcome.violation
    assert len(outcome.history) == length, "\n".join(outcome.history)
