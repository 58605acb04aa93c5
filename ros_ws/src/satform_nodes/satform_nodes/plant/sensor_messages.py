# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings of sensors as messages of sensor_msgs, for programs that know these; no node waits for them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from geometry_msgs.msg import QuaternionStamped
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus, Range

from satform.communication.sim_time import Stamps
from satform.communication.topic_table import SensorTopic, TopicPlan, topic_name
from satform.flight.geodetic_fixes import GeodeticFixes
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import quaternion


class SensorMessages:
    """Publishes the readings that arrive in a step, on one topic for each channel."""

    def __init__(
        self,
        plan: TopicPlan,
        publishers: Mapping[str, Any],
        stamps: Stamps,
        geodetic: GeodeticFixes | None = None,
    ) -> None:
        """Nothing has been published yet.

        Args:
            plan: of the flight's topics.
            publishers: of the plant, by the names of their topics.
            stamps: of the steps.
            geodetic: positions on the Earth; None where no topic has them.
        """
        self._stamps = stamps
        self._geodetic = geodetic
        self._topics = [
            (index, own.name, topic, publishers[topic_name(topic.name, own.name)])
            for index, own in enumerate(plan.satellites)
            for topic in own.sensor_topics
        ]

    def publish(self, readings: Mapping[int, Array], step: int) -> None:
        """Publish what arrives in a step, with the time at which it was measured.

        Args:
            readings: of all channels of each satellite by its index, not a number where none arrive.
            step: its number.
        """
        for index, satellite, topic, publisher in self._topics:
            values = readings[index][topic.first : topic.first + topic.numbers]
            if np.isfinite(values).all():
                taken = step - topic.latency
                message = self._fix(topic, values, taken) if topic.kind == "fix" else _message(topic, values)
                if message is None:
                    continue
                message.header.stamp.sec, message.header.stamp.nanosec = self._stamps.at(taken)
                message.header.frame_id = satellite
                publisher.publish(message)

    def _fix(self, topic: SensorTopic, values: Array, step: int) -> NavSatFix | None:
        """A position on the Earth with its covariance; None where the chief's is not known."""
        fix = None if self._geodetic is None else self._geodetic.at(values[:3], step)
        if fix is None:
            return None
        covariance = (fix.local_axes * np.array(topic.variance[:3])) @ fix.local_axes.T
        return NavSatFix(
            status=NavSatStatus(status=NavSatStatus.STATUS_FIX, service=NavSatStatus.SERVICE_GPS),
            latitude=fix.latitude,
            longitude=fix.longitude,
            altitude=fix.altitude,
            position_covariance=covariance.ravel(),
            position_covariance_type=NavSatFix.COVARIANCE_TYPE_KNOWN,
        )


def _message(topic: SensorTopic, reading: Array) -> Any:
    """A message of the topic's kind with the numbers of a reading."""
    values = reading.tolist()
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
