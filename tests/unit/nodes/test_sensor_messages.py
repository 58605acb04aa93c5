# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings of sensors as messages of sensor_msgs."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from satform.communication.sim_time import Stamps
from satform.communication.topic_table import Equipment, SensorTopic, TopicPlan
from satform.consensus.graph import NoneSpec
from satform_nodes.plant.sensor_messages import SensorMessages


class Sent:
    """A publisher that keeps what is published."""

    def __init__(self) -> None:
        self.messages: list[Any] = []

    def publish(self, message: Any) -> None:
        self.messages.append(message)


def test_what_arrives_is_published_with_time_and_frame_and_nothing_else_is() -> None:
    topics = (
        SensorTopic("laser_ranging_sat2", "range", 0, 2),
        SensorTopic("gyro", "imu", 2, 3),
        SensorTopic("star_tracker", "orientation", 5, 3),
    )
    plan = TopicPlan(
        (Equipment("sat1", readings=8, sensor_topics=topics),), "arc_length", NoneSpec().build(1)
    )
    publishers = {f"/sat1/{topic.name}": Sent() for topic in topics}
    messages = SensorMessages(plan, publishers, Stamps(0.5, 500_000_000))
    rotation = Rotation.from_mrp([0.1, -0.2, 0.3])
    messages.publish({0: np.array([120.0, 0.5, 1e-3, 2e-3, 3e-3, 0.1, -0.2, 0.3])}, 3)
    messages.publish({0: np.full(8, np.nan)}, 4)
    (distance,), (rate,), (turned,) = (sent.messages for sent in publishers.values())
    assert (distance.header.stamp.sec, distance.header.stamp.nanosec) == (1, 500_000_000)
    assert distance.header.frame_id == "sat1"
    assert distance.range == pytest.approx(120.0)
    assert (rate.angular_velocity.x, rate.angular_velocity.z) == (1e-3, 3e-3)
    assert rate.orientation_covariance[0] == -1.0
    found = turned.quaternion
    expected = rotation.as_quat(canonical=True)
    assert [found.x, found.y, found.z, found.w] == pytest.approx(expected.tolist())
