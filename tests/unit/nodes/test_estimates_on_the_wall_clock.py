# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""On the wall clock a satellite uses the newest estimate of each neighbour, late or not, once."""

from unittest.mock import Mock

import numpy as np
import pytest

from flights import shortened
from satform.communication.sim_time import Stamps
from satform.flight.compile import compile_scenario
from satform.navigation.satellite_navigation import message_width
from satform.protocol.formation_view import FormationView
from satform.protocol.neighbour_messages import NeighbourMessages
from satform.protocol.satellite_steps import SatelliteSteps

STEP = 10
CHIEF, DEPUTY, SIZE = 0, 1, 12


@pytest.fixture
def messages() -> NeighbourMessages:
    plan = compile_scenario(shortened("gnss_differential_pair", 100.0))
    stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
    return NeighbourMessages(plan, DEPUTY, FormationView(plan), stamps)


def phase(step: int) -> tuple:
    """Fields of a message with a phase for a step."""
    return (STEP * step, 0, step, 1.0, 0.1)


def estimate(step: int) -> tuple:
    """Fields of the estimate of the step before, which goes with the phase for a step."""
    numbers = [float(step)] * SIZE
    covariance = [1.0] * (message_width(SIZE) - 1 - SIZE - 3)
    return (STEP * (step - 1), 0, step, SIZE, *numbers, len(covariance), *covariance, 0.0, 0.0, 0.0)


def used(messages: NeighbourMessages, step: int) -> list[list[float]]:
    """Sender, step and first number of each estimate that a step uses."""
    newest = messages.newest(step)
    received = messages.apply_links(step, newest, list(newest))
    found = messages.inputs_of_navigation(np.zeros(0), received).estimates
    messages.forget(step)
    return [row[:3].tolist() for row in found if row[3 + SIZE] > 0.0]


def test_an_estimate_that_comes_in_time_is_used_in_its_step(messages: NeighbourMessages) -> None:
    messages.add_newest(CHIEF, phase(4))
    messages.add_newest_estimate(CHIEF, estimate(4))
    assert used(messages, 3) == []
    assert used(messages, 4) == [[CHIEF, 3.0, 4.0]]


def test_a_late_estimate_is_used_in_the_step_after_its_arrival_and_not_again(
    messages: NeighbourMessages,
) -> None:
    messages.add_newest(CHIEF, phase(4))
    assert used(messages, 5) == []
    messages.add_newest_estimate(CHIEF, estimate(3))
    messages.add_newest_estimate(CHIEF, estimate(4))
    assert used(messages, 6) == [[CHIEF, 3.0, 4.0]]
    assert used(messages, 7) == []
    messages.add_newest_estimate(CHIEF, estimate(7))
    assert used(messages, 8) == [[CHIEF, 6.0, 7.0]]


def test_a_satellite_keeps_the_newest_estimates_of_which_the_step_is_past() -> None:
    plan = compile_scenario(shortened("gnss_differential_pair", 100.0))
    steps = SatelliteSteps(plan, DEPUTY, Mock(), Mock(), clocked=True)
    steps.neighbour_messages.add_newest(CHIEF, phase(4))
    validator = Mock()
    validator.validate.return_value = estimate(3)
    steps.take_estimate(CHIEF, validator, b"")
    assert used(steps.neighbour_messages, 6) == [[CHIEF, 2.0, 3.0]]
