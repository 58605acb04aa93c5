# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights over DDS for the tests that break them: how to fly, whom to kill, and what to compare with."""

import os
import signal
import threading
import time
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


class HeldRestart:
    """Kills a satellite at a step and slows the flight down until its next process is ready.

    Otherwise a flight may end before the new process takes part. The scenario's `node_timeout` has to be
    longer than a process takes to start.
    """

    def __init__(self, folder: Path, step: int, killed: str, held: str, restarted: str) -> None:
        """Nothing is killed yet.

        Args:
            folder: of the run.
            step: from which on the satellite is killed.
            killed: name of the satellite.
            held: name of the satellite that is stopped most of the time meanwhile. It is not stopped for
                good, since the new process is ready only when it has discovered all others.
            restarted: log of the next process, without its suffix.
        """
        self.helper: threading.Thread | None = None
        self._folder, self._step = folder, step
        self._killed, self._held, self._restarted = killed, held, restarted

    def __call__(self, done: int, _all: int) -> None:
        if done < self._step or self.helper is not None:
            return
        there = processes_of(self._folder)
        os.kill(there[self._held], signal.SIGSTOP)
        os.kill(there[self._killed], signal.SIGKILL)
        self.helper = threading.Thread(target=self._resume, args=(there[self._held],))
        self.helper.start()

    def _resume(self, held: int) -> None:
        log = self._folder / "log" / f"{self._restarted}.log"
        end = time.monotonic() + 240.0
        while time.monotonic() < end:
            os.kill(held, signal.SIGCONT)
            if log.exists() and f"{self._killed}: ready" in log.read_text(errors="replace"):
                return
            time.sleep(0.001)  # tests a slow satellite: one that runs for 1 ms in 50 ms
            os.kill(held, signal.SIGSTOP)
            time.sleep(0.05)
        os.kill(held, signal.SIGCONT)
