# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A new process of a satellite offers itself again when the loss of the former process takes effect."""

from unittest.mock import Mock

import pytest
from satform_msgs.msg import FormationStatus

from flights import shortened
from satform.flight.compile import compile_scenario
from satform.protocol.satellite_steps import SatelliteSteps

NAMES = ["sat1", "sat2", "sat3"]
SAT2 = 1


def status(version: int, step: int, *, alive: bool, rejoined: bool = False) -> FormationStatus:
    """A status by which only the second satellite changes."""
    message = FormationStatus(
        version=version, step=step, phase=FormationStatus.FLYING, satellites=NAMES, alive=[True, alive, True]
    )
    message.header.stamp.sec, half = divmod(step, 2)
    message.header.stamp.nanosec = half * 500_000_000
    message.lost = [] if alive else ["sat2"]
    message.rejoined, message.rejoin_checkpoints = (["sat2"], [-1]) if rejoined else ([], [])
    return message


@pytest.fixture
def output() -> Mock:
    return Mock()


@pytest.fixture
def steps(output: Mock) -> SatelliteSteps:
    return SatelliteSteps(compile_scenario(shortened("triangle", 10.0)), SAT2, output, Mock(step=-1))


def test_it_is_ready_once_more_for_each_loss_that_it_reads_of(steps: SatelliteSteps, output: Mock) -> None:
    steps.offer()
    counts = []
    for message in (
        status(1, 3, alive=False),
        status(1, 3, alive=False),
        status(2, 4, alive=False),
        status(3, 5, alive=True, rejoined=True),
        status(4, 6, alive=False),
    ):
        assert steps.take_status(message)
        counts.append(output.publish_ready.call_count)
    assert counts == [2, 2, 2, 2, 3]


def test_it_is_not_ready_before_its_endpoints_are_matched(steps: SatelliteSteps, output: Mock) -> None:
    assert steps.take_status(status(1, 3, alive=False))
    assert not output.publish_ready.called
    steps.offer()
    assert output.publish_ready.call_count == 1
