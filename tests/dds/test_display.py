# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The display shows what flies, and the flight does not notice that it is there, or no longer there."""

import os
import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from visualization_msgs.msg import Marker, MarkerArray

from flights import shortened
from satform.bag.reader import read_bag
from satform.communication import topic_table
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import topic_name
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_bringup.deployment.node_processes import NodeProcess
from satform_bringup.supervisor.flight import Flight
from satform_bringup.supervisor.run import fly
from satform_nodes.transport import qos, topic_types

KILOMETRES = 1e-3
"""Length in the markers of one metre, unless the display is told otherwise."""


def hear(observer: Node, kind: str, topic: str, profile: QoSProfile = qos.MARKERS) -> list[Any]:
    """What is published on a topic from now on."""
    heard: list[Any] = []
    observer.create_subscription(topic_types.TYPES[kind], topic, heard.append, profile)
    return heard


def fly_before(observer: Node, scenario: Scenario, out: Path) -> Flight:
    """Fly with a display while the observer listens."""
    with ThreadPoolExecutor(1) as pool:
        flying = pool.submit(fly, scenario, out, record=True, progress=lambda _done, _all: None, display=True)
        # What a flight waits for is bounded.
        while not flying.done():
            rclpy.spin_once(observer, timeout_sec=0.05)
    for _ in range(50):
        rclpy.spin_once(observer, timeout_sec=0.0)
    return flying.result()


def step_of(message: Any, stamps: Stamps, frame: str = "lvlh") -> int:
    assert message.header.frame_id == frame
    return stamps.step(message.header.stamp.sec, message.header.stamp.nanosec)


def place(point: Any) -> list[float]:
    return [point.x, point.y, point.z]


def assert_poses_are_those_of(
    record: FlightRecord, column: int, poses: list[PoseStamped], stamps: Stamps
) -> None:
    for message in poses:
        step = step_of(message, stamps)
        shown = place(message.pose.position)
        # Metres, as in /<satellite>/state.
        np.testing.assert_array_equal(shown, record.position[step, column])
        turned = message.pose.orientation
        quaternion = np.array([turned.x, turned.y, turned.z, turned.w])
        assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12)


def assert_markers_are_those_of(record: FlightRecord, message: MarkerArray, stamps: Stamps) -> None:
    by_group: dict[str, list[Marker]] = {}
    for marker in message.markers:
        by_group.setdefault(marker.ns, []).append(marker)
    for column, ball in enumerate(by_group["satellites"]):
        step = step_of(ball, stamps, "lvlh_km")
        assert ball.type == Marker.SPHERE
        np.testing.assert_array_equal(place(ball.pose.position), record.position[step, column] * KILOMETRES)
    assert [marker.text for marker in by_group["names"]] == list(record.satellites)
    (links,) = by_group["links"]
    # Two points for each of the six directed links of three satellites that all hear each other.
    assert len(links.points) == len(links.colors) == 12
    for orbit in by_group["orbits"]:
        assert place(orbit.points[0]) == place(orbit.points[-1])


@pytest.mark.unmeasured
def test_the_display_shows_what_the_in_process_run_computes_and_changes_no_bit(
    observer: Node, tmp_path: Path
) -> None:
    # Long enough for observer and display to discover each other on busy cores.
    scenario = shortened("triangle", 1200.0)
    stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
    poses = [hear(observer, "pose", topic_name("pose", spec.name)) for spec in scenario.satellites]
    paths = [hear(observer, "path", topic_name("path", spec.name)) for spec in scenario.satellites]
    markers = hear(observer, "markers", topic_table.MARKERS)
    transforms = hear(observer, "tf", topic_table.TF, qos.TRANSFORMS)
    flight = fly_before(observer, scenario, tmp_path)
    assert flight.lost == ()
    assert flight.missed == ()

    record = simulate(scenario)
    bag = read_bag(tmp_path / "bag")
    assert bag.complete
    assert record.differences(bag.record) == []
    for column, (seen, paths_seen) in enumerate(zip(poses, paths, strict=True)):
        assert len(seen) > 1
        assert_poses_are_those_of(record, column, seen, stamps)
        assert step_of(seen[-1], stamps) == record.steps
        assert_poses_are_those_of(record, column, paths_seen[-1].poses, stamps)
        steps = [step_of(pose, stamps) for pose in paths_seen[-1].poses]
        assert steps == sorted(set(steps))
    assert_markers_are_those_of(record, markers[-1], stamps)
    # Of either topic an observer on a busy machine may miss some.
    assert len(transforms) > 1
    for message in transforms:
        assert [entry.child_frame_id for entry in message.transforms] == list(record.satellites)
        for column, entry in enumerate(message.transforms):
            step = step_of(entry, stamps)
            np.testing.assert_array_equal(place(entry.transform.translation), record.position[step, column])
    last = transforms[-1].transforms[1]
    assert last.header == poses[1][-1].header
    assert last.transform.rotation == poses[1][-1].pose.orientation


@pytest.mark.parametrize(
    "number", [signal.SIGSTOP, pytest.param(signal.SIGKILL, marks=pytest.mark.unmeasured)]
)
def test_a_display_that_dies_or_hangs_in_flight_does_not_matter(
    number: signal.Signals, tmp_path: Path
) -> None:
    scenario = shortened("triangle", 200.0)
    ended: list[int] = []

    def end_the_display(done: int, _all: int) -> None:
        if done > 50 and not ended:
            ended.append(process_that_prints_to(tmp_path / "log" / "display.log"))
            os.kill(ended[0], number)

    flight = fly(scenario, tmp_path, record=True, progress=end_the_display, display=True)
    assert ended
    assert flight.lost == ()
    assert flight.reason == ""
    assert flight.missed == ()
    assert flight.steps == scenario.timing.steps
    assert simulate(scenario).differences(read_bag(tmp_path / "bag").record) == []
    assert not Path(f"/proc/{ended[0]}").exists()


def process_that_prints_to(log: Path) -> int:
    for descriptor in Path("/proc").glob("[0-9]*/fd/1"):
        try:
            if descriptor.readlink() == log:
                return int(descriptor.parts[2])
        except OSError:
            continue
    raise AssertionError(f"no process prints to {log}")


@pytest.mark.parametrize(("name", "value"), [("display_scale", "wide"), ("frame_rate", "0.0")])
def test_a_parameter_that_is_no_number_above_zero_is_refused_with_a_sentence(
    name: str, value: str, fleet: Callable[..., list], tmp_path: Path
) -> None:
    file = tmp_path / "scenario.json"
    file.write_text(shortened("triangle", 10.0).to_json())

    class Awkward(NodeProcess):
        def arguments(self) -> list[str]:
            return [*super().arguments(), "-p", f"{name}:={value}"]

    (process,) = fleet([Awkward("display", "display_node", {"scenario": str(file)})])
    assert process.wait(60) == 2
    words = (tmp_path / "display.log").read_text()
    assert f"{name} is" in words
    assert "a number above zero" in words
    assert "Traceback" not in words


def test_the_former_name_of_a_parameter_is_answered_with_the_present_one(
    fleet: Callable[..., list], tmp_path: Path
) -> None:
    file = tmp_path / "scenario.json"
    file.write_text(shortened("triangle", 10.0).to_json())

    class Former(NodeProcess):
        def arguments(self) -> list[str]:
            return [*super().arguments(), "-p", "frames_per_lap:=50.0"]

    (process,) = fleet([Former("display", "display_node", {"scenario": str(file)})])
    assert process.wait(60) == 2
    assert "frames_per_lap is now called frames_per_period" in (tmp_path / "display.log").read_text()


def test_a_display_without_a_formation_ends_when_it_is_asked_to(
    fleet: Callable[..., list], tmp_path: Path, observer: Node
) -> None:
    file = tmp_path / "scenario.json"
    file.write_text(shortened("triangle", 10.0).to_json())
    (process,) = fleet([NodeProcess("display", "display_node", {"scenario": str(file)})])
    end = time.monotonic() + 60.0
    while not observer.count_publishers(topic_table.MARKERS):
        assert time.monotonic() < end, "the display does not start"
        rclpy.spin_once(observer, timeout_sec=0.05)
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 130
    assert "Traceback" not in (tmp_path / "display.log").read_text()
