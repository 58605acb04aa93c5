# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A message is validated as it enters a node: its stamp has to be one that a message of its step can have."""

from typing import Any

import pytest
from satform_msgs.msg import ArcLength, Command, FormationStatus, RelativeState

from flights import shortened
from satform.communication import topic_table
from satform.communication.message_validator import (
    EARLIER_STAMPS,
    MessageRules,
    MessageValidator,
    RejectionCounter,
)
from satform.communication.sim_time import Stamps
from satform.flight.compile import compile_scenario
from satform.protocol.formation_view import FormationView
from satform_nodes.transport.cdr_codec import layout

STEP = 500_000_000
"""Length of a step, ns."""

KINDS = {"command": Command, "state": RelativeState, "arc_length": ArcLength}


def admitted(kind: str, step: int, nanoseconds: int) -> tuple[Any, dict[tuple[str, str], int]]:
    """What becomes of a message of a step with a stamp, and what is counted."""
    form, rejections = layout(KINDS[kind], topic_table.FRAME), RejectionCounter()
    rules = MessageRules(exact=kind not in EARLIER_STAMPS)
    validator = MessageValidator(f"/sat1/{kind}", form, rejections, Stamps(0.5, STEP), rules)
    rest = [0] * (len(form.fields) - 3)
    data = form.pack(*divmod(nanoseconds, 10**9), step, *rest)
    return validator.validate(data, 0, 100), dict(rejections.counts)


@pytest.mark.parametrize("kind", sorted(KINDS))
@pytest.mark.parametrize("step", [0, 7, 100])
def test_a_stamp_that_is_the_beginning_of_the_step_is_admitted(kind: str, step: int) -> None:
    numbers, counted = admitted(kind, step, step * STEP)
    assert numbers is not None
    assert numbers[2] == step
    assert counted == {}


@pytest.mark.parametrize(
    ("kind", "nanoseconds"),
    [
        ("command", 6 * STEP),
        ("command", 8 * STEP),
        ("command", 7 * STEP + 1),
        # An hour and a day of the wall clock.
        ("command", 1_790_000_000 * 10**9),
        ("state", 8 * STEP),
        ("state", 7 * STEP - 1),
        ("state", -STEP),
        ("arc_length", 9 * STEP),
    ],
)
def test_a_stamp_that_contradicts_the_step_is_rejected_and_counted(kind: str, nanoseconds: int) -> None:
    numbers, counted = admitted(kind, 7, nanoseconds)
    assert numbers is None
    assert counted == {(f"/sat1/{kind}", "a stamp that contradicts its step"): 1}


@pytest.mark.parametrize("kind", sorted(EARLIER_STAMPS & set(KINDS)))
@pytest.mark.parametrize("measured", [0, 3, 6])
def test_a_measurement_and_a_phase_may_be_of_an_earlier_step(kind: str, measured: int) -> None:
    numbers, counted = admitted(kind, 7, measured * STEP)
    assert numbers is not None
    assert counted == {}


def test_a_status_whose_stamp_is_of_another_step_is_not_about_this_formation() -> None:
    view = FormationView(compile_scenario(shortened("triangle", 10.0)))
    names = ["sat1", "sat2", "sat3"]
    status = FormationStatus(
        step=6,
        version=1,
        satellites=names,
        alive=[True, True, False],
        edge_receivers=[0, 1],
        edge_senders=[1, 0],
    )
    status.header.stamp.sec = 4
    assert not view.take(status)
    assert view.lost == []
    status.header.stamp.sec = 3
    assert view.take(status)
    assert view.lost == ["sat3"]
