"""The node of one satellite: state and neighbours' phases in, command and own phase out."""

import sys
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from satform_msgs.msg import (
    ArcLength,
    Command,
    FormationStatus,
    ParameterChange,
    Ready,
    RelativeState,
    Tracking,
)

from satform.consensus.arc_length import Heard
from satform.control.protocol import ControllerSpec, Motion
from satform.satellite import Decision, Satellite, flight_setting
from satform.scenario import Scenario
from satform_nodes import topics
from satform_nodes.executor import StepExecutor
from satform_nodes.lifetime import (
    EXIT_BAD_INPUT,
    EXIT_DONE,
    EXIT_LOST,
    EXIT_STOPPED,
    START_TIMEOUT,
    NodeError,
    StopRequest,
    run,
    scenario_of,
)
from satform_nodes.parameters import FormationNode, declare_fixed, declare_spec, on_spec_change
from satform_nodes.report import Report
from satform_nodes.stamps import Stamps
from satform_nodes.wire import layout

_STATE = layout(RelativeState, topics.FRAME)
_ARC_LENGTH = layout(ArcLength, topics.FRAME)
_COMMAND = layout(Command, topics.FRAME)
_TRACKING = layout(Tracking, topics.FRAME)


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
        self.executor = executor
        self.scenario = scenario
        self.index = names.index(name)
        self.report = report
        self.satellite = Satellite.of(scenario, self.index)
        self._stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
        graph = scenario.communication_graph()
        self._neighbours = graph.neighbours(self.index)
        self._heard_now: dict[int, tuple[float, float, float]] = {}
        self._heard_next: dict[int, tuple[float, float, float]] = {}
        self._weight = np.ones(len(self._neighbours))
        self._state: tuple[float, ...] | None = None
        self._measured_step = 0
        self._changes: list[tuple[str, list[float]]] = []
        self.step = 0
        self.refused = 0
        self.busy_seconds = 0.0
        self.ended: FormationStatus | None = None

        spec = scenario.satellite(self.index).controller
        assert spec is not None  # noqa: S101 - the scenario's validator has seen to it
        self._controller: ControllerSpec = spec
        declare_spec(node, "controller", spec)
        on_spec_change(node, "controller", lambda: self._controller, self._accept_gains)

        self._say_arc = node.create_publisher(ArcLength, topics.arc_length(name), topics.STEPPED)
        self._say_command = node.create_publisher(Command, topics.command(name), topics.STEPPED)
        self._say_tracking = node.create_publisher(Tracking, topics.tracking(name), topics.STEPPED)
        self._say_change = node.create_publisher(
            ParameterChange, topics.parameter_changes(name), topics.LATCHED
        )
        self._say_ready = node.create_publisher(Ready, topics.READY, topics.LATCHED)
        subscriptions = [
            executor.subscribe(node, RelativeState, topics.state(name), self._on_state, topics.STEPPED)
        ]
        for neighbour in self._neighbours:
            subscriptions.append(
                executor.subscribe(
                    node,
                    ArcLength,
                    topics.arc_length(names[neighbour]),
                    self._hearing(neighbour),
                    topics.STEPPED,
                )
            )
        # Made last: whoever sees this subscription has seen all others of this satellite.
        status = node.create_subscription(FormationStatus, topics.STATUS, self._on_status, topics.LATCHED)
        watching = 1 if recorded else 0
        self._expected = [
            *((subscription.get_publisher_count, 1) for subscription in (*subscriptions, status)),
            (self._say_ready.get_subscription_count, 1),
            (self._say_arc.get_subscription_count, len(graph.listeners(self.index)) + watching),
            (self._say_command.get_subscription_count, 1 + watching),
            (self._say_tracking.get_subscription_count, watching),
        ]

    def matched(self) -> bool:
        """Whether everyone this satellite talks to or listens to is there, seen from this side."""
        return all(count() >= expected for count, expected in self._expected)

    def say_ready(self) -> None:
        """Tell the plant that this satellite can fly."""
        self._say_ready.publish(Ready(node=self.node.get_fully_qualified_name(), step=self.step))

    def _hearing(self, neighbour: int) -> Any:
        def _on_arc_length(data: bytes) -> None:
            numbers = _ARC_LENGTH.unpack(data)
            if numbers is None:
                self.refused += 1
                return
            seconds, nanoseconds, step, arc_length, rate = numbers
            if step == self.step:
                self._heard_now[neighbour] = (arc_length, rate, self._stamps.time(seconds, nanoseconds))
            elif step == self.step + 1:
                self._heard_next[neighbour] = (arc_length, rate, self._stamps.time(seconds, nanoseconds))
            else:
                self.refused += 1
            self._act_if_complete()

        return _on_arc_length

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

    def _on_status(self, status: FormationStatus) -> None:
        if status.phase in (FormationStatus.FINISHED, FormationStatus.ABORTED):
            self.ended = status

    def _act_if_complete(self) -> None:
        if self._state is None or len(self._heard_now) < len(self._neighbours):
            return
        state, step = self._state, self.step
        if step >= self.scenario.timing.steps:
            self._state = None
            return
        # The processor's time: the wall clock would count those who are let in meanwhile.
        begin = time.thread_time()
        heard = np.array([self._heard_now[neighbour] for neighbour in self._neighbours]).reshape(-1, 3)
        motion = Motion(np.array(state[:3]), np.array(state[3:6]))
        neighbours = Heard(heard[:, 0], heard[:, 1], heard[:, 2], self._weight)
        decision = self.satellite.act(motion, neighbours, self._measured_step)
        self.busy_seconds += time.thread_time() - begin
        seconds, nanoseconds = self._stamps.at(step)
        self._say_command.publish(_COMMAND.pack(seconds, nanoseconds, step, *decision.acceleration.tolist()))
        self._state = None
        self._heard_now, self._heard_next = self._heard_next, {}
        self.step = step + 1
        self._announce()
        self._show(seconds, nanoseconds, step, decision)
        self._tell_changes(step)

    def _announce(self) -> None:
        said = self.satellite.announce()
        seconds, nanoseconds = self._stamps.at_time(float(said.time))
        self._say_arc.publish(
            _ARC_LENGTH.pack(seconds, nanoseconds, self.step, float(said.arc_length), float(said.rate))
        )

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

    def _accept_gains(self, spec: ControllerSpec, fields: dict[str, Any]) -> str:
        self.satellite.use_controller(spec, flight_setting(self.scenario))
        self._controller = spec
        for name, value in fields.items():
            numbers = list(value) if isinstance(value, list | tuple) else [float(value)]
            self._changes.append((f"controller.{name}", numbers))
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


def fly(node: FormationNode, executor: StepExecutor, stop: StopRequest, report: Report) -> int:
    """Find the others, fly until the plant says that the flight has ended, and go."""
    declare_fixed(node, "scenario", "", "path of the scenario file")
    name = declare_fixed(node, "satellite", "", "name of the satellite in the scenario")
    recorded = declare_fixed(node, "recorded", False, "whether a recorder takes part, to be waited for")
    scenario = scenario_of(node)
    satellite = SatelliteNode(node, executor, scenario, name, recorded, report)
    if not executor.spin_until(lambda: satellite.matched() or stop.asked, START_TIMEOUT):
        raise NodeError(
            f"{name} has not found its neighbours and the plant within {START_TIMEOUT:g} s", EXIT_LOST
        )
    satellite.say_ready()
    satellite.report.say("ready", node=name)
    in_time = executor.spin_while(
        lambda: satellite.ended is None and not stop.asked,
        max(START_TIMEOUT, 2.0 * scenario.tolerated_silence),
    )
    satellite.report.say(
        "satellite", node=name, step=satellite.step, busy=satellite.busy_seconds, refused=satellite.refused
    )
    if not in_time:
        raise NodeError(
            f"{name} has heard nothing from the plant at step {satellite.step}; it stops", EXIT_LOST
        )
    return EXIT_STOPPED if stop.asked else EXIT_DONE


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Fly one satellite; entry point of the executable `satellite_node`."""
    return run("satellite", fly, arguments, Report(pipe))


if __name__ == "__main__":
    sys.exit(main())
