# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The processes of a flight without DDS and without a clock: the objects that fly, and what joins them.

Each carries the steps, validators, accepted writers and publishers of its node. What it publishes is
collected as events, to be carried by the explorer.
"""

from collections.abc import Collection, Iterable, Sequence
from typing import Any

from protocol_snapshots import serialized
from rclpy.serialization import deserialize_message
from satform_msgs.msg import ArcLength, Command, FormationStatus, RelativeState

from satform.communication import topic_table
from satform.communication.message_validator import MessageRules, MessageValidator, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import PLANT, channels, published_by, topic_name
from satform.flight.checkpoint import restore, save
from satform.flight.compile import FormationPlan
from satform.flight.limits import Violation
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.membership.membership_manager import Change, MembershipManager
from satform.membership.reconfiguration import Target
from satform.numeric.elementwise import Array
from satform.protocol.plant_commands import PlantCommands
from satform.protocol.plant_steps import PlantSteps
from satform.protocol.satellite_output import StampedMessage
from satform.protocol.satellite_steps import SatelliteSteps
from satform.protocol.status import FormationPhase
from satform.protocol.writers import AuthorisedWriters
from satform_nodes.plant.publishers import PlantPublishers
from satform_nodes.satellite.publishers import NO_TORQUE, SatellitePublishers
from satform_nodes.transport.cdr_codec import layout

Event = tuple[Any, ...]
"""What a process has done: `("publish", topic, data)`, `("ready", checkpoint)`, `("acted", step)`,
`("taken", step)`, `("reports read",)`, `("ended", why)`."""

COMMAND = layout(Command, topic_table.FRAME)
STATE = layout(RelativeState, topic_table.FRAME)
PHASE = layout(ArcLength, topic_table.FRAME)


class ProcessEndedError(Exception):
    """A process ends itself."""


class Publisher:
    """Stands for a publisher of rclpy: notes what is published."""

    def __init__(self, topic: str, events: list[Event]) -> None:
        self.topic = topic
        self.topic_name = f"/{topic}"
        self._events = events

    def publish(self, message: Any) -> None:
        """Note a message."""
        data = message if isinstance(message, bytes) else serialized(message)
        self._events.append(("publish", self.topic, data))


class FakeNode:
    """Stands for a node of rclpy, of which only publishers are made."""

    def __init__(self, name: str, events: list[Event]) -> None:
        self._name = name
        self._events = events

    def create_publisher(self, _kind: Any, topic: str, _qos: Any) -> Publisher:
        """A publisher that notes what is published."""
        return Publisher(topic, self._events)

    def get_fully_qualified_name(self) -> str:
        """Name of the node."""
        return f"/{self._name}"


class Timing:
    """Timing of commands, which decides nothing in lockstep."""

    def begin(self) -> None:
        """No clock."""

    def restart_timeout(self, satellite: int) -> None:
        """No clock."""


class PlantProcess:
    """The plant: its steps, and the writers that it accepts."""

    def __init__(self, plan: FormationPlan, *, recorded: bool = False, window: int = 256) -> None:
        self.events: list[Event] = []
        self._names = list(plan.names)
        rejections = RejectionCounter()
        stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        last = len(COMMAND.fields)
        rules = MessageRules(unbounded=(last - 1, last))
        validators = [
            MessageValidator(topic_name("command", name), COMMAND, rejections, stamps, rules)
            for name in plan.names
        ]
        self.membership = MembershipManager(plan.membership, [])
        self.commands = PlantCommands(
            self.membership,
            COMMAND,
            validators,
            rejections,
            Timing(),  # type: ignore[arg-type]
            clocked=False,
        )
        self.steps = PlantSteps(plan, self.membership, self.commands, self, recorded=recorded, window=window)
        node: Any = FakeNode(PLANT, self.events)
        self.publishers = PlantPublishers(
            node, plan, self.steps.plant, published_by(PLANT, channels(plan.topics))
        )
        self.command_writers = [AuthorisedWriters([name]) for name in plan.names]
        self.ready_writers = AuthorisedWriters(plan.names)
        self._reports: tuple[int, ...] = ()

    def handle(self, kind: str, *details: Any) -> None:
        """Do what follows from something that happens to this process."""
        steps = self.steps
        simple = {
            "begin": steps.begin,
            "retransmit": steps.retransmit,
            "pause": steps.pause,
            "resume": steps.resume,
            "step": steps.single_step,
            "graph": steps.schedule_event,
        }
        if kind in simple:
            simple[kind](*details)
        elif kind == "timeout":
            steps.end_waiting([name for name in steps.missing() if name in details[0]], 10.0, 60.0)
        else:
            self._handle_satellite(kind, *details)
        if steps.flying and steps.over:
            phase = FormationPhase.FINISHED if steps.finished else FormationPhase.ABORTED
            self.publish_status(phase, "" if steps.finished else "ended")
            steps.flying = False

    def _handle_satellite(
        self,
        kind: str,
        satellite: int,
        writer: bytes = b"",
        content: Any = None,
        reports: tuple[int, ...] = (),
    ) -> None:
        """Do what follows from a message of a satellite, or from its end.

        Args:
            kind: of what happens.
            satellite: its index.
            writer: that has published the message; of a report, that of the present process if there is one.
            content: of the message.
            reports: satellites of which the supervisor has reported ends of processes that are not yet read.
        """
        name, steps = self._names[satellite], self.steps
        if kind in ("lost", "silent"):
            steps.lose([name], "its process has ended" if kind == "lost" else "no answer")
        elif kind == "command" and accepted(self.command_writers[satellite], writer, name):
            steps.take_command(satellite, content)
        elif kind == "ready" and accepted(self.ready_writers, writer, name):
            self._reports = reports
            steps.note_ready(name, content)
            self._reports = ()

    # What the steps ask for

    def publish_states(self, number: int) -> None:
        """Publish the states of the present step."""
        self.publishers.publish_states(number)

    def retransmit_states(self, satellites: Iterable[int]) -> None:
        """Publish the states of the present step to some satellites again."""
        self.publishers.retransmit_states(satellites)

    def publish_status(self, phase: FormationPhase, reason: str) -> None:
        """Publish the phase of the flight."""
        self.publishers.publish_status(self.membership.formation, phase, reason)

    def publish_change(self, phase: FormationPhase, change: Change, final_commands: Sequence[bytes]) -> None:
        """Publish a change of the formation, and accept restarted processes."""
        for index in change.lost:
            self.command_writers[index].allow_replacement(self._names[index])
            self.ready_writers.allow_replacement(self._names[index])
        final = [deserialize_message(data, Command) if data else Command() for data in final_commands]
        formation = self.membership.formation
        self.publishers.publish_status(formation, phase, formation.reason, change, final)

    def republish_status(self) -> None:
        """Publish the last status again."""
        self.publishers.republish_status()

    def step_begun(self) -> None:
        """No clock."""

    def step_taken(self) -> None:
        """Note the step."""
        self.events.append(("taken", self.steps.plant.step - 1))

    def recorder_lost(self, reason: str) -> None:
        """No recorder."""

    def read_loss_reports(self) -> None:
        """Read what the supervisor has reported."""
        reports, self._reports = self._reports, ()
        self.events.append(("reports read",))
        for satellite in reports:
            self._handle_satellite("lost", satellite)


class Checkpoint:
    """A satellite's last checkpoint in memory, in place of its file."""

    def __init__(self, every: int, data: tuple[int, tuple[int, ...], bytes] | None) -> None:
        self.every = every
        self.data = data
        self.step = -1 if data is None else data[0]

    def load(self) -> None:
        """Read the last checkpoint."""
        self.step = -1 if self.data is None else self.data[0]

    def restore(self, satellite: Satellite, neighbours: Sequence[int]) -> None:
        """Put a satellite into the state of the checkpoint that was found at the start."""
        assert self.data is not None
        _, before, data = self.data
        satellite.rearrange([None] * len(before))
        restore(satellite, data)
        satellite.rearrange([before.index(index) if index in before else None for index in neighbours])

    def due(self, step: int) -> bool:
        """Whether a checkpoint is to be written before a step."""
        return step % self.every == 0

    def keep(self, satellite: Satellite, neighbours: Sequence[int]) -> None:
        """Write a checkpoint if one is due."""
        if satellite.state.step % self.every == 0:
            self.data = satellite.state.step, tuple(neighbours), save(satellite)


class SatelliteProcess:
    """A satellite: its steps, its publishers, and the writers that it accepts."""

    def __init__(
        self, plan: FormationPlan, index: int, checkpoint: tuple[int, tuple[int, ...], bytes] | None
    ) -> None:
        self.events: list[Event] = []
        self.name = plan.names[index]
        self._names = list(plan.names)
        stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self.checkpoint = Checkpoint(plan.timing.checkpoint_steps or 1, checkpoint)
        self.steps = SatelliteSteps(plan, index, self, self.checkpoint)
        node: Any = FakeNode(self.name, self.events)
        self.publishers = SatellitePublishers(node, plan, index, stamps)
        rejections = RejectionCounter()
        self._rejections, self._stamps = rejections, stamps
        self._state_validator = MessageValidator(
            topic_name("state", self.name), STATE, rejections, stamps, MessageRules(exact=False)
        )
        self._validators: dict[int, MessageValidator] = {}
        self._writers: dict[int, AuthorisedWriters] = {}
        for neighbour in plan.membership.possible_graph.neighbours(index):
            self.add_neighbour(neighbour)
        self._first: int | None = None

    def handle(self, kind: str, *details: Any) -> None:
        """Do what follows from something that happens to this process."""
        steps = self.steps
        match kind:
            case "begin":
                steps.offer()
            case "state":
                steps.take_state(self._state_validator, details[0])
            case "status":
                status = deserialize_message(details[0], FormationStatus)
                steps.take_status(status)
                if steps.view.ended is not None:
                    self.events.append(("ended", "over"))
            case "announcement":
                neighbour, writer, data = details
                subscribed = neighbour in self._writers
                if subscribed and accepted(self._writers[neighbour], writer, self._names[neighbour]):
                    steps.take_announcement(neighbour, self._validators[neighbour], data)
            case "retransmit":
                if steps.view.ended is None and steps.flying:
                    self.publishers.retransmit()

    # What the steps ask for

    def publish_command(self, step: int, decision: Decision, message: StampedMessage) -> None:
        """Publish the command of a step."""
        self.events.append(("acted", step))
        self.publishers.command(*self._stamps.at(step), step, decision, message)

    def publish_command_numbers(
        self, step: int, acceleration: Sequence[float], message: StampedMessage
    ) -> None:
        """Publish the command of a step from its numbers."""
        self.events.append(("acted", step))
        now = self._stamps.at(step)
        self.publishers.command_numbers(*now, step, acceleration, NO_TORQUE, message)

    def publish_violation(self, step: int, violation: Violation) -> None:
        """Publish a command of zero."""
        self.publishers.report_violation(step, violation)

    def publish_next(self, step: int, message: StampedMessage) -> None:
        """Publish the neighbour message for a step."""
        self.publishers.publish_next(step, message)

    def publish_joint_estimate(self, step: int, numbers: Array) -> None:
        """No estimates are exchanged here."""

    def publish_tracking(self, step: int, decision: Decision) -> None:
        """For observers only."""

    def publish_tracking_numbers(self, step: int, numbers: Sequence[float]) -> None:
        """For observers only."""

    def publish_changes(self, step: int) -> None:
        """No parameters are changed here."""

    def publish_ready(self) -> None:
        """Publish that this satellite is ready."""
        self.events.append(("ready", self.checkpoint.step))

    def forget_messages(self) -> None:
        """Do not retransmit what was published last."""
        self.publishers.forget()

    def await_status(self) -> None:
        """The explorer brings it at some time."""

    def lost(self, step: int, *, planned: bool) -> None:
        """End this process."""
        raise ProcessEndedError(f"lost at step {step}")

    def allow_replacement(self, lost: Collection[int]) -> None:
        """Accept restarted processes of lost satellites."""
        for index in lost:
            if index in self._writers:
                self._writers[index].allow_replacement(self._names[index])

    def add_neighbour(self, neighbour: int) -> None:
        """Accept messages of a neighbour."""
        name = self._names[neighbour]
        self._writers[neighbour] = AuthorisedWriters([name])
        self._validators[neighbour] = MessageValidator(
            topic_name("arc_length", name), PHASE, self._rejections, self._stamps, MessageRules(exact=False)
        )

    def retarget(self, satellite: Satellite, target: Target) -> None:
        """No targets are changed here."""

    def reset_parameters(self) -> None:
        """No parameters are changed here."""

    def may_have_begun_here(self, step: int) -> bool:
        """On the wall clock only."""
        return False

    def require_lost(self, step: int, version: int, *, alive: bool, known_version: int) -> None:
        """End this process if another one flies this satellite, as `DuplicateCheck` does in lockstep."""
        if not alive or step == 0 or version != known_version:
            self._first = None
            return
        self._first = step if self._first is None else self._first
        if step >= self._first + 3:
            raise ProcessEndedError("another process flies it")


def accepted(writers: AuthorisedWriters, writer: bytes, name: str) -> bool:
    """Whether a message of a writer is accepted."""
    if writers.name_of(writer) is not None:
        return True
    if writers.rejection(writer) is not None:
        return False
    return writers.decide(writer, name) is None
