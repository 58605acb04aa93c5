# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Readings of sensors as messages of sensor_msgs."""

from datetime import UTC, datetime
from typing import Any

import brahe
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import NavSatStatus

from formations import formation
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import Equipment, SensorTopic, TopicPlan
from satform.consensus.graph import NoneSpec
from satform.flight.compile import compile_scenario
from satform.flight.geodetic_fixes import GeodeticFixes, GeodeticPlan
from satform.flight.orbit_states import OrbitStates
from satform.flight.plant import Plant
from satform.flight.simulate import simulate
from satform.orbits.frames import ClosedEarthRotation, LvlhFrame
from satform_nodes.plant.sensor_messages import SensorMessages


class Sent:
    """A publisher that keeps what is published."""

    def __init__(self) -> None:
        self.messages: list[Any] = []

    def publish(self, message: Any) -> None:
        self.messages.append(message)


CHIEF = {
    "kind": "keplerian",
    "semi_major_axis": 6.9e6,
    "inclination": "98 deg",
    "right_ascension": "60 deg",
    "argument_of_latitude": "40 deg",
}


class Still:
    """A plant whose chief stands still over a place of the Earth, seen from inertial space."""

    def __init__(self, frame: LvlhFrame) -> None:
        self.step, self._frame = 0, frame

    def chief_frame(self) -> LvlhFrame:
        return self._frame


@pytest.mark.parametrize(
    ("radial", "along_track", "expected"),
    [
        # Hand-worked: the ellipsoid has the semi-axes 6378137 m and 6356752.3142 m.
        ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], (0.0, 0.0, 7.0e6 + 100.0 - 6378137.0)),
        ([0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], (0.0, 90.0, 7.0e6 + 100.0 - 6378137.0)),
        ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], (90.0, None, 7.0e6 + 100.0 - 6356752.314245)),
    ],
)
def test_positions_of_receivers_are_published_as_places_on_the_earth_at_the_time_of_the_reading(
    radial: list[float], along_track: list[float], expected: tuple[float, float | None, float]
) -> None:
    axes = [np.array(radial), np.array(along_track), np.cross(radial, along_track)]
    frame = LvlhFrame(7.0e6 * axes[0], np.zeros(3), *axes, np.zeros(3))
    still: Any = Still(frame)
    orbits = OrbitStates(datetime(2026, 1, 1, tzinfo=UTC), 0.5, None)
    geodetic = GeodeticFixes(GeodeticPlan(orbits, ClosedEarthRotation(0.0), 2))
    topic = SensorTopic("gnss", "fix", 0, 3, 2, (1.0, 4.0, 9.0))
    plan = TopicPlan(
        (Equipment("sat1", readings=3, sensor_topics=(topic,)),), "arc_length", NoneSpec().build(1)
    )
    sent = Sent()
    messages = SensorMessages(plan, {"/sat1/gnss": sent}, Stamps(0.5, 500_000_000), geodetic)
    for step in range(3):
        still.step = step
        geodetic.note(still)
    messages.publish({0: np.array([100.0, 0.0, 0.0])}, 2)
    messages.publish({0: np.array([100.0, 0.0, 0.0])}, 9)
    (fix,) = sent.messages
    assert (fix.header.stamp.sec, fix.header.stamp.nanosec) == (0, 0)
    assert fix.altitude == pytest.approx(expected[2], abs=1e-3)
    assert fix.latitude == pytest.approx(expected[0], abs=1e-9)
    if expected[1] is not None:
        assert fix.longitude == pytest.approx(expected[1], abs=1e-9)
        # Along-track is east, and the normal north.
        assert fix.position_covariance.tolist() == pytest.approx([4.0, 0, 0, 0, 9.0, 0, 0, 0, 1.0], abs=1e-9)
    assert fix.position_covariance[8] == pytest.approx(1.0)
    assert fix.status.status == NavSatStatus.STATUS_FIX


def test_in_a_flight_they_are_those_of_brahe() -> None:
    scenario = formation(
        [{"arc_length": 0.0, "sensors": [{"kind": "gnss"}]}],
        2.0,
        orbit={"chief": {**CHIEF, "epoch": "2026-03-01T06:00:00Z"}},
        publish_sensor_messages=True,
    )
    plan = compile_scenario(scenario)
    assert plan.geodetic is not None
    plant, fixes = Plant(plan.plant), GeodeticFixes(plan.geodetic)
    fixes.note(plant)
    position = simulate(scenario).inertial_position[0, 0]
    fix = fixes.at(plant.motion().position[0], 0)
    assert fix is not None
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    epoch = brahe.Epoch.from_datetime(2026, 3, 1, 6, 0, 0.0, 0.0, brahe.TimeSystem.UTC)
    fixed = brahe.position_eci_to_ecef(epoch, position)
    expected = brahe.position_ecef_to_geodetic(fixed, brahe.AngleFormat.DEGREES)
    assert [fix.longitude, fix.latitude] == pytest.approx(expected[:2].tolist(), abs=1e-8)
    assert fix.altitude == pytest.approx(float(expected[2]), abs=1e-3)
    assert compile_scenario(scenario.with_({"orbit": {"period": 6000.0}})).geodetic is None


def test_what_arrives_is_published_with_time_and_frame_and_nothing_else_is() -> None:
    topics = (
        SensorTopic("laser_ranging_sat2", "range", 0, 2),
        SensorTopic("gyro", "imu", 2, 3, latency=2),
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
    assert (rate.header.stamp.sec, rate.header.stamp.nanosec) == (0, 500_000_000)
    assert rate.orientation_covariance[0] == -1.0
    found = turned.quaternion
    expected = rotation.as_quat(canonical=True)
    assert [found.x, found.y, found.z, found.w] == pytest.approx(expected.tolist())
