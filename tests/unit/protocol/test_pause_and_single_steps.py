# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The step that the reply to pause, resume or a single step names is the one that is taken."""

from unittest.mock import Mock

import numpy as np
import pytest

from flights import shortened
from satform.flight.compile import compile_scenario
from satform.membership.membership_manager import MembershipManager
from satform.protocol.plant_steps import PlantSteps

STEPS = 10


@pytest.fixture
def steps() -> PlantSteps:
    """The plant of a flight that waits for the commands of step 0."""
    plan = compile_scenario(shortened("triangle", STEPS * 0.5))
    commands = Mock(values=np.zeros((len(plan.names), 6)), violations={})
    membership = MembershipManager(plan.membership, [])
    steps = PlantSteps(plan, membership, commands, Mock(), recorded=False)
    steps.begin()
    return steps


def command_all(steps: PlantSteps) -> None:
    """All satellites command the step whose states are published."""
    for satellite in steps.membership.not_commanded:
        steps.membership.record_command(satellite)
    steps.advance_if_complete()


def published_up_to(steps: PlantSteps) -> int:
    """The last step whose states have been published."""
    return steps.plant.step - steps.membership.open


def test_single_steps_asked_for_at_once_are_numbered_one_after_the_other(steps: PlantSteps) -> None:
    # Step 0 is under way: its states are published.
    assert steps.pause() == 1
    assert [steps.single_step() for _ in range(3)] == [1, 2, 3]
    assert steps.paused_before is None
    for _ in range(6):
        command_all(steps)
    assert steps.membership.open
    assert (published_up_to(steps), steps.paused_before) == (3, 4)
    assert steps.single_step() == 4
    assert published_up_to(steps) == 4


def test_single_step_without_a_pause_pauses_before_it(steps: PlantSteps) -> None:
    assert steps.single_step() == 1
    assert steps.paused
    assert steps.single_step() == 2
    for _ in range(4):
        command_all(steps)
    assert published_up_to(steps) == 2


@pytest.mark.parametrize("asked", [0, 2])
def test_resumed_while_a_step_is_under_way_continues_with_the_next(steps: PlantSteps, asked: int) -> None:
    steps.pause()
    for _ in range(asked):
        steps.single_step()
    assert published_up_to(steps) == 0
    assert steps.resume() == 1
    command_all(steps)
    assert published_up_to(steps) == 1


def test_resumed_between_steps_continues_with_the_one_that_was_not_taken(steps: PlantSteps) -> None:
    steps.pause()
    command_all(steps)
    assert (steps.plant.step, steps.membership.open) == (1, True)
    assert steps.resume() == 1


def test_single_steps_end_with_the_last_one(steps: PlantSteps) -> None:
    assert [steps.single_step() for _ in range(STEPS)] == list(range(1, STEPS + 1))
    with pytest.raises(ValueError, match="the last step has been taken"):
        steps.single_step()
    for _ in range(STEPS):
        command_all(steps)
    assert steps.flown
    with pytest.raises(ValueError, match="the last step has been taken"):
        steps.single_step()
