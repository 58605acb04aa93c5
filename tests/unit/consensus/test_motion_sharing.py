# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellites that tell each other where they are: what is heard, by whom, and what scenarios may ask for."""

import numpy as np
import pytest

from flights import satellite_of, shortened
from satform.communication.messages import WIDTH, decode, encode
from satform.communication.neighbour_buffer import Received
from satform.consensus.motion_sharing import MotionMessage, MotionSharing, NeighbourMotion
from satform.control.protocol import Motion
from satform.flight.simulate import simulate
from satform.scenario import ScenarioError

TRIANGLE = "directed_triangle"


def test_a_neighbour_is_carried_on_at_the_velocity_it_was_heard_with() -> None:
    said = NeighbourMotion(
        np.array([10.0, 0.0, 5.0]), np.array([2.0, -1.0, 0.0]), np.asarray(3.0), np.asarray(1.0)
    )
    seen = MotionSharing().observed(Motion(np.array([1.0, 1.0, 1.0]), np.array([0.5, 0.0, 0.0])), said, 3.5)
    assert seen.position.tolist() == [-10.0, 1.5, -4.0]
    assert seen.velocity.tolist() == [-1.5, 1.0, 0.0]


def test_an_announcement_arrives_as_it_was_said() -> None:
    random = np.random.default_rng(1)
    position, velocity = random.standard_normal((2, 3))
    said = MotionMessage(np.asarray(4.0), position, velocity)
    values = encode(said)
    assert values.shape == (WIDTH["motion"],)
    arrived = decode("motion", values[None], np.array([4.0]), np.ones(1))
    assert isinstance(arrived, NeighbourMotion)
    assert np.array_equal(arrived.position, position)
    assert np.array_equal(arrived.velocity, velocity)


def test_a_satellite_tells_the_motion_that_it_was_told_a_step_before() -> None:
    satellite = satellite_of(shortened(TRIANGLE, 1.0), 1)
    first = satellite.announce()
    assert isinstance(first, MotionMessage)
    assert first.position.tolist() == [45.0, 5.0, 4.0]
    motion = Motion(np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0]))
    satellite.act(motion, Received.whole(np.zeros((1, 6)), np.zeros(1)))
    second = satellite.announce()
    assert isinstance(second, MotionMessage)
    assert second.time == 0.0
    assert np.array_equal(second.position, motion.position)
    assert np.array_equal(second.velocity, motion.velocity)


def test_only_the_one_that_is_heard_matters() -> None:
    plain = simulate(shortened(TRIANGLE, 1.0))
    moved = simulate(shortened(TRIANGLE, 1.0, "satellites.2.position_error=[5.0, 0.0, 0.0]"))
    # Satellite 1 hears 2, which hears 3: the change is one hop away from 2 and two from 1.
    assert np.array_equal(plain.acceleration[0, 0], moved.acceleration[0, 0])
    assert not np.array_equal(plain.acceleration[0, 1], moved.acceleration[0, 1])


def test_satellites_that_share_their_motion_fly_with_the_same_bits_together_and_one_by_one() -> None:
    scenario = shortened(TRIANGLE, 4.0)
    assert simulate(scenario).differences(simulate(scenario, stacked=False)) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("satellite_defaults.controller={kind: lqr}", "controller that follows a reference"),
        ("graph={kind: ring}", "has 2 in-neighbours"),
        ("graph={kind: none}", "has 0 in-neighbours"),
        (
            "consensus={kind: arc_length, tracking_gain: 1, coupling_gain: 1, rate_gain: 1}",
            "controller that follows a neighbour",
        ),
    ],
)
def test_sharing_motion_goes_with_laws_that_follow_the_one_that_is_heard(change: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        shortened(TRIANGLE, 1.0, change)
