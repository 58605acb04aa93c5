"""The node of the plant: it moves all satellites, decides who takes part and when a step is complete."""

import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import Attitude, Command, FormationStatus, Propulsion, Ready, Recorded, RelativeState

from satform.exit_codes import EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.formation import Event
from satform.muster import Change, Muster
from satform.plant import Plant
from satform.scenario import Scenario
from satform_nodes import topics
from satform_nodes.diagnostics import Condition, Health, flight_condition
from satform_nodes.entry import Entry, Refusals
from satform_nodes.executor import StepExecutor
from satform_nodes.lifetime import NodeError, StopRequest, run, scenario_of, see_off, start_timeout
from satform_nodes.on_the_clock import fly_on_the_clock, processor_seconds
from satform_nodes.parameters import declare_fixed, declare_rate
from satform_nodes.readiness import Company
from satform_nodes.report import Report
from satform_nodes.services import FormationServices
from satform_nodes.speakers import Speakers, decoded
from satform_nodes.stamps import Stamps
from satform_nodes.wire import layout

_STATE = layout(RelativeState, topics.FRAME)
_ATTITUDE = layout(Attitude, topics.FRAME)
_COMMAND = layout(Command, topics.FRAME)
_RECORDED = layout(Recorded, topics.FRAME)
_PROPULSION = layout(Propulsion, topics.FRAME)

_ACCELERATION_AND_TORQUE = slice(3, 9)
"""Where a command message has what the plant needs."""

_NOTHING = Change((), ())
"""No change of the formation."""

_PROGRESS_PERIOD = 0.1
"""Wall-clock time between two reports of progress, s."""

_SIGN_PERIOD = 0.5
"""Wall-clock time between two signs of life while no step is taken, s; a fraction of any silence."""

_FAREWELL = 5.0
"""How long the last status is kept up for those who have not yet taken it, s."""


@dataclass(frozen=True)
class Settings:
    """What the plant's node is told at its start beside the scenario.

    Attributes:
        recorded: whether a recorder takes part, to be waited for.
        recorder_needed: whether the flight ends when the recorder is lost.
        rate: simulated seconds in each second of the wall clock; 0 for lockstep.
    """

    recorded: bool
    recorder_needed: bool
    rate: float


class PlantNode:
    """Carries the plant; every formula is in `satform`."""

    def __init__(
        self,
        node: Node,
        executor: StepExecutor,
        scenario: Scenario,
        settings: "Settings",
        report: Report,
    ) -> None:
        recorded = settings.recorded
        self.clocked = settings.rate > 0.0
        self.node = node
        self.scenario = scenario
        self.report = report
        self.plant = Plant(scenario)
        self.muster = Muster(scenario, ["recorder"] if recorded else [], lockstep=not self.clocked)
        self.recorded = recorded
        self.recorded_step = 0
        self.refusals = Refusals()
        self.busy_seconds = 0.0
        self.flying = False
        self.aborted: tuple[list[str], str] | None = None
        self.stop_asked = False
        self.names = self.muster.names
        # On the wall clock: commands that missed their step, and those that came at all but late.
        self.misses = [0] * len(self.names)
        self.late = [0] * len(self.names)
        self._commanded = [-1] * len(self.names)
        self._heard_at = [0.0] * len(self.names)
        self.start_timeout = start_timeout(len(self.names))
        self._settings = settings
        self._stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
        # Acceleration and wheel torque of each satellite, and the messages they came in.
        self._commands = np.zeros((len(self.names), 6))
        self._last_commands: dict[int, bytes] = {}
        self._awaited_since = 0.0
        self._paused = False
        self._single_steps = 0
        self._pulse = 0
        self._next_sign = 0.0
        self._said: dict[int, list[bytes]] = {}
        self._status = FormationStatus()
        self._next_progress = 0.0
        self._told_step, self._told_at = 0, time.monotonic()

        self._make_publishers(node)
        self._make_subscriptions(node, executor)
        self._health = Health(node, "plant: formation", "plant", self._condition)
        self._services = FormationServices(node, self)
        executor.add_chore(self._chore)

    def _make_publishers(self, node: Node) -> None:
        scenario = self.scenario
        self._say_clock = node.create_publisher(Clock, topics.CLOCK, topics.STEPPED)
        self._say_status = node.create_publisher(FormationStatus, topics.STATUS, topics.LATCHED)
        self._say_state = [
            node.create_publisher(RelativeState, topics.state(name), topics.STEPPED) for name in self.names
        ]
        self._say_attitude = [
            (index, node.create_publisher(Attitude, topics.attitude(name), topics.STEPPED))
            for index, name in enumerate(self.names)
            if scenario.satellite(index).attitude is not None
        ]
        self._say_truth = [
            (index, node.create_publisher(RelativeState, topics.truth(name), topics.STEPPED))
            for index, name in enumerate(self.names)
            if scenario.satellite(index).sensor is not None
        ]
        self._say_propulsion = [
            node.create_publisher(Propulsion, topics.propulsion(name), topics.STEPPED)
            for index, name in enumerate(self.names)
            if scenario.satellite(index).thruster is not None
        ]

    def _make_subscriptions(self, node: Node, executor: StepExecutor) -> None:
        self._ready_speakers = Speakers(node, topics.READY, [*self.names, "recorder"], self.refusals)
        executor.subscribe(
            node, Ready, topics.READY, self._on_ready, topics.LATCHED_READER, self._ready_speakers
        )
        self._speakers = [Speakers(node, topics.command(name), [name], self.refusals) for name in self.names]
        self._entries = [Entry(topics.command(name), _COMMAND, self.refusals) for name in self.names]
        subscriptions = [
            executor.subscribe(
                node,
                Command,
                topics.command(name),
                partial(self._on_command, index),
                topics.NEWEST if self.clocked else topics.STEPPED_READER,
                self._speakers[index],
            )
            for index, name in enumerate(self.names)
        ]
        watching = ["recorder"] if self.recorded else []
        self._company = Company(node)
        for name, publisher, subscription in zip(self.names, self._say_state, subscriptions, strict=True):
            self._company.listens(publisher, [name, *watching])
            self._company.speaks(subscription, [name])
        for index, publisher in self._say_attitude:
            self._company.listens(publisher, [self.names[index], *watching])
        for publisher in (
            *(publisher for _, publisher in self._say_truth),
            *self._say_propulsion,
            self._say_clock,
        ):
            self._company.listens(publisher, watching)
        self._company.listens(self._say_status, self.muster.everyone)
        if self.recorded:
            speakers = Speakers(node, topics.RECORDED, watching, self.refusals)
            progress = executor.subscribe(
                node, Recorded, topics.RECORDED, self._on_recorded, topics.STEPPED_READER, speakers
            )
            self._company.speaks(progress, watching)

    @property
    def finished(self) -> bool:
        """Whether the last state has been published, and recorded if a recorder takes part."""
        return self.flown and (not self.recorded or self.recorded_step >= self.scenario.timing.steps)

    @property
    def flown(self) -> bool:
        """Whether the last step has been taken."""
        return self.muster.over

    @property
    def last_step_taken(self) -> bool:
        """Whether no step follows in which something could take effect."""
        return self.muster.last_step_taken

    @property
    def over(self) -> bool:
        """Whether there is nothing more to be done, for whatever reason."""
        return self.finished or self.stop_asked or self.aborted is not None

    def progress(self) -> tuple[int, ...]:
        """What changes as long as the flight goes on."""
        muster = self.muster
        return (muster.step, len(muster.answered), self.recorded_step, muster.formation.number, self._pulse)

    def everyone_is_ready(self) -> bool:
        """Whether all nodes have said that they are ready, and are there seen from this side."""
        return not self.muster.unready and self._company.complete()

    def not_ready(self) -> list[str]:
        """Who has not yet said that it can fly."""
        return self.muster.unready or ["the plant, which does not see everyone"]

    @property
    def waits_for_return(self) -> bool:
        """Whether a satellite is awaited that the scenario brings back at this step."""
        return bool(self.muster.awaited)

    def missing(self) -> list[str]:
        """Who keeps the step from going on."""
        muster = self.muster
        satellites = muster.awaited or not (muster.open or muster.over)
        return muster.missing if satellites else ["recorder"]

    def begin(self) -> None:
        """Publish the first states; everything else follows from the answers."""
        self.flying = True
        self._heard_at = [time.monotonic()] * len(self.names)
        self.say_status(FormationStatus.FLYING, "")
        self._begin_step()

    # Who takes part

    def lose(self, names: Iterable[str], reason: str) -> None:
        """Go on without some satellites, or end the flight when nobody is left or the recorder is needed.

        Args:
            names: of satellites, or `recorder`.
            reason: in words, for everyone.
        """
        for name in names:
            if name == "recorder":
                self._lose_recorder(reason)
            elif name in self.names:
                self._lose(self.names.index(name), reason)
        self._advance_if_complete()

    def _lose(self, index: int, reason: str) -> None:
        loss = self.muster.lose(index, reason)
        self._tell_change(loss.change)
        if loss.end:
            self.aborted = ([self.names[index]], loss.end)

    def _lose_recorder(self, reason: str) -> None:
        if not self.recorded:
            return
        if self._settings.recorder_needed:
            self.aborted = (["recorder"], reason)
            return
        self.recorded = False
        self.node.get_logger().warning(f"{reason}; the flight goes on unrecorded")
        self.report.say("loss", who="recorder", step=self.plant.step, reason=reason)
        self._go_on()

    def _tell_change(self, change: Change | None) -> None:
        """Tell everyone that the formation is another one from the present step on."""
        if change is None:
            return
        formation, step = self.muster.formation, self.muster.step
        for index in change.lost:
            self._commands[index] = 0.0
            self._speakers[index].vacate(self.names[index])
            self._ready_speakers.vacate(self.names[index])
            self.report.say("loss", who=self.names[index], step=step, reason=formation.reason)
        for event in change.back:
            # What it said before it was lost is no last word of what it says now.
            self._last_commands.pop(event.satellite, None)
            self._heard_at[event.satellite] = time.monotonic()
            self.report.say("return", who=self.names[event.satellite], step=step)
        phase = FormationStatus.PAUSED if self._paused else FormationStatus.FLYING
        self.say_status(phase, formation.reason, change)
        self._health.changed()

    def rewire(self, event: Event) -> int:
        """Take up an event for the next step; the step's number."""
        return self.muster.take_up(event)

    def _on_ready(self, data: bytes, name: str) -> None:
        ready = decoded(data, Ready, topics.READY, self.refusals)
        if ready is None:
            return
        if ready.node.rpartition("/")[2] != name:
            self.refusals.note(topics.READY, f"{name} speaks for another node")
            return
        self.muster.is_ready(name)
        if self.flying and name in self.names:
            self.muster.offer(self.names.index(name), int(ready.checkpoint))
            self._go_on()

    # Steps

    def _begin_step(self) -> None:
        """Let happen what is due at this step, and publish its states when nothing stands against it."""
        self._tell_change(self.muster.begin(self.plant.step))
        self._awaited_since = time.monotonic()
        self._go_on()

    def _go_on(self) -> None:
        """Publish the states that are due, unless someone has to be waited for."""
        if not self.muster.open:
            return
        behind = self.plant.step - self.recorded_step
        if self.recorded and not self.clocked and behind > topics.RECORDER_WINDOW:
            return
        if self._paused and not self._single_steps:
            return
        if not self.muster.assembled:
            return
        self._single_steps = max(0, self._single_steps - 1)
        self._tell_change(self.muster.close())
        self._publish_state()

    def pause(self) -> int:
        """Take no more steps; the number of the first one that is not taken."""
        self._paused = True
        self.say_status(FormationStatus.PAUSED, "paused")
        return self.muster.next_step

    def resume(self) -> int:
        """Take steps again; the number of the first one."""
        self._paused = False
        self._single_steps = 0
        self._heard_at = [time.monotonic()] * len(self.names)
        self.say_status(FormationStatus.FLYING, "resumed")
        step = self.plant.step
        self._go_on()
        return step

    def single_step(self) -> int:
        """Take one step and pause again; the number of the step that is taken."""
        step = self.muster.next_step
        if not self._paused:
            self.pause()
        self._single_steps += 1
        self._go_on()
        return step

    @property
    def paused(self) -> bool:
        """Whether steps are taken only when asked for."""
        return self._paused

    def say_again(self) -> None:
        """Repeat what was said last: the step does not go on, and somebody may not have heard it."""
        # Who has not heard of a change of the formation cannot answer.
        self._say_status.publish(self._status)
        if self.muster.open or self.muster.over:
            return
        for index in self.muster.unanswered:
            for publisher, data in zip(self._speakers_to(index), self._said.get(index, []), strict=False):
                publisher.publish(data)

    def _speakers_to(self, index: int) -> list[Any]:
        return [self._say_state[index], *(say for place, say in self._say_attitude if place == index)]

    def _chore(self) -> None:
        """Off the path of a step: what the starter says, and whether standing still is meant."""
        for said in self.report.heard():
            if said["event"] == "lost":
                self.lose([said["who"]], said["reason"])
        waits = self.muster.awaited and time.monotonic() - self._awaited_since < self.start_timeout
        if (self._paused and self.muster.open) or waits:
            self._pulse += 1
            now = time.monotonic()
            if now >= self._next_sign:
                # Whoever hears nothing would take the plant for lost.
                self._next_sign = now + _SIGN_PERIOD
                self._say_status.publish(self._status)

    def _condition(self) -> Condition:
        now = time.monotonic()
        rate = (self.plant.step - self._told_step) / max(now - self._told_at, 1e-9)
        self._told_step, self._told_at = self.plant.step, now
        lost_at = self.muster.formation.lost_at
        lost = {self.names[index]: self.plant.step - lost_at[index] for index in self.muster.lost}
        refused = {f"{topic}: {reason}": count for (topic, reason), count in self.refusals.counts.items()}
        return flight_condition(step=self.plant.step, step_rate=rate, refused=refused, silent=lost)

    def say_status(self, phase: int, reason: str, change: Change = _NOTHING) -> None:
        """Tell everyone in what phase the formation is, from which step, and why."""
        formation = self.muster.formation
        self._status = FormationStatus(
            step=self.plant.step,
            number=formation.number,
            phase=phase,
            last_step=self.scenario.timing.steps,
            satellites=self.names,
            alive=formation.alive.tolist(),
            adjacency=formation.graph.adjacency.astype(np.uint8).ravel().tolist(),
            algebraic_connectivity=float(formation.connectivity),
            lost=[self.names[index] for index in change.lost],
            last_words=[self._last_word(index) for index in change.lost],
            back=[self.names[event.satellite] for event in change.back],
            checkpoints=[-1 if event.checkpoint is None else event.checkpoint for event in change.back],
            reason=reason,
        )
        seconds, nanoseconds = self._stamps.at(self.plant.step)
        self._status.header.stamp.sec, self._status.header.stamp.nanosec = seconds, nanoseconds
        self._status.header.frame_id = topics.FRAME
        self._say_status.publish(self._status)
        if phase not in (FormationStatus.FINISHED, FormationStatus.ABORTED):
            return
        # What the plant said last would be lost with it; what a recorder has is not on its way any more.
        recorded = phase == FormationStatus.FINISHED and self.recorded
        said_in_steps = [] if recorded else [*self._say_state, self._say_clock]
        if not see_off((self._say_status, *said_in_steps), self._present, _FAREWELL):
            self.node.get_logger().warning("not everyone has heard how the flight ended")

    def _present(self) -> bool:
        """Whether someone of those who are not lost still listens."""
        listening = {other.node_name for other in self.node.get_subscriptions_info_by_topic(topics.STATUS)}
        lost = {self.names[index] for index in self.muster.lost}
        return bool(listening & (self.muster.everyone - lost))

    def _last_word(self, index: int) -> Command:
        data = self._last_commands.get(index)
        return deserialize_message(data, Command) if data else Command()

    def _on_recorded(self, data: bytes, _name: str) -> None:
        numbers = _RECORDED.unpack(data)
        if numbers is None:
            self.refusals.note(topics.RECORDED, "another form")
            return
        self.recorded_step = max(self.recorded_step, min(numbers[2], self.plant.step))
        self._go_on()

    def _on_command(self, index: int, data: bytes, _name: str) -> None:
        muster, step = self.muster, self.plant.step
        if not muster.formation.alive[index]:
            return
        first = self._commanded[index] + 1 if self.clocked else step
        numbers = self._entries[index].admit(data, first, step)
        if numbers is None or index in muster.answered or muster.open:
            return
        if self.clocked:
            self._note_time(index, int(numbers[2]))
        self._commands[index] = numbers[_ACCELERATION_AND_TORQUE]
        self._last_commands[index] = data
        if numbers[2] == step:
            muster.answer(index)
        self._advance_if_complete()

    def _note_time(self, index: int, step: int) -> None:
        """Note that a command came in, in time or late."""
        self._heard_at[index] = time.monotonic()
        self._commanded[index] = step
        self.late[index] += step < self.plant.step

    @property
    def stands_still(self) -> bool:
        """Whether no step is to be taken at present."""
        return self.muster.open

    def judge_waiting(self) -> None:
        """End the flight when a satellite that the scenario brings back has been awaited for too long."""
        if self.muster.awaited and time.monotonic() - self._awaited_since > self.start_timeout:
            silent = self.missing()
            self.aborted = (silent, f"{', '.join(silent)} has not come back within {self.start_timeout:g} s")

    def tick(self) -> None:
        """Take the next step with the commands that there are: those of the step before hold on."""
        now = time.monotonic()
        for index in self.muster.flying:
            self.misses[index] += self._commanded[index] < self.plant.step
            if now - self._heard_at[index] > self.scenario.tolerated_silence:
                silence = self.scenario.tolerated_silence
                self._lose(index, f"no answer within {silence:g} s from {self.names[index]}")
        if self.aborted is None and self.plant.step < self.scenario.timing.steps:
            self._advance()

    def _advance_if_complete(self) -> None:
        if self.clocked or self.muster.open or not self.flying or self.aborted or not self.muster.complete:
            return
        if self.plant.step < self.scenario.timing.steps:
            self._advance()

    def _advance(self) -> None:
        # The processor's time: the wall clock would count those who are let in meanwhile.
        begin = time.thread_time()
        self.plant.advance(self._commands[:, :3], self._commands[:, 3:])
        self.busy_seconds += time.thread_time() - begin
        self._publish_propulsion()
        self._begin_step()
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
        step, number = self.plant.step, self.muster.formation.number
        seconds, nanoseconds = self._stamps.at(step)
        told, moments = self.plant.measured(), self.plant.measured_steps()
        for index, (publisher, moment, position, velocity) in enumerate(
            zip(
                self._say_state,
                moments.tolist(),
                told.position.tolist(),
                told.velocity.tolist(),
                strict=True,
            )
        ):
            data = _STATE.pack(*self._stamps.at(moment), step, number, *position, *velocity)
            self._said[index] = [data]
            publisher.publish(data)
        self._publish_attitude(seconds, nanoseconds, step)
        truth = self.plant.motion()
        for index, publisher in self._say_truth:
            position, velocity = truth.position[index].tolist(), truth.velocity[index].tolist()
            publisher.publish(_STATE.pack(seconds, nanoseconds, step, number, *position, *velocity))
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
            data = _ATTITUDE.pack(seconds, nanoseconds, step, *turned, *limits[index])
            self._said[index].append(data)
            publisher.publish(data)


def fly(node: Node, executor: StepExecutor, stop: StopRequest, report: Report) -> int:
    """Wait for everyone, fly the scenario to its end, and say how it went."""
    declare_fixed(node, "scenario", "", "path of the scenario file")
    settings = Settings(
        recorded=declare_fixed(node, "recorded", False, "whether a recorder takes part, to be waited for"),
        recorder_needed=declare_fixed(
            node, "recorder_needed", True, "whether the flight ends when the recorder is lost"
        ),
        rate=declare_rate(node),
    )
    scenario = scenario_of(node)
    plant = PlantNode(node, executor, scenario, settings, report)
    if not executor.spin_until(
        lambda: plant.everyone_is_ready() or stop.asked or plant.stop_asked, plant.start_timeout
    ):
        late = plant.not_ready()
        return _abort(plant, late, f"not ready within {plant.start_timeout:g} s: {', '.join(late)}")
    begin = time.perf_counter()
    plant.report.say("flying")
    if not (stop.asked or plant.stop_asked):
        plant.begin()
    timing: dict[str, Any] = {}
    if plant.clocked:
        kept = fly_on_the_clock(plant, executor, stop, scenario.timing.step / settings.rate)
        timing = {**kept.data(), "processor": processor_seconds()}
        timing["misses"] = dict(zip(plant.names, plant.misses, strict=True))
        timing["late"] = dict(zip(plant.names, plant.late, strict=True))
    _fly_on(plant, executor, stop)
    if plant.aborted:
        return _abort(plant, *plant.aborted)
    if stop.asked or plant.stop_asked:
        plant.report.say("stopped", step=plant.plant.step)
        plant.say_status(FormationStatus.ABORTED, "asked to stop")
        return EXIT_STOPPED
    seconds = time.perf_counter() - begin
    plant.report.say(
        "finished",
        step=plant.plant.step,
        seconds=seconds,
        busy=plant.busy_seconds,
        refused=plant.refusals.sentences(),
        timing=timing,
    )
    plant.say_status(FormationStatus.FINISHED, "")
    return EXIT_DONE


def _fly_on(plant: PlantNode, executor: StepExecutor, stop: StopRequest) -> None:
    """Take steps until the flight is over; whoever is silent for too long is lost."""
    silence = plant.scenario.tolerated_silence
    while not executor.spin_while(
        lambda: not (plant.over or stop.asked), silence, plant.say_again, plant.progress
    ):
        silent = plant.missing()
        reason = f"no answer within {silence:g} s from {', '.join(silent)}"
        if plant.waits_for_return:
            late = f"{', '.join(silent)} has not come back within {plant.start_timeout:g} s"
            plant.aborted = (silent, late)
        else:
            plant.lose(silent, reason)


def _abort(plant: PlantNode, who: list[str], reason: str) -> int:
    step = plant.plant.step
    sentence = f"lost at step {step}: {reason}" if plant.flying else reason
    plant.report.say("lost", who=who, step=step, reason=sentence)
    plant.say_status(FormationStatus.ABORTED, sentence)
    raise NodeError(sentence, EXIT_LOST)


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Run the plant; entry point of the executable `plant_node`."""
    return run("plant", fly, arguments, Report(pipe))


if __name__ == "__main__":
    sys.exit(main())
