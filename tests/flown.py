# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights over DDS for the tests that break them: how to fly, whom to kill, and what to compare with."""

import os
from collections.abc import Callable
from pathlib import Path

from mcap_ros2.reader import read_ros2_messages

import rosbag2_format
from satform.bag.reader import Bag, read_bag
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_bringup.supervisor.flight import Flight, Policy
from satform_bringup.supervisor.run import fly
from satform_tools.run.replay import compare


def repetitions(few: int) -> int:
    """How often a test repeats what chance decides: a few times, or as often as SATFORM_SOAK says."""
    return int(os.environ.get("SATFORM_SOAK", few))


def flown(
    scenario: Scenario,
    out: Path,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
    group: int = 1,
    **policy: bool | float,
) -> tuple[Flight, Bag]:
    """A recorded flight in lockstep and its bag."""
    out.mkdir(exist_ok=True)
    flight = fly(scenario, out, record=True, progress=progress, group=group, policy=Policy(**policy))
    assert processes_of(out) == {}
    return flight, read_bag(out / "bag")


def assert_as_in_one_process(bag: Bag) -> None:
    """The whole flight is in the bag, with the bits of the scenario alone flown in one process."""
    assert bag.complete
    rosbag2_format.read(bag.path.parent)
    assert bag.events == {}
    assert simulate(bag.scenario).differences(bag.record) == []


def assert_flies_again(bag: Bag) -> None:
    """Flown once more with what happened in it, the flight has the same bits."""
    assert list(compare(bag.scenario, bag.record, bag.events).differences) == []


def refused(bag: Path) -> dict[str, int]:
    """What the nodes' diagnostics say of rejected messages, by node, topic and reason: the largest count."""
    found: dict[str, int] = {}
    for message in read_ros2_messages(str(bag), topics=["/diagnostics"]):
        for status in message.ros_msg.status:
            for value in status.values:
                if value.key.startswith("rejected messages: "):
                    reason = f"{status.hardware_id}: {value.key.removeprefix('rejected messages: ')}"
                    found[reason] = max(found.get(reason, 0), int(value.value))
    return found


def processes_of(folder: Path) -> dict[str, int]:
    """Numbers of the processes that print into a run's logs, by the log's name."""
    found = {}
    for descriptor in Path("/proc").glob("[0-9]*/fd/1"):
        try:
            target = descriptor.readlink()
        except OSError:
            continue
        if target.is_relative_to(folder / "log"):
            found[target.stem] = int(descriptor.parts[2])
    return found
