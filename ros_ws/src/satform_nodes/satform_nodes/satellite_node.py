"""The node of one satellite: state and neighbours' phases in, command and own phase out."""

import resource
import sys
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from rclpy.duration import Duration
from satform_msgs.msg import Attitude as AttitudeMessage
from satform_msgs.msg import (
    Command,
    FormationStatus,
    ParameterChange,
    Ready,
    RelativeState,
    Tracking,
)

from satform.announcements import WIDTH, heard, numbers
from satform.control.attitude import AttitudeTrackingSpec
from satform.control.protocol import ControllerSpec, Motion
from satform.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.orientation import Attitude
from satform.satellite import Decision, Satellite, flight_setting
from satform.scenario import Scenario
from satform.spec import Spec
from satform_nodes import topics
from satform_nodes.executor import StepExecutor
from satform_nodes.lifetime import PATIENCE, NodeError, StopRequest, run, scenario_of
from satform_nodes.parameters import FormationNode, declare_fixed, declare_spec, on_spec_change
from satform_nodes.readiness import Company
from satform_nodes.report import Report
from satform_nodes.stamps import Stamps
from satform_nodes.wire import layout

_STATE = layout(RelativeState, topics.FRAME)
_ATTITUDE = layout(AttitudeMessage, topics.FRAME)
_COMMAND = layout(Command, topics.FRAME)
_TRACKING = layout(Tracking, topics.FRAME)
_NO_TORQUE = (0.0, 0.0, 0.0)


_FAREWELL = Duration(seconds=2)
"""How long a satellite stays for the sake of what it said last."""

_KILOBYTE = 1024
"""Unit in which Linux tells the memory of a process, bytes."""


class SatelliteNode:
    """Carries the flight software of one satellite; every formula is in `satform`."""

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        scenario: Scenario,
        name: str,
        recorded: bool,
        report: Report,
    ) -> None:
        names = [satellite.name for satellite in scenario.satellites]
        if name not in names:
            raise NodeError(
                f"there is no satellite {name!r} in the scenario; there are {', '.join(names)}",
                EXIT_BAD_INPUT,
            )
        self.node = node
        self.name = name
        self.executor = executor
        self.scenario = scenario
        self.index = names.index(name)
        self.report = report
        self.satellite = Satellite.of(scenario, self.index)
        self._stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
        graph = scenario.communication_graph()
        self._neighbours = graph.neighbours(self.index)
        # What each neighbour said: its time, then the numbers of its announcement.
        self._heard_now: dict[int, tuple[float, ...]] = {}
        self._heard_next: dict[int, tuple[float, ...]] = {}
        self._weight = np.ones(len(self._neighbours))
        self._silence = np.zeros((0, 1 + WIDTH[scenario.consensus.announces]))
        self._state: tuple[float, ...] | None = None
        self._measured_step = 0
        self._turns = scenario.satellite(self.index).attitude is not None
        self._attitude: Attitude | None = None
        self._changes: list[tuple[str, list[float]]] = []
        self.step = 0
        self.refused = 0
        self.busy_seconds = 0.0
        self.ended: FormationStatus | None = None

        self._controls = _controls(scenario, self.index)
        for prefix in self._controls:
            self._declare_gains(prefix)

        self._announces = scenario.consensus.announces
        announcement, topic_of = topics.TYPES[self._announces], getattr(topics, self._announces)
        self._announcement = layout(announcement, topics.FRAME)
        self._say_announcement = node.create_publisher(announcement, topic_of(name), topics.STEPPED)
        self._say_command = node.create_publisher(Command, topics.command(name), topics.STEPPED)
        self._say_tracking = node.create_publisher(Tracking, topics.tracking(name), topics.STEPPED)
        self._say_change = node.create_publisher(
            ParameterChange, topics.parameter_changes(name), topics.LATCHED
        )
        self._say_ready = node.create_publisher(Ready, topics.READY, topics.LATCHED)
        self._company = Company(node)
        self._listen_to_plant()
        for neighbour in self._neighbours:
            self._listen_to(neighbour, announcement, topic_of(names[neighbour]))
        # Made last: whoever sees this subscription has seen all others of this satellite.
        status = node.create_subscription(FormationStatus, topics.STATUS, self._on_status, topics.LATCHED)
        self._spoken = (self._say_command, self._say_announcement, self._say_tracking, self._say_change)
        watching = ["recorder"] if recorded else []
        self._company.speaks(status, ["plant"])
        self._company.listens(self._say_ready, ["plant"])
        self._company.listens(self._say_command, ["plant", *watching])
        self._company.listens(self._say_tracking, watching)
        listeners = [names[listener] for listener in graph.listeners(self.index)]
        self._company.listens(self._say_announcement, [*listeners, *watching])

    def _listen_to_plant(self) -> None:
        told: list[tuple[Any, str, Any]] = [(RelativeState, topics.state(self.name), self._on_state)]
        if self._turns:
            told.append((AttitudeMessage, topics.attitude(self.name), self._on_attitude))
        for message, topic, callback in told:
            subscription = self.executor.subscribe(self.node, message, topic, callback, topics.STEPPED)
            self._company.speaks(subscription, ["plant"])

    def _listen_to(self, neighbour: int, message: Any, topic: str) -> None:
        callback, speaker = self._hearing(neighbour), self.scenario.satellites[neighbour].name
        subscription = self.executor.subscribe(self.node, message, topic, callback, topics.STEPPED)
        self._company.speaks(subscription, [speaker])

    def matched(self) -> bool:
        """Whether everyone this satellite talks to or listens to is there, seen from this side."""
        return self._company.complete()

    def say_ready(self) -> None:
        """Tell the plant that this satellite can fly."""
        self._say_ready.publish(Ready(node=self.node.get_fully_qualified_name(), step=self.step))

    def see_off(self) -> None:
        """Stay until what was said last has arrived, for a bounded time: it would be lost with this node."""
        for publisher in self._spoken:
            if not publisher.wait_for_all_acked(_FAREWELL):
                return

    def say_how_it_went(self) -> None:
        """Tell whoever started the process what this satellite did."""
        self.report.say(
            "satellite", node=self.name, step=self.step, busy=self.busy_seconds, refused=self.refused
        )

    def _hearing(self, neighbour: int) -> Any:
        def _on_announcement(data: bytes) -> None:
            said = self._announcement.unpack(data)
            if said is None:
                self.refused += 1
                return
            step = said[2]
            if step == self.step:
                self._heard_now[neighbour] = (self._stamps.time(said[0], said[1]), *said[3:])
            elif step == self.step + 1:
                self._heard_next[neighbour] = (self._stamps.time(said[0], said[1]), *said[3:])
            else:
                self.refused += 1
            self._act_if_complete()

        return _on_announcement

    def _on_state(self, data: bytes) -> None:
        numbers = _STATE.unpack(data)
        if numbers is None or numbers[2] != self.step:
            self.refused += 1
            return
        self._state = numbers[3:]
        self._measured_step = self._stamps.step(numbers[0], numbers[1])
        if self.step == 0:
            self._announce()
        self._act_if_complete()

    def _on_attitude(self, data: bytes) -> None:
        numbers = _ATTITUDE.unpack(data)
        if numbers is None or numbers[2] != self.step:
            self.refused += 1
            return
        self._attitude = Attitude(*np.array(numbers[3:12]).reshape(3, 3))
        self._act_if_complete()

    def _on_status(self, status: FormationStatus) -> None:
        if status.phase in (FormationStatus.FINISHED, FormationStatus.ABORTED):
            self.ended = status

    def _act_if_complete(self) -> None:
        if self._state is None or len(self._heard_now) < len(self._neighbours):
            return
        if self._turns and self._attitude is None:
            return
        state, step = self._state, self.step
        if step >= self.scenario.timing.steps:
            self._state = None
            return
        # The processor's time: the wall clock would count those who are let in meanwhile.
        begin = time.thread_time()
        said = self._silence
        if self._neighbours:
            said = np.array([self._heard_now[neighbour] for neighbour in self._neighbours])
        motion = Motion(np.array(state[:3]), np.array(state[3:6]))
        neighbours = heard(self._announces, said[:, 1:], said[:, 0], self._weight)
        decision = self.satellite.act(motion, neighbours, self._measured_step, self._attitude)
        self.busy_seconds += time.thread_time() - begin
        seconds, nanoseconds = self._stamps.at(step)
        torque = _NO_TORQUE if decision.wheel_torque is None else decision.wheel_torque.tolist()
        command = _COMMAND.pack(seconds, nanoseconds, step, *decision.acceleration.tolist(), *torque)
        self._say_command.publish(command)
        self._state = self._attitude = None
        self._heard_now, self._heard_next = self._heard_next, {}
        self.step = step + 1
        self._announce()
        self._show(seconds, nanoseconds, step, decision)
        self._tell_changes(step)

    def _announce(self) -> None:
        said = self.satellite.announce()
        seconds, nanoseconds = self._stamps.at_time(float(said.time))
        values = numbers(said).tolist()
        self._say_announcement.publish(self._announcement.pack(seconds, nanoseconds, self.step, *values))

    def _show(self, seconds: int, nanoseconds: int, step: int, decision: Decision) -> None:
        reference, motion = decision.reference, decision.motion
        self._say_tracking.publish(
            _TRACKING.pack(
                seconds,
                nanoseconds,
                step,
                *reference.position.tolist(),
                *reference.velocity.tolist(),
                *reference.acceleration.tolist(),
                *(motion.position - reference.position).tolist(),
                *(motion.velocity - reference.velocity).tolist(),
                *decision.sliding_variable.tolist(),
            )
        )

    def _declare_gains(self, prefix: str) -> None:
        def accept(spec: Spec, fields: dict[str, Any]) -> str:
            return self._accept_gains(prefix, spec, fields)

        declare_spec(self.node, prefix, self._controls[prefix])
        on_spec_change(self.node, prefix, lambda: self._controls[prefix], accept)

    def _accept_gains(self, prefix: str, spec: Spec, fields: dict[str, Any]) -> str:
        if isinstance(spec, AttitudeTrackingSpec):
            self.satellite.use_attitude_controller(spec)
        elif isinstance(spec, ControllerSpec):
            self.satellite.use_controller(spec, flight_setting(self.scenario))
        self._controls[prefix] = spec
        for name, value in fields.items():
            numbers = list(value) if isinstance(value, list | tuple) else [float(value)]
            self._changes.append((f"{prefix}.{name}", numbers))
        return f"takes effect at step {self.step}"

    def _tell_changes(self, step: int) -> None:
        if not self._changes:
            return
        seconds, nanoseconds = self._stamps.at(step)
        for name, value in self._changes:
            change = ParameterChange(step=step, name=name, value=value)
            change.header.stamp.sec, change.header.stamp.nanosec = seconds, nanoseconds
            change.header.frame_id = topics.FRAME
            self._say_change.publish(change)
        self._changes = []


def _controls(scenario: Scenario, index: int) -> dict[str, Spec]:
    """The specifications of a satellite's control laws, by the name that begins their parameters."""
    satellite = scenario.satellite(index)
    assert satellite.controller is not None  # noqa: S101 - the scenario's validator has seen to it
    found: dict[str, Spec] = {"controller": satellite.controller}
    if satellite.attitude is not None:
        found["attitude_controller"] = satellite.attitude.controller
    return found


def fly(node: FormationNode, executor: StepExecutor, stop: StopRequest, report: Report) -> int:
    """Find the others, fly until the plant says that the flight has ended, and go."""
    declare_fixed(node, "scenario", "", "path of the scenario file")
    name = declare_fixed(node, "satellite", "", "name of the satellite in the scenario")
    recorded = declare_fixed(node, "recorded", False, "whether a recorder takes part, to be waited for")
    scenario = scenario_of(node)
    return fly_all([SatelliteNode(node, executor, scenario, name, recorded, report)], executor, stop)


def fly_all(satellites: Sequence[SatelliteNode], executor: StepExecutor, stop: StopRequest) -> int:
    """Fly the satellites of one process until the plant says that the flight has ended.

    Args:
        satellites: with their endpoints made, all on the same executor.
        executor: does the waiting.
        stop: ends the flight of these satellites early.

    Returns:
        The exit code.

    Raises:
        NodeError: the others are not there, or no longer heard.
    """
    names = ", ".join(satellite.name for satellite in satellites)
    if not executor.spin_until(
        lambda: all(satellite.matched() or satellite.ended for satellite in satellites) or stop.asked,
        PATIENCE,
    ):
        sentence = f"{names}: neighbours and plant have not been found within {PATIENCE:g} s"
        raise NodeError(sentence, EXIT_LOST)
    for satellite in satellites:
        satellite.say_ready()
        satellite.report.say("ready", node=satellite.name)

    def waiting() -> bool:
        return not (stop.asked or all(satellite.ended for satellite in satellites))

    # The first state comes when the last of all nodes is ready; the next ones soon or never.
    patience = 2.0 * satellites[0].scenario.tolerated_silence
    in_time = executor.spin_while(lambda: waiting() and satellites[0].step == 0, PATIENCE)
    in_time = in_time and executor.spin_while(waiting, patience)
    for satellite in satellites:
        if in_time:
            satellite.see_off()
        satellite.say_how_it_went()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _KILOBYTE
    satellites[0].report.say("memory", process=satellites[0].name, bytes=memory)
    if not in_time:
        step = satellites[0].step
        sentence = f"nothing heard from the plant at step {step}"
        satellites[0].report.say("lost", who=["plant"], step=step, reason=sentence)
        raise NodeError(f"{names}: {sentence}; stopping", EXIT_LOST)
    return EXIT_STOPPED if stop.asked else EXIT_DONE


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Fly one satellite; entry point of the executable `satellite_node`."""
    return run("satellite", fly, arguments, Report(pipe))


if __name__ == "__main__":
    sys.exit(main())
