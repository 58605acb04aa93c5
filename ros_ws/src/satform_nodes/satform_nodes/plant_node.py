"""The node of the plant: it moves all satellites, and decides when a step is complete."""

import sys
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import Attitude, Command, FormationStatus, Propulsion, Ready, Recorded, RelativeState

from satform.exit_codes import EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.plant import Plant
from satform.scenario import Scenario
from satform_nodes import topics
from satform_nodes.executor import StepExecutor
from satform_nodes.lifetime import START_TIMEOUT, NodeError, StopRequest, run, scenario_of
from satform_nodes.parameters import declare_fixed
from satform_nodes.readiness import Company
from satform_nodes.report import Report
from satform_nodes.stamps import Stamps
from satform_nodes.wire import layout

_STATE = layout(RelativeState, topics.FRAME)
_ATTITUDE = layout(Attitude, topics.FRAME)
_COMMAND = layout(Command, topics.FRAME)
_RECORDED = layout(Recorded, topics.FRAME)
_PROPULSION = layout(Propulsion, topics.FRAME)

_PROGRESS_PERIOD = 0.1
"""Wall-clock time between two reports of progress, s."""

_FAREWELL = Duration(seconds=5)
"""How long the last status is kept up for those who have not yet taken it."""


class PlantNode:
    """Carries the plant; every formula is in `satform`."""

    def __init__(
        self, node: Node, executor: StepExecutor, scenario: Scenario, recorded: bool, report: Report
    ) -> None:
        self.node = node
        self.scenario = scenario
        self.report = report
        self.plant = Plant(scenario)
        self.recorded = recorded
        self.recorded_step = 0
        self.refused = 0
        self.busy_seconds = 0.0
        self._names = [satellite.name for satellite in scenario.satellites]
        self._graph = scenario.communication_graph()
        self._stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
        # Acceleration and wheel torque of each satellite.
        self._commands = np.zeros((len(self._names), 6))
        self._answered: set[int] = set()
        self._ready: set[str] = set()
        self._state_due = False
        self._next_progress = 0.0

        self._say_clock = node.create_publisher(Clock, topics.CLOCK, topics.STEPPED)
        self._say_status = node.create_publisher(FormationStatus, topics.STATUS, topics.LATCHED)
        self._say_state = [
            node.create_publisher(RelativeState, topics.state(name), topics.STEPPED) for name in self._names
        ]
        self._say_attitude = [
            (index, node.create_publisher(Attitude, topics.attitude(name), topics.STEPPED))
            for index, name in enumerate(self._names)
            if scenario.satellite(index).attitude is not None
        ]
        self._say_truth = [
            (index, node.create_publisher(RelativeState, topics.truth(name), topics.STEPPED))
            for index, name in enumerate(self._names)
            if scenario.satellite(index).sensor is not None
        ]
        self._say_propulsion = [
            node.create_publisher(Propulsion, topics.propulsion(name), topics.STEPPED)
            for index, name in enumerate(self._names)
            if scenario.satellite(index).thruster is not None
        ]
        node.create_subscription(Ready, topics.READY, self._on_ready, topics.LATCHED)
        subscriptions = [
            executor.subscribe(
                node, Command, topics.command(name), self._on_command_of(index), topics.STEPPED
            )
            for index, name in enumerate(self._names)
        ]
        watching = ["recorder"] if recorded else []
        self._everyone = {*self._names, *watching}
        self._company = Company(node)
        for name, publisher, subscription in zip(self._names, self._say_state, subscriptions, strict=True):
            self._company.listens(publisher, [name, *watching])
            self._company.speaks(subscription, [name])
        for index, publisher in self._say_attitude:
            self._company.listens(publisher, [self._names[index], *watching])
        for publisher in (
            *(publisher for _, publisher in self._say_truth),
            *self._say_propulsion,
            self._say_clock,
        ):
            self._company.listens(publisher, watching)
        self._company.listens(self._say_status, self._everyone)
        if recorded:
            progress = executor.subscribe(node, Recorded, topics.RECORDED, self._on_recorded, topics.STEPPED)
            self._company.speaks(progress, watching)

    @property
    def finished(self) -> bool:
        """Whether the last state has been published, and recorded if a recorder takes part."""
        last = self.scenario.timing.steps
        flown = self.plant.step == last and not self._state_due
        return flown and (not self.recorded or self.recorded_step >= last)

    def everyone_is_ready(self) -> bool:
        """Whether all nodes have said that they are ready, and are there seen from this side."""
        return self._everyone <= self._ready and self._company.complete()

    def missing(self) -> list[str]:
        """Who keeps the step from going on."""
        if self._state_due or self.plant.step == self.scenario.timing.steps:
            return ["recorder"]
        return [name for index, name in enumerate(self._names) if index not in self._answered]

    def not_ready(self) -> list[str]:
        """Who has not yet said that it can fly."""
        return sorted(self._everyone - self._ready) or ["the plant, which does not see everyone"]

    def begin(self) -> None:
        """Publish the first states; everything else follows from the answers."""
        self.say_status(FormationStatus.FLYING, "")
        self._publish_state()

    def say_status(self, phase: int, reason: str) -> None:
        """Tell everyone in what phase the formation is, from which step, and why."""
        status = FormationStatus(
            step=self.plant.step,
            phase=phase,
            last_step=self.scenario.timing.steps,
            satellites=self._names,
            alive=[True] * len(self._names),
            adjacency=self._graph.adjacency.astype(np.uint8).ravel().tolist(),
            algebraic_connectivity=float(self._graph.algebraic_connectivity),
            reason=reason,
        )
        seconds, nanoseconds = self._stamps.at(self.plant.step)
        status.header.stamp.sec, status.header.stamp.nanosec = seconds, nanoseconds
        status.header.frame_id = topics.FRAME
        self._say_status.publish(status)
        if phase == FormationStatus.FLYING:
            return
        # What the plant said last would be lost with it.
        for publisher in (self._say_status, *self._say_state, self._say_clock):
            if not publisher.wait_for_all_acked(_FAREWELL):
                self.node.get_logger().warning("not everyone has heard how the flight ended")
                return

    def _on_ready(self, ready: Ready) -> None:
        self._ready.add(ready.node.rpartition("/")[2])

    def _on_recorded(self, data: bytes) -> None:
        numbers = _RECORDED.unpack(data)
        if numbers is None:
            self.refused += 1
            return
        self.recorded_step = max(self.recorded_step, numbers[2])
        if self._state_due:
            self._publish_state()

    def _on_command_of(self, index: int) -> Any:
        def _on_command(data: bytes) -> None:
            numbers = _COMMAND.unpack(data)
            if numbers is None or numbers[2] != self.plant.step or index in self._answered:
                self.refused += 1
                return
            self._commands[index] = numbers[3:]
            self._answered.add(index)
            if len(self._answered) == len(self._names):
                self._advance()

        return _on_command

    def _advance(self) -> None:
        # The processor's time: the wall clock would count those who are let in meanwhile.
        begin = time.thread_time()
        self.plant.advance(self._commands[:, :3], self._commands[:, 3:])
        self.busy_seconds += time.thread_time() - begin
        self._answered.clear()
        self._publish_propulsion()
        self._publish_state()
        now = time.monotonic()
        if now >= self._next_progress:
            self._next_progress = now + _PROGRESS_PERIOD
            self.report.say_if_heard("step", step=self.plant.step)

    def _publish_propulsion(self) -> None:
        """What became of the commands of the step that was just taken."""
        thrusters = self.plant.thrusters
        if thrusters is None:
            return
        step = self.plant.step - 1
        seconds, nanoseconds = self._stamps.at(step)
        state = thrusters.propulsion
        given = self.plant.given[thrusters.members].tolist()
        counters = np.stack((state.clipped, state.withheld, state.starved), axis=-1).astype(np.uint64)
        for publisher, acceleration, delta_v, propellant, counts in zip(
            self._say_propulsion,
            given,
            state.delta_v.tolist(),
            state.propellant.tolist(),
            counters.tolist(),
            strict=True,
        ):
            publisher.publish(
                _PROPULSION.pack(seconds, nanoseconds, step, *acceleration, delta_v, propellant, *counts)
            )

    def _publish_state(self) -> None:
        step = self.plant.step
        self._state_due = self.recorded and step - self.recorded_step > topics.RECORDER_WINDOW
        if self._state_due:
            return
        seconds, nanoseconds = self._stamps.at(step)
        told, moments = self.plant.measured(), self.plant.measured_steps()
        for publisher, moment, position, velocity in zip(
            self._say_state, moments.tolist(), told.position.tolist(), told.velocity.tolist(), strict=True
        ):
            publisher.publish(_STATE.pack(*self._stamps.at(moment), step, *position, *velocity))
        self._publish_attitude(seconds, nanoseconds, step)
        truth = self.plant.motion()
        for index, publisher in self._say_truth:
            position, velocity = truth.position[index].tolist(), truth.velocity[index].tolist()
            publisher.publish(_STATE.pack(seconds, nanoseconds, step, *position, *velocity))
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = seconds, nanoseconds
        self._say_clock.publish(clock)

    def _publish_attitude(self, seconds: int, nanoseconds: int, step: int) -> None:
        attitude = self.plant.attitude()
        if attitude is None:
            return
        limits = self.plant.wheel_limits().astype(np.uint64).tolist()
        for index, publisher in self._say_attitude:
            turned = (
                *attitude.mrp[index].tolist(),
                *attitude.angular_velocity[index].tolist(),
                *attitude.wheel_momentum[index].tolist(),
            )
            publisher.publish(_ATTITUDE.pack(seconds, nanoseconds, step, *turned, *limits[index]))


def fly(node: Node, executor: StepExecutor, stop: StopRequest, report: Report) -> int:
    """Wait for everyone, fly the scenario to its end, and say how it went."""
    declare_fixed(node, "scenario", "", "path of the scenario file")
    recorded = declare_fixed(node, "recorded", False, "whether a recorder takes part, to be waited for")
    scenario = scenario_of(node)
    plant = PlantNode(node, executor, scenario, recorded, report)
    if not executor.spin_until(lambda: plant.everyone_is_ready() or stop.asked, START_TIMEOUT):
        late = plant.not_ready()
        return _abort(plant, late, f"not ready within {START_TIMEOUT:g} s: {', '.join(late)}")
    begin = time.perf_counter()
    plant.report.say("flying")
    if not stop.asked:
        plant.begin()
    in_time = executor.spin_while(lambda: not (plant.finished or stop.asked), scenario.tolerated_silence)
    if not in_time:
        silent = plant.missing()
        silence = f"no answer within {scenario.tolerated_silence:g} s from {', '.join(silent)}"
        return _abort(plant, silent, f"lost at step {plant.plant.step}: {silence}")
    if stop.asked:
        plant.report.say("stopped", step=plant.plant.step)
        plant.say_status(FormationStatus.ABORTED, "asked to stop")
        return EXIT_STOPPED
    seconds = time.perf_counter() - begin
    plant.report.say(
        "finished",
        step=plant.plant.step,
        seconds=seconds,
        busy=plant.busy_seconds,
        refused=plant.refused,
    )
    plant.say_status(FormationStatus.FINISHED, "")
    return EXIT_DONE


def _abort(plant: PlantNode, who: list[str], reason: str) -> int:
    plant.report.say("lost", who=who, step=plant.plant.step, reason=reason)
    plant.say_status(FormationStatus.ABORTED, reason)
    raise NodeError(reason, EXIT_LOST)


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Run the plant; entry point of the executable `plant_node`."""
    return run("plant", fly, arguments, Report(pipe))


if __name__ == "__main__":
    sys.exit(main())
