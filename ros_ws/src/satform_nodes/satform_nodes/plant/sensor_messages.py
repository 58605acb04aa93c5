# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings of sensors as messages of sensor_msgs, for programs that know these; no node waits for them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from geometry_msgs.msg import QuaternionStamped
from sensor_msgs.msg import Imu, Range

from satform.communication.sim_time import Stamps
from satform.communication.topic_table import SensorTopic, TopicPlan, topic_name
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import quaternion


class SensorMessages:
    """Publishes the readings that arrive in a step, on one topic for each channel."""

    def __init__(self, plan: TopicPlan, publishers: Mapping[str, Any], stamps: Stamps) -> None:
        """Nothing has been published yet.

        Args:
            plan: of the flight's topics.
            publishers: of the plant, by the names of their topics.
            stamps: of the steps.
        """
        self._stamps = stamps
        self._topics = [
            (index, own.name, topic, publishers[topic_name(topic.name, own.name)])
            for index, own in enumerate(plan.satellites)
            for topic in own.sensor_topics
        ]

    def publish(self, readings: Mapping[int, Array], step: int) -> None:
        """Publish what arrives in a step.

        Args:
            readings: of all channels of each satellite by its index, not a number where none arrive.
            step: its number.
        """
        for index, satellite, topic, publisher in self._topics:
            values = readings[index][topic.first : topic.first + topic.numbers]
            if np.isfinite(values).all():
                message = _message(topic, values.tolist())
                message.header.stamp.sec, message.header.stamp.nanosec = self._stamps.at(step)
                message.header.frame_id = satellite
                publisher.publish(message)


def _message(topic: SensorTopic, values: list[float]) -> Any:
    """A message of the topic's kind with the numbers of a reading."""
    if topic.kind == "range":
        # Neither of the two kinds of radiation that the message knows is a radio signal.
        return Range(radiation_type=Range.INFRARED, range=values[0], max_range=float("inf"))
    if topic.kind == "imu":
        rate = Imu()
        rate.angular_velocity.x, rate.angular_velocity.y, rate.angular_velocity.z = values
        # By the definition of the message: there is no orientation and no acceleration in it.
        rate.orientation_covariance[0] = rate.linear_acceleration_covariance[0] = -1.0
        return rate
    turned = QuaternionStamped()
    scalar, vector = quaternion(np.array(values))
    turned.quaternion.w = float(scalar)
    turned.quaternion.x, turned.quaternion.y, turned.quaternion.z = vector.tolist()
    return turned
