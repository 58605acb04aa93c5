# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inertial states and relative elements on topics are those that the record gives, and change no bit."""

from pathlib import Path

import numpy as np
from mcap_ros2.reader import read_ros2_messages

from flights import shortened
from flown import assert_as_in_one_process, flown

STEPS = 40


def test_the_states_on_topics_are_those_of_the_record(tmp_path: Path) -> None:
    scenario = shortened("ei_pair_from_tle", STEPS * 10.0, "publish_orbits=true")
    flight, bag = flown(scenario, tmp_path)
    assert not flight.lost, flight.reason
    assert_as_in_one_process(bag)
    assert scenario.digest() == scenario.with_({"publish_orbits": False}).digest()
    record = bag.record
    for column, name in enumerate(record.satellites):
        topic = f"/{name}/orbit_state"
        messages = [found.ros_msg for found in read_ros2_messages(str(bag.path), topics=[topic])]
        assert [message.step for message in messages] == list(range(record.steps + 1))
        assert {message.header.frame_id for message in messages} == {"gcrf"}
        position = np.array([[own.position.x, own.position.y, own.position.z] for own in messages])
        velocity = np.array([[own.velocity.x, own.velocity.y, own.velocity.z] for own in messages])
        elements = np.array([own.relative_elements for own in messages])
        np.testing.assert_array_equal(position, record.inertial_position[:, column])
        np.testing.assert_array_equal(velocity, record.inertial_velocity[:, column])
        np.testing.assert_array_equal(elements, record.relative_elements[:, column])
        assert np.linalg.norm(position, axis=-1).min() > 6.4e6
        assert np.isfinite(elements).all()
