# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Whom the plant loses when a step does not go on: the satellite that sends nothing, not those who wait."""

from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from flights import shortened
from satform.flight.compile import compile_scenario
from satform.membership.membership_manager import MembershipManager
from satform.protocol.plant_steps import PlantSteps

SAT1, SAT2, SAT3 = range(3)
TOPIC = "/sat2/arc_length"


def begun(name: str = "triangle", **options: Any) -> PlantSteps:
    """The plant of a flight, after its first states."""
    plan = compile_scenario(shortened(name, 10.0))
    membership = MembershipManager(plan.membership, ["recorder"])
    commands = Mock(values=np.zeros((len(plan.names), 6)), violations={})
    commands.final_command.return_value = b""
    steps = PlantSteps(plan, membership, commands, Mock(), recorded=True, **options)
    steps.begin()
    return steps


def command(steps: PlantSteps, *satellites: int) -> None:
    for satellite in satellites:
        steps.membership.record_command(satellite)
    steps.advance_if_complete()


def test_who_waits_and_those_for_whom_it_waits_are_watched() -> None:
    steps = begun("triangle")
    command(steps, SAT2)
    assert steps.awaited_senders() == [SAT1, SAT2, SAT3]
    ring = begun("ring_six")
    command(ring, 0, 1, 3, 4, 5)
    neighbours = ring.membership.formation.graph.neighbours(2)
    assert ring.awaited_senders() == sorted({2, *neighbours})


def test_all_are_watched_when_the_recorder_is_behind() -> None:
    steps = begun(window=0)
    command(steps, SAT1, SAT2, SAT3)
    assert steps.membership.open
    assert steps.missing() == ["recorder"]
    assert steps.awaited_senders() == [SAT1, SAT2, SAT3]
    steps.lose_without_message({SAT2: TOPIC}, 3.0)
    assert steps.membership.lost == [SAT2]
    assert steps.membership.formation.step == 1


@pytest.mark.parametrize("commanded", [[SAT2], [SAT2, SAT3], []])
def test_the_loss_holds_from_the_step_for_which_nothing_was_sent(commanded: list[int]) -> None:
    steps = begun()
    command(steps, SAT1, SAT2, SAT3)
    assert steps.plant.step == 1
    command(steps, *commanded)
    steps.lose_without_message({SAT2: TOPIC}, 3.0)
    formation = steps.membership.formation
    assert formation.alive.tolist() == [True, False, True]
    assert (formation.step, formation.reason) == (1, f"no {TOPIC} for step 1 within 3 s")
    assert steps.aborted is None
    command(steps, *({SAT1, SAT3} - {*commanded}))
    assert steps.plant.step == 2


def test_in_the_first_step_it_ends_the_flight() -> None:
    steps = begun()
    command(steps, SAT2)
    steps.lose_without_message({SAT2: TOPIC}, 3.0)
    assert steps.aborted is not None
    assert steps.aborted[0] == ["sat2"]
    assert steps.aborted[1].startswith(f"no {TOPIC} for step 0 within 3 s")


def test_nobody_is_watched_on_the_wall_clock_or_while_a_rejoin_is_awaited() -> None:
    assert begun(clocked=True).awaited_senders() == []
    steps = begun()
    steps.membership.awaited = {SAT2: Mock()}
    assert steps.awaited_senders() == []
