# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the model for Spin finds is followed by the objects that fly, and the other way round."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from unittest.mock import patch

import pytest
from protocol_explorer import Explorer
from protocol_mutations import MUTATIONS
from protocol_replay import StuckError, actions_of, follow, schedule_of
from protocol_search import CompiledExplorer
from protocol_transitions import ViolationError
from test_protocol_explored import LONG, flight
from test_protocol_spin import FAULTS, pytestmark, run, verified, verifier

__all__ = ["pytestmark"]

STEPS = 3
"""Of the model and of the flights here."""

SAME = {
    "M_NO_WAITING": "a satellite acts without the messages of all neighbours",
    "M_FINAL_NOT_USED": "a neighbour does not use the final announcement of a lost satellite",
    "M_NO_VERSION_CHECK": "a satellite does not wait for the status of a state's version",
    "M_LOST_APPLIED": "the plant goes on to apply the command of a lost satellite",
    "M_FORGET_FINAL": "a neighbour forgets the final announcement of a lost satellite",
    "M_BLAME": "a satellite that waits for the last message of a lost one is blamed",
    "M_NO_TIMEOUT": "the plant waits for ever",
}
"""The fault of the objects that fly that is the same as one of the model."""


DISTURBANCES = {
    "M_NO_WAITING": ("kill",),
    "M_FINAL_NOT_USED": ("kill",),
    "M_NO_VERSION_CHECK": ("graph",),
    "M_FORGET_FINAL": ("kill",),
    "M_BLAME": ("kill",),
}
"""Disturbances with which the explorer looks for histories that the model has, too. The other two faults have
none: the model does not know what a command says, and a schedule that has ended has no next action."""

QUICK = ("M_FINAL_NOT_USED", "M_NO_VERSION_CHECK")
"""Faults whose histories are followed by the model in the short tests, too."""


@contextmanager
def mutated(name: str) -> Iterator[None]:
    with ExitStack() as patches:
        for owner, attribute, value in MUTATIONS[name]():
            patches.enter_context(patch.object(owner, attribute, value))
        yield


def explorer() -> Explorer:
    return Explorer(flight(2, STEPS), budget=1, restarts=0)


def test_every_fault_of_the_model_has_its_like() -> None:
    assert set(SAME) == set(FAULTS)
    assert set(SAME.values()) <= set(MUTATIONS)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_trail_of_the_model_breaks_an_invariant_of_the_objects_that_fly(fault: str, tmp_path: Path) -> None:
    assert verified(verifier(tmp_path, f"-D{fault}", "-DEAGER"), FAULTS[fault])[0] == 1
    history = actions_of(run(tmp_path, "spin", f"-D{fault}", "-DEAGER", "-t", "protocol.pml"))
    expected = StuckError if FAULTS[fault] == "ends" else ViolationError
    with mutated(SAME[fault]), pytest.raises(expected):
        follow(explorer(), history)
    follow(explorer(), history)


@pytest.mark.parametrize("fault", DISTURBANCES)
def test_a_history_of_the_explorer_breaks_a_property_of_the_model(fault: str, tmp_path: Path) -> None:
    if fault not in QUICK and LONG not in os.environ:
        pytest.skip(f"NOT TESTED: takes seconds; set {LONG}=1")
    with mutated(SAME[fault]):
        found = CompiledExplorer(flight(2, STEPS), budget=1, restarts=0, faults=DISTURBANCES[fault]).explore()
    assert found.violation
    schedule = schedule_of(found.history)
    due = " || ".join(f"(done == {place} && (a) == {number})" for place, number in enumerate(schedule))
    text = f"#define LENGTH {len(schedule)}\n#define SCHEDULE(a) ({due})\n"
    assert verified(verifier(tmp_path, f"-D{fault}", schedule=text), FAULTS[fault])[0] == 1
    assert verified(verifier(tmp_path, schedule=text), FAULTS[fault])[0] == 0
