# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A satellite says which messages its next step lacks, so that a wait can be for all of them."""

from typing import Any
from unittest.mock import MagicMock

import pytest
from satform_msgs.msg import ArcLength, FormationStatus, RelativeState

from flights import shortened
from satform.communication import topic_table
from satform.communication.message_validator import MessageRules, MessageValidator, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.flight.compile import compile_scenario
from satform.protocol.satellite_steps import SatelliteSteps
from satform_nodes.transport.cdr_codec import layout

NAMES = ["sat1", "sat2", "sat3"]


class Satellite:
    """Steps of the first satellite of the triangle, and the messages that it receives."""

    def __init__(self, *, clocked: bool = False) -> None:
        plan = compile_scenario(shortened("triangle", 10.0))
        self.stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self.checkpoints = MagicMock(step=-1)
        self.steps = SatelliteSteps(plan, 0, MagicMock(), self.checkpoints, clocked=clocked)
        self.steps.offer()

    def validator(self, form: Any) -> MessageValidator:
        return MessageValidator("/a", form, RejectionCounter(), self.stamps, MessageRules(exact=False))

    def state(self, step: int, version: int = 0) -> None:
        form = layout(RelativeState, topic_table.FRAME)
        data = form.pack(*self.stamps.at(step), step, version, *[0.0] * (len(form.fields) - 4))
        self.steps.take_state(self.validator(form), data)

    def phase(self, neighbour: int, step: int) -> None:
        form = layout(ArcLength, topic_table.FRAME)
        data = form.pack(*self.stamps.at(step), step, *[0.0] * (len(form.fields) - 3))
        self.steps.take_announcement(neighbour, self.validator(form), data)

    def lose(self, name: str, step: int) -> None:
        alive = [other != name for other in NAMES]
        status = FormationStatus(step=step, version=1, satellites=NAMES, alive=alive, lost=[name])
        status.edge_receivers, status.edge_senders = [0, 1, 0, 2], [1, 0, 2, 0]
        status.header.stamp.sec, status.header.stamp.nanosec = self.stamps.at(step)
        assert self.steps.take_status(status)


@pytest.mark.parametrize("order", ["state first", "state last"])
def test_each_message_that_arrives_is_no_longer_lacking_and_the_next_step_lacks_all(order: str) -> None:
    satellite = Satellite()
    steps = satellite.steps
    assert steps.lacking() is None
    satellite.state(0)
    assert steps.flying
    assert steps.lacking() == (1, 2)
    satellite.phase(2, 0)
    assert steps.lacking() == (1,)
    satellite.phase(1, 0)
    assert steps.step == 1
    assert steps.lacking() == (1, 2, "state")
    # The same object as long as nothing has come: its subscriptions are looked up once.
    assert steps.lacking() is steps.lacking()
    if order == "state first":
        satellite.state(1)
        assert steps.lacking() == (1, 2)
    satellite.phase(1, 1)
    satellite.phase(2, 2)
    assert steps.lacking() == ((2,) if order == "state first" else (2, "state"))
    satellite.phase(2, 1)
    if order == "state last":
        assert steps.lacking() == ("state",)
        satellite.state(1)
    assert steps.step == 2
    assert steps.lacking() == (1, "state")


def test_a_lost_neighbour_is_not_waited_for() -> None:
    satellite = Satellite()
    satellite.state(0)
    for neighbour in (1, 2):
        satellite.phase(neighbour, 0)
    satellite.lose("sat2", 1)
    assert satellite.steps.lacking() == (2, "state")


def test_on_the_wall_clock_nothing_is_waited_for() -> None:
    satellite = Satellite(clocked=True)
    satellite.state(0)
    assert satellite.steps.lacking() is None
