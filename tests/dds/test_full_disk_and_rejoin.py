# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A disk without room ends a flight by its name and step; a satellite that flies cannot be started again."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger

from flights import shortened
from flown import assert_as_in_one_process, flown, processes_of
from satform_bringup.supervisor import rejoin
from satform_bringup.supervisor.run import fly


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of its own with room for the beginning of a bag."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", str(place)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("NOT TESTED: only root can mount a small disk")
    yield place
    subprocess.run(["umount", "--lazy", str(place)], check=True)


def test_a_bag_without_room_ends_the_flight_naming_disk_and_step(small_disk: Path) -> None:
    scenario = shortened("triangle", 6000.0)
    flight = fly(scenario, small_disk, record=True, progress=lambda _done, _all: None)
    assert flight.lost == ("recorder",)
    assert 0 < flight.steps < scenario.timing.steps
    assert f"{small_disk}/bag: the bag cannot be written after step" in flight.reason
    assert f"the disk is full: {small_disk} has 0." in flight.reason
    assert processes_of(small_disk) == {}


@pytest.mark.parametrize(
    ("satellite", "rate"), [("sat1", 0.0), ("sat2", 10.0)], ids=["lockstep", "wall clock"]
)
def test_a_satellite_that_is_not_lost_cannot_be_started_again_and_flies_on(
    observer: Node, tmp_path: Path, satellite: str, rate: float
) -> None:
    rejections: list[str] = []

    def start_again_then_stop(done: int, _all: int) -> None:
        # On the wall clock steps are taken meanwhile: those that a second process may miss are over.
        if done < (10 if rate else 1) or rejections:
            return
        with pytest.raises(rejoin.RejoinError) as refused:
            rejoin.rejoin(tmp_path / "run", satellite)
        rejections.append(str(refused.value))
        client = observer.create_client(Trigger, "/formation/stop")
        assert client.wait_for_service(30.0)
        rclpy.spin_until_future_complete(observer, client.call_async(Trigger.Request()), timeout_sec=30.0)

    scenario = shortened("triangle", 5000.0, *(["node_timeout=3.0"] if rate else []))
    flight, bag = flown(scenario, tmp_path / "run", start_again_then_stop, rate=rate)
    (sentence,) = rejections
    assert sentence.startswith(f"{satellite} is not lost: another process flies it, at step ")
    assert sentence.endswith("only a lost satellite can rejoin")
    assert flight.lost == ()
    assert flight.losses == ()
    assert flight.stopped
    assert bag.record.steps > 3


def test_a_flight_whose_checkpoints_have_no_room_ends_well_and_says_so(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    # A file where the folder of the checkpoints is to be: nothing can be written below it, by nobody.
    (tmp_path / "run" / "checkpoints").write_text("")
    flight, bag = flown(shortened("triangle", 100.0, "checkpoint_period=10.0"), tmp_path / "run")
    assert flight.lost == ()
    assert len(flight.warnings) == 3
    for warning in flight.warnings:
        assert "10 checkpoints were not written" in warning
        assert "there is none" in warning
    assert_as_in_one_process(bag)
