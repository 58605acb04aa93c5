"""The node that keeps the flight: every message of every step, written as it passes."""

import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import yaml
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from satform_msgs.msg import FormationStatus, ParameterChange, Ready, Recorded

from satform.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.scenario import Scenario
from satform_nodes import topics
from satform_nodes.bag_writer import BagWriter
from satform_nodes.definitions import definition, type_name
from satform_nodes.executor import StepExecutor
from satform_nodes.lifetime import PATIENCE, NodeError, StopRequest, run, scenario_of
from satform_nodes.parameters import declare_fixed
from satform_nodes.readiness import Company
from satform_nodes.report import Report
from satform_nodes.stamps import NANOSECONDS, Stamps
from satform_nodes.wire import layout

_RECORDED = layout(Recorded, topics.FRAME)

_SAID_BY_PLANT = frozenset({"state", "attitude", "truth", "propulsion"})

_CLOCK_BYTES = 12
"""Length of a serialised clock: encapsulation, seconds, nanoseconds."""

_REPORT_EVERY = 128
"""Steps between two words to the plant about how far the recording is."""

_LATE = 2.0
"""Wall-clock time without a message after which those that are missing at the end count as lost, s."""

_LAST_WORDS = 0.1
"""Wall-clock time after the end of the flight in which words still count, s."""


class RecorderNode:
    """Writes what passes on the formation's topics, and knows what has to pass."""

    def __init__(
        self, node: Node, executor: StepExecutor, scenario: Scenario, folder: Path, report: Report
    ) -> None:
        self.node = node
        self.report = report
        self.ended: FormationStatus | None = None
        self.missed: list[str] = []
        self._stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
        self._last_step = scenario.timing.steps
        self._reported = 0
        self._latest: list[int] = []
        self._lasts: list[int] = []
        try:
            self.bag = BagWriter(
                folder, scenario, {name: version(name) for name in ("satform", "numpy", "scipy")}
            )
        except FileExistsError:
            raise NodeError(f"{folder}: holds a bag already; choose another folder", EXIT_BAD_INPUT) from None
        except OSError as error:
            raise NodeError(f"{folder}: cannot be written to: {error.strerror}", EXIT_BAD_INPUT) from None

        self._say_ready = node.create_publisher(Ready, topics.READY, topics.LATCHED)
        self._say_recorded = node.create_publisher(Recorded, topics.RECORDED, topics.STEPPED)
        self._company = Company(node)
        self._company.listens(self._say_recorded, ["plant"])
        self._company.listens(self._say_ready, ["plant"])
        for index, satellite in enumerate(scenario.satellites):
            equipped = scenario.satellite(index)
            # States and announcements are told for the state after the last step too.
            told = [
                "state",
                scenario.consensus.announces,
                *(["truth"] if equipped.sensor is not None else []),
                *(["attitude"] if equipped.attitude is not None else []),
            ]
            decided = ["command", "tracking", *(["propulsion"] if equipped.thruster is not None else [])]
            for kind, last in (*((kind, 0) for kind in told), *((kind, 1) for kind in decided)):
                speaker = "plant" if kind in _SAID_BY_PLANT else satellite.name
                form = layout(topics.TYPES[kind], topics.FRAME)
                topic = getattr(topics, kind)(satellite.name)
                self._follow(executor, kind, topic, speaker, self._last_step - last, form.unpack)
            changes = topics.parameter_changes(satellite.name)
            self._listen("parameter_changes", changes, satellite.name, self._write_stepped)
        self._follow(executor, "clock", topics.CLOCK, "plant", self._last_step, self._read_clock)
        self._listen("status", topics.STATUS, "plant", self._on_status)

    @property
    def recorded_step(self) -> int:
        """Last step of which everything is in the bag; -1 before the first."""
        return min(self._latest)

    def lags(self) -> bool:
        """Whether messages are missing of the steps that were complete when the flight ended."""
        return self.ended is not None and any(
            latest < min(last, self.ended.step - 1)
            for latest, last in zip(self._latest, self._lasts, strict=True)
        )

    @property
    def complete(self) -> bool:
        """Whether every message of the whole flight is in the bag."""
        return all(latest >= last for latest, last in zip(self._latest, self._lasts, strict=True))

    def matched(self) -> bool:
        """Whether all topics have their publisher, seen from this side."""
        return self._company.complete()

    def say_ready(self) -> None:
        """Tell the plant that recording can begin."""
        self._say_ready.publish(Ready(node=self.node.get_fully_qualified_name(), step=0))

    def _add_topic(self, topic: str, kind: str, profile: QoSProfile) -> int:
        message_type = topics.TYPES[kind]
        return self.bag.add_topic(
            topic, type_name(message_type), definition(message_type), _profile_text(profile)
        )

    def _follow(
        self,
        executor: StepExecutor,
        kind: str,
        topic: str,
        speaker: str,
        last: int,
        read: Callable[[bytes], tuple[Any, ...] | None],
    ) -> None:
        """Write every message of a topic that has one at each step, and notice a gap.

        Args:
            executor: hands out the messages.
            kind: of topic, for its type.
            topic: name of the topic.
            speaker: name of the node that publishes there.
            last: step of its last message.
            read: gives seconds, nanoseconds and step of a message; None when it is not one.
        """
        channel = self._add_topic(topic, kind, topics.STEPPED)
        place = len(self._latest)
        self._latest.append(-1)
        self._lasts.append(last)

        def _on_message(data: bytes) -> None:
            numbers = read(data)
            if numbers is None:
                self.missed.append(f"{topic}: a message of another form")
                return
            seconds, nanoseconds, step = numbers[:3]
            if step != self._latest[place] + 1:
                self.missed.append(f"{topic}: step {step} after step {self._latest[place]}")
            self._latest[place] = step
            self.bag.write(channel, seconds * NANOSECONDS + nanoseconds, data, step)
            self._report_progress(step)

        subscription = executor.subscribe(self.node, topics.TYPES[kind], topic, _on_message, topics.STEPPED)
        self._company.speaks(subscription, [speaker])

    def _read_clock(self, data: bytes) -> tuple[int, int, int] | None:
        """Seconds, nanoseconds and step of a clock message, which has no header."""
        if len(data) != _CLOCK_BYTES:
            return None
        seconds = int.from_bytes(data[4:8], "little", signed=True)
        nanoseconds = int.from_bytes(data[8:12], "little")
        return seconds, nanoseconds, self._stamps.step(seconds, nanoseconds)

    def _listen(self, kind: str, topic: str, speaker: str, callback: Callable[[Any, int], None]) -> None:
        """Write a topic on which something is said now and then."""
        channel = self._add_topic(topic, kind, topics.LATCHED)
        subscription = self.node.create_subscription(
            topics.TYPES[kind], topic, lambda message: callback(message, channel), topics.LATCHED
        )
        self._company.speaks(subscription, [speaker])

    def _write_stepped(self, message: ParameterChange | FormationStatus, channel: int) -> None:
        stamp = message.header.stamp
        self.bag.write(
            channel, stamp.sec * NANOSECONDS + stamp.nanosec, serialize_message(message), message.step
        )

    def _on_status(self, status: FormationStatus, channel: int) -> None:
        self._write_stepped(status, channel)
        if status.phase in (FormationStatus.FINISHED, FormationStatus.ABORTED):
            self.ended = status

    def _report_progress(self, step: int) -> None:
        if step < self._reported + _REPORT_EVERY and step < self._last_step - 1:
            return
        reached = self._last_step if self.complete else min(self._latest)
        if reached <= self._reported and not self.complete:
            return
        self._reported = reached
        self.bag.flush()
        seconds, nanoseconds = self._stamps.at(reached)
        self._say_recorded.publish(_RECORDED.pack(seconds, nanoseconds, reached, self.bag.messages))


def fly(node: Node, executor: StepExecutor, stop: StopRequest, report: Report) -> int:
    """Be ready before the first step, write until the flight has ended, and close the bag."""
    declare_fixed(node, "scenario", "", "path of the scenario file")
    folder = declare_fixed(node, "bag", "", "folder of the bag to be written")
    scenario = scenario_of(node)
    if not folder:
        raise NodeError(
            "recorder needs the parameter bag: the folder of the bag to be written", EXIT_BAD_INPUT
        )
    recorder = RecorderNode(node, executor, scenario, Path(folder), report)
    try:
        _record(recorder, executor, stop, max(PATIENCE, 2.0 * scenario.tolerated_silence))
    except OSError as error:
        raise NodeError(f"{folder}: cannot be written to: {error.strerror}", EXIT_LOST) from None
    finally:
        recorder.report.say(
            "recorded",
            messages=recorder.bag.messages,
            complete=recorder.complete,
            missed=recorder.missed[:20],
        )
    return EXIT_STOPPED if stop.asked else EXIT_DONE


def _record(recorder: RecorderNode, executor: StepExecutor, stop: StopRequest, patience: float) -> None:
    """Write until the flight is over or a stop is asked for; the bag is closed in any case."""
    try:
        if not executor.spin_until(lambda: recorder.matched() or recorder.ended or stop.asked, PATIENCE):
            raise NodeError(f"the recorder has not found all topics within {PATIENCE:g} s", EXIT_LOST)
        recorder.say_ready()
        recorder.report.say("ready", node="recorder")
        heard = executor.spin_at_leisure(
            lambda: recorder.ended is None and not stop.asked, patience, stop.pause
        )
        if not heard:
            sentence = f"nothing to record for {patience:g} s: the plant is silent"
            recorder.report.say("lost", who=["plant"], step=recorder.recorded_step, reason=sentence)
            raise NodeError(sentence, EXIT_LOST)
        # What was said in the last steps may still be on its way, or be sent once more.
        executor.spin_while(lambda: recorder.lags() and not stop.asked, _LATE)
        # So may what was said on topics that are looked at now and then.
        executor.spin_until(lambda: stop.asked, _LAST_WORDS)
    finally:
        recorder.bag.close()


def _profile_text(profile: QoSProfile) -> str:
    """A profile as rosbag2 writes it."""
    described = {
        "history": profile.history.short_key,
        "depth": profile.depth,
        "reliability": profile.reliability.short_key,
        "durability": profile.durability.short_key,
        "deadline": {"sec": 0, "nsec": 0},
        "lifespan": {"sec": 0, "nsec": 0},
        "liveliness": "automatic",
        "liveliness_lease_duration": {"sec": 0, "nsec": 0},
        "avoid_ros_namespace_conventions": False,
    }
    return str(yaml.safe_dump([described], sort_keys=False))


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Record a flight; entry point of the executable `recorder_node`."""
    return run("recorder", fly, arguments, Report(pipe))


if __name__ == "__main__":
    sys.exit(main())
