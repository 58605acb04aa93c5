"""The node of one satellite: state and neighbours' phases in, command and own phase out."""

import os
import resource
import signal
import sys
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

import numpy as np
from satform_msgs.msg import Attitude as AttitudeMessage
from satform_msgs.msg import (
    Command,
    FormationStatus,
    ParameterChange,
    Ready,
    RelativeState,
    Tracking,
)

from satform.adjustments import Adjustments
from satform.announcements import WIDTH, numbers
from satform.consensus.arc_length import Announces
from satform.control.protocol import Motion
from satform.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.faults import Faults
from satform.formation import Back, Lost, planned
from satform.inbox import Told
from satform.orientation import Attitude
from satform.post import Ears
from satform.satellite import Decision, Satellite, flight_plan
from satform.scenario import Scenario
from satform.spec import Spec
from satform_nodes import topics
from satform_nodes.checkpoint_file import CheckpointFile
from satform_nodes.diagnostics import Condition, Health, flight_condition
from satform_nodes.entry import Entry, Refusals
from satform_nodes.executor import StepExecutor
from satform_nodes.formation_view import FormationView
from satform_nodes.lifetime import NodeError, StopRequest, patience, run, scenario_of, see_off
from satform_nodes.on_the_clock import Ages, processor_seconds
from satform_nodes.parameters import (
    FormationNode,
    declare_fixed,
    declare_rate,
    declare_spec,
    on_spec_change,
)
from satform_nodes.readiness import Company
from satform_nodes.report import Report
from satform_nodes.speakers import Speakers, decoded
from satform_nodes.stamps import Stamps
from satform_nodes.wire import Layout, layout

if TYPE_CHECKING:
    from satform_nodes.abreast import Abreast

_STATE = layout(RelativeState, topics.FRAME)
_ATTITUDE = layout(AttitudeMessage, topics.FRAME)
_COMMAND = layout(Command, topics.FRAME)
_TRACKING = layout(Tracking, topics.FRAME)
_NO_TORQUE = (0.0, 0.0, 0.0)
_NOTHING = (0, 0, *[0.0] * 8)
"""What a command says of the next announcement when there is none."""

_PLACE = slice(4, 7)
"""Where a state message has its position."""

_ANY_STEP = 2**63
"""A step beyond every flight."""

_FAREWELL = 2.0
"""How long a satellite stays for the sake of what it said last, s."""

_KILOBYTE = 1024
"""Unit in which Linux tells the memory of a process, bytes."""


@dataclass(frozen=True)
class Settings:
    """What a satellite's node is told at its start beside the scenario.

    Attributes:
        name: of the satellite.
        recorded: whether a recorder takes part, to be waited for.
        checkpoints: folder of the checkpoints; empty when none are kept.
        alone: whether the satellite has its process for itself.
        rate: simulated seconds in each second of the wall clock; 0 for lockstep.
    """

    name: str
    recorded: bool
    checkpoints: str
    alone: bool
    rate: float = 0.0


class SatelliteNode:
    """Carries the flight software of one satellite; every formula is in `satform`."""

    def __init__(
        self,
        node: FormationNode,
        executor: StepExecutor,
        scenario: Scenario,
        settings: "Settings",
        report: Report,
    ) -> None:
        names = [satellite.name for satellite in scenario.satellites]
        name = settings.name
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
        self.step = 0
        self.pulse = 0
        self.flying = False
        self.refusals = Refusals()
        self.busy_seconds = 0.0
        self._told_step, self._told_at = 0, time.monotonic()
        self.view = FormationView(scenario)
        self._settings = settings
        self._clocked = settings.rate > 0.0
        self._profile = topics.NEWEST if self._clocked else topics.STEPPED_READER
        self._ages = Ages()
        self._skipped = 0
        self._newest: dict[int, deque[tuple[int, tuple[float, ...]]]] = {}
        self._names = names
        self._stamps = Stamps(scenario.timing.step, scenario.timing.step_nanoseconds)
        self._graph = scenario.possible_graph()
        self._neighbours = list(self._graph.neighbours(self.index))
        self._announces = scenario.consensus.announces
        self._faults = Faults(scenario.faults, names, scenario.timing.step)
        self._memory = CheckpointFile(settings.checkpoints, name, scenario.checkpoint_steps)
        self._changes: list[tuple[str, list[float]]] = []
        self._state: tuple[Any, ...] | None = None
        self._attitude: tuple[Any, ...] | None = None
        self._turns = scenario.satellite(self.index).attitude is not None
        # What each neighbour said, by step: its time, then the numbers of its announcement.
        self._heard: dict[int, dict[int, tuple[float, ...]]] = {}
        self._said: deque[bytes] = deque(maxlen=2)
        self._last_command = b""
        self._abreast: Abreast | None = None
        self._row = 0
        self._start_afresh()

        for prefix in self._adjustments.specs:
            self._declare_specs(prefix)
        self._make_endpoints(node)
        self._health = Health(node, f"{name}: flight software", name, self._condition)

    def _make_endpoints(self, node: FormationNode) -> None:
        name, names = self.name, self._names
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
        self._writers: dict[int, Speakers] = {}
        self._listen_to_plant()
        for neighbour in self._neighbours:
            self._listen_to(neighbour)
        # Made last: whoever sees this subscription has seen all others of this satellite.
        status = self.executor.subscribe(
            node,
            FormationStatus,
            topics.STATUS,
            self._on_status,
            topics.LATCHED_READER,
            Speakers(node, topics.STATUS, ["plant"], self.refusals),
        )
        self._spoken = (self._say_command, self._say_announcement, self._say_tracking, self._say_change)
        watching = ["recorder"] if self._settings.recorded else []
        self._company.speaks(status, ["plant"])
        self._company.listens(self._say_ready, ["plant"])
        self._company.listens(self._say_command, ["plant", *watching])
        self._company.listens(self._say_tracking, watching)
        listeners = [names[listener] for listener in self._graph.listeners(self.index)]
        self._company.listens(self._say_announcement, [*listeners, *watching])

    def _start_afresh(self) -> None:
        """Be as at the start of the flight."""
        own = flight_plan(self.scenario, self.index)
        self.satellite = Satellite(own, len(self._neighbours))
        self._ears = Ears(self.scenario, np.asarray(self.index), [self._neighbours])
        self._adjustments = Adjustments(self.scenario, self.index)

    def _listen_to_plant(self) -> None:
        jump = topics.FASTEST * self.scenario.timing.step + topics.NEAR
        told: list[tuple[str, Any, Entry]] = [
            (
                topics.state(self.name),
                self._on_state,
                self._entry(topics.state(self.name), _STATE, _PLACE, jump),
            )
        ]
        if self._turns:
            topic = topics.attitude(self.name)
            told.append((topic, self._on_attitude, self._entry(topic, _ATTITUDE)))
        for topic, callback, entry in told:
            kind = topics.TYPES[topic.rpartition("/")[2]]
            speakers = Speakers(self.node, topic, ["plant"], self.refusals)
            subscription = self.executor.subscribe(
                self.node, kind, topic, partial(callback, entry), self._profile, speakers
            )
            self._company.speaks(subscription, ["plant"])

    def _entry(self, topic: str, form: Layout, watched: slice = slice(0), jump: float = 0.0) -> Entry:
        return Entry(topic, form, self.refusals, watched, jump)

    def _listen_to(self, neighbour: int) -> None:
        message, speaker = topics.TYPES[self._announces], self._names[neighbour]
        topic = getattr(topics, self._announces)(speaker)
        entry = self._entry(topic, self._announcement)
        callback = partial(self._on_announcement, neighbour, entry)
        speakers = Speakers(self.node, topic, [speaker], self.refusals)
        self._writers[neighbour] = speakers
        subscription = self.executor.subscribe(self.node, message, topic, callback, self._profile, speakers)
        self._company.speaks(subscription, [speaker])

    def matched(self) -> bool:
        """Whether everyone this satellite talks to or listens to is there, seen from this side."""
        return self._company.complete(self.view.lost)

    def say_ready(self) -> None:
        """Tell the plant that this satellite can fly, and from which checkpoint it would go on."""
        name = self.node.get_fully_qualified_name()
        self._say_ready.publish(Ready(node=name, step=self.step, checkpoint=self._memory.step))

    def see_off(self) -> None:
        """Stay until what was said last has arrived, for a bounded time: it would be lost with this node.

        In lockstep a flight is finished when the plant has every command and the recorder has every step,
        so that only changes may still be on their way.
        """
        ended = self.view.ended
        finished = ended is not None and ended.phase == FormationStatus.FINISHED and not self._clocked
        see_off((self._say_change,) if finished else self._spoken, self._heard_out, _FAREWELL)

    def _heard_out(self) -> bool:
        """Whether the plant or the recorder still listens to this satellite."""
        others = self.node.get_subscriptions_info_by_topic(topics.command(self.name))
        return bool({"plant", "recorder"} & {other.node_name for other in others})

    def say_how_it_went(self) -> None:
        """Tell whoever started the process what this satellite did."""
        self.report.say(
            "satellite",
            node=self.name,
            step=self.step,
            busy=self.busy_seconds,
            refused=self.refusals.total,
            skipped=self._skipped,
            processor=processor_seconds(),
            **self._ages.data(),
        )

    def say_again(self) -> None:
        """Repeat what was said last: the flight does not go on, and somebody may not have heard it."""
        if self.view.ended is not None or not self.flying:
            return
        if self._last_command:
            self._say_command.publish(self._last_command)
        for said in self._said:
            self._say_announcement.publish(said)

    def command_nothing(self) -> None:
        """Turn the thrusters off, as far as anyone hears it: the plant is no longer there."""
        if self.flying:
            self._say_command.publish(
                _COMMAND.pack(*self._stamps.at(self.step), self.step, *[0.0] * 6, *_NOTHING)
            )

    def _condition(self) -> Condition:
        """How the flight software is."""
        now = time.monotonic()
        rate = (self.step - self._told_step) / max(now - self._told_at, 1e-9)
        self._told_step, self._told_at = self.step, now
        formation = self.view.formation
        silent = {
            self._names[place]: self.step - formation.lost_at.get(place, self.step)
            for place in self._neighbours
            if not formation.alive[place]
        }
        refused = {f"{topic}: {reason}": count for (topic, reason), count in self.refusals.counts.items()}
        return flight_condition(step=self.step, step_rate=rate, refused=refused, silent=silent)

    def _on_announcement(self, neighbour: int, entry: Entry, data: bytes, _name: str) -> None:
        if self._clocked:
            self._take_newest(neighbour, entry.admit(data, 0, _ANY_STEP))
            return
        last = self.step + 1 if self.flying else _ANY_STEP
        said = entry.admit(data, self.step if self.flying else 0, last)
        if said is None:
            return
        words = self._words(said)
        if self._abreast is None:
            self.hear(neighbour, said[2], words)
            self._act_if_complete()
        else:
            self._abreast.hear(self._row, neighbour, said[2], words)

    def hear(self, neighbour: int, step: int, words: tuple[float, ...]) -> None:
        """Note what a neighbour said for a step: its time, then the numbers of its announcement."""
        self._heard.setdefault(step, {})[neighbour] = words

    def _take_newest(self, neighbour: int, said: tuple[Any, ...] | None) -> None:
        """On the wall clock: keep what a neighbour said for the latest steps."""
        if said is not None:
            own = self._newest.setdefault(neighbour, deque(maxlen=3))
            own.append((said[2], self._words(said)))

    def _words(self, said: tuple[Any, ...]) -> tuple[float, ...]:
        """Time and numbers of an announcement, from all that its message holds."""
        return (self._stamps.time(said[0], said[1]), *said[-WIDTH[self._announces] :])

    def _on_state(self, entry: Entry, data: bytes, _name: str) -> None:
        before = entry.repeated
        last = self.step if self.flying and not self._clocked else _ANY_STEP
        numbers = entry.admit(data, self.step, last)
        # Whatever the plant says is a sign that it is there.
        self.pulse += numbers is not None or entry.repeated > before
        if numbers is None:
            return
        self._state = numbers
        if self._abreast is None:
            self._act_if_complete()
        else:
            self._abreast.see(self._row, numbers)

    def _on_attitude(self, entry: Entry, data: bytes, _name: str) -> None:
        last = self.step if self.flying and not self._clocked else _ANY_STEP
        numbers = entry.admit(data, self.step, last)
        if numbers is None:
            return
        self._attitude = numbers
        if self._abreast is None:
            self._act_if_complete()
        else:
            self._abreast.turn(self._row, numbers)

    def _on_status(self, data: bytes, _name: str) -> None:
        status = decoded(data, FormationStatus, topics.STATUS, self.refusals)
        if status is None:
            return
        self.pulse += 1
        before = self.view.formation.number
        if not self.view.take(status):
            self.refusals.note(topics.STATUS, "not about this formation")
            return
        formation = self.view.formation
        if formation.number == before:
            return
        self._part()
        for place, speakers in self._writers.items():
            if not formation.alive[place]:
                speakers.vacate(self._names[place])
        if not formation.alive[self.index]:
            self._fall()
        self._meet_new_neighbours()
        self._act_if_complete()

    def _fall(self) -> None:
        """The plant counts this satellite as lost."""
        if self.flying and self._is_planned_to_fall() and self._settings.alone:
            self.see_off()
            self.report.say("killed", node=self.name, step=self.step)
            os.kill(os.getpid(), signal.SIGKILL)
        if self.flying and not self._is_planned_to_fall():
            sentence = f"the plant counts {self.name} as lost since step {self.view.formation.step}"
            raise NodeError(f"{sentence}; it ends, so that it can be started anew", EXIT_LOST)
        first = not self.flying
        self.flying = False
        self._heard.clear()
        self._said.clear()
        self._last_command = b""
        self._state = self._attitude = None
        if not first:
            # Satellites of a group share its process, which flies on.
            self._start_afresh()
            self._memory.load()
            if self._is_planned_to_return():
                self.say_ready()

    def _is_planned_to_fall(self) -> bool:
        events = planned(self.scenario).get(self.view.formation.step, [])
        return any(isinstance(event, Lost) and event.satellite == self.index for event in events)

    def _is_planned_to_return(self) -> bool:
        """Whether the scenario has a step at which this satellite takes part again."""
        return any(
            isinstance(event, Back) and event.satellite == self.index
            for step, events in planned(self.scenario).items()
            for event in events
            if step >= self.view.formation.step
        )

    def _meet_new_neighbours(self) -> None:
        """Listen to those whom the graph lets this satellite hear now and never did before."""
        heard = self.view.formation.graph.neighbours(self.index)
        new = [place for place in heard if place not in self._neighbours]
        if not new:
            return
        before = list(self._neighbours)
        self._neighbours = sorted([*before, *new])
        for neighbour in new:
            self._listen_to(neighbour)
        places = [before.index(place) if place in before else None for place in self._neighbours]
        self.satellite.rearrange(places)
        self._ears = Ears(self.scenario, np.asarray(self.index), [self._neighbours])

    @property
    def neighbours(self) -> list[int]:
        """Places of those whom this satellite may hear, ascending."""
        return self._neighbours

    @property
    def turns(self) -> bool:
        """Whether the satellite has an attitude."""
        return self._turns

    @property
    def lockstep(self) -> bool:
        """Whether the flight goes step by step, and not by the wall clock."""
        return not self._clocked

    def hears_all(self) -> bool:
        """Whether the graph of the moment lets this satellite hear all whom it may ever hear."""
        return bool(self._ears.linked(self.view.formation).all())

    def fly_abreast(self, abreast: "Abreast", row: int) -> None:
        """From now on hand over what arrives to those who act together."""
        self._abreast, self._row = abreast, row

    def fly_alone(self, satellite: Satellite | None) -> None:
        """From now on act alone, with flight software that goes on from where the others were together."""
        self._abreast = None
        if satellite is not None:
            self.satellite = satellite

    def go_on(self) -> None:
        """Act if everything for the step is there already."""
        self._act_if_complete()

    def _part(self) -> None:
        """Something is out of the ordinary: those who acted together go on one by one."""
        if self._abreast is not None:
            self._abreast.part()

    def _act_if_complete(self) -> None:
        state = self._state
        if state is None or not self._knows(int(state[3])):
            return
        step = int(state[2])
        if step >= self.scenario.timing.steps:
            self._state = None
            return
        if not self.flying and not self.join(step):
            return
        if self._clocked:
            self._act_on_the_clock(step, state)
            return
        heard = self._heard.get(step, {})
        speakers = self._speakers(step)
        if any(speaker not in heard for speaker in speakers):
            self._add_last_words(step, heard)
            if any(speaker not in heard for speaker in speakers):
                return
        if self._turns and (self._attitude is None or self._attitude[2] != step):
            return
        self._act(step, state, heard, speakers)

    def _act_on_the_clock(self, step: int, state: tuple[Any, ...]) -> None:
        """Act on a state with what has been heard by now, whether it is of this step or older."""
        if self._turns and (self._attitude is None or self._attitude[2] != step):
            return
        if step > self.step:
            # States that came too fast were left out.
            self._skipped += step - self.step
            self.satellite.join(step)
            self.step = step
        heard: dict[int, tuple[float, ...]] = {}
        for neighbour in self._speakers(step):
            # What is said for the next step already is kept for that.
            due = [said for spoken, said in self._newest.get(neighbour, ()) if spoken <= step]
            if due:
                heard[neighbour] = due[-1]
                self._ages.note(step * self.scenario.timing.step - due[-1][0])
        self._act(step, state, heard, list(heard))

    def _knows(self, number: int) -> bool:
        """Whether the formation that a state is meant for is known; its status is on its way if not."""
        if number > self.view.formation.number:
            self.executor.look_soon()
            return False
        return True

    def _speakers(self, step: int) -> list[int]:
        linked = self._ears.linked(self.view.formation)
        return [
            neighbour
            for place, neighbour in enumerate(self._neighbours)
            if linked[place] and self.view.speaks(neighbour, step)
        ]

    def _add_last_words(self, step: int, heard: dict[int, tuple[float, ...]]) -> None:
        """What lost neighbours had announced for the step in which they were lost."""
        for neighbour, command in self.view.last_words.items():
            if self.view.formation.lost_at.get(neighbour) == step and neighbour in self._neighbours:
                heard.setdefault(neighbour, last_word(command, self._announces, self._stamps))
        self._heard[step] = heard

    def join(self, step: int) -> bool:
        """Begin to fly with the first state, or come back when the plant says so."""
        returned = self.view.returns.get(self.index)
        if returned is None:
            if step != 0:
                return False
        else:
            if returned[0] != step:
                return False
            if returned[1] >= 0:
                self._memory.restore(self.satellite)
            self.satellite.join(step)
        self.flying = True
        self.step = step
        self._announce()
        return True

    def _act(
        self, step: int, state: tuple[Any, ...], heard: dict[int, tuple[float, ...]], speakers: list[int]
    ) -> None:
        # The processor's time: the wall clock would count those who are let in meanwhile.
        begin = time.thread_time()
        told = self._told(step, heard, speakers)
        motion = Motion(np.array(state[4:7]), np.array(state[7:10]))
        attitude = None
        if self._attitude is not None:
            attitude = Attitude(*np.array(self._attitude[3:12]).reshape(3, 3))
        measured_step = self._stamps.step(state[0], state[1])
        decision = self.satellite.act(motion, told, measured_step, attitude)
        self.busy_seconds += time.thread_time() - begin
        seconds, nanoseconds = self._stamps.at(step)
        self._state = self._attitude = None
        self._heard.pop(step, None)
        self._heard.pop(step - 1, None)
        self.step = step + 1
        values = self._values_to_say()
        self._command(seconds, nanoseconds, step, decision, values)
        self._memory.keep(self.satellite)
        self._announce(values)
        self._show(seconds, nanoseconds, step, decision)
        self._tell_changes(step)

    def has_acted(self, busy: float) -> None:
        """Note that this satellite has taken its step together with others.

        Args:
            busy: its part of the processor time, s.
        """
        self.busy_seconds += busy
        self._state = self._attitude = None
        self.step += 1

    def say_command(self, data: bytes) -> None:
        """Command the thrusters; the message is kept to be said again."""
        self._last_command = data
        self._say_command.publish(data)

    def say_announcement(self, data: bytes) -> None:
        """Tell the listeners; the message is kept to be said again."""
        self._said.append(data)
        self._say_announcement.publish(data)

    def say_tracking(self, data: bytes) -> None:
        """Show how well the reference is followed."""
        self._say_tracking.publish(data)

    @property
    def memory(self) -> CheckpointFile:
        """Where this satellite's checkpoints are kept."""
        return self._memory

    def _told(self, step: int, heard: dict[int, tuple[float, ...]], speakers: list[int]) -> Told:
        """What the links make of what the neighbours said for this step."""
        count = len(self._neighbours)
        if len(speakers) == count:
            width = 1 + WIDTH[self._announces]
            said = np.array([heard[neighbour] for neighbour in self._neighbours]).reshape(count, width)
            return self._ears.told(step, said[:, 1:], said[:, 0], np.ones(count), self.view.formation)
        said, fresh = np.zeros((count, 1 + WIDTH[self._announces])), np.zeros(count)
        for place, neighbour in enumerate(self._neighbours):
            if neighbour in speakers:
                said[place], fresh[place] = heard[neighbour], 1.0
        return self._ears.told(step, said[:, 1:], said[:, 0], fresh, self.view.formation)

    def _values_to_say(self) -> tuple[tuple[int, int], list[float]]:
        """Stamp and numbers of the next announcement, true or not."""
        said = self.satellite.announce()
        values = self._faults.said(self.index, numbers(said), self.step)
        return self._stamps.at_time(float(said.time)), values.tolist()

    def _announce(self, values: tuple[tuple[int, int], list[float]] | None = None) -> None:
        stamp, said = values or self._values_to_say()
        self.say_announcement(self._announcement.pack(*stamp, self.step, *self._before_numbers, *said))

    @property
    def _before_numbers(self) -> tuple[int, ...]:
        """What an announcement carries between its step and its numbers."""
        return (0,) if self._announces == "motion" else ()

    def _command(
        self,
        seconds: int,
        nanoseconds: int,
        step: int,
        decision: Decision,
        values: tuple[tuple[int, int], list[float]],
    ) -> None:
        stamp, said = values
        torque = _NO_TORQUE if decision.wheel_torque is None else decision.wheel_torque.tolist()
        announced = (*said, *[0.0] * 6) if self._announces == "arc_length" else (0.0, 0.0, *said)
        self.say_command(
            _COMMAND.pack(
                seconds, nanoseconds, step, *decision.acceleration.tolist(), *torque, *stamp, *announced
            )
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

    def _declare_specs(self, prefix: str) -> None:
        def accept(spec: Spec, fields: dict[str, Any]) -> str:
            return self._accept(prefix, spec, fields)

        declare_spec(self.node, prefix, self._adjustments.specs[prefix])
        on_spec_change(self.node, prefix, lambda: self._adjustments.specs[prefix], accept)

    def _accept(self, prefix: str, spec: Spec, fields: dict[str, Any]) -> str:
        self._part()
        self._adjustments.use(self.satellite, prefix, spec)
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


def last_word(command: Command, announces: Announces, stamps: Stamps) -> tuple[float, ...]:
    """Time and numbers of the announcement that a lost satellite's last command carries."""
    time = stamps.time(command.announced_at.sec, command.announced_at.nanosec)
    if announces == "arc_length":
        return (time, command.announced_arc_length, command.announced_rate)
    position, velocity = command.announced_position, command.announced_velocity
    return (time, position.x, position.y, position.z, velocity.x, velocity.y, velocity.z)


def declare_settings(node: FormationNode) -> tuple[bool, str, float]:
    """Declare what satellites' nodes have in common: whether there is a recorder, checkpoints, the clock."""
    declare_fixed(node, "scenario", "", "path of the scenario file")
    recorded = declare_fixed(node, "recorded", False, "whether a recorder takes part, to be waited for")
    checkpoints = declare_fixed(node, "checkpoints", "", "folder of the checkpoints; empty to keep none")
    return recorded, checkpoints, declare_rate(node)


def fly(node: FormationNode, executor: StepExecutor, stop: StopRequest, report: Report) -> int:
    """Find the others, fly until the plant says that the flight has ended, and go."""
    recorded, checkpoints, rate = declare_settings(node)
    name = declare_fixed(node, "satellite", "", "name of the satellite in the scenario")
    scenario = scenario_of(node)
    settings = Settings(name, recorded, checkpoints, alone=True, rate=rate)
    return fly_all([SatelliteNode(node, executor, scenario, settings, report)], executor, stop)


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
    longest = patience(len(satellites[0].scenario.satellites))

    def over() -> bool:
        return stop.asked or all(satellite.view.ended for satellite in satellites)

    if not executor.spin_until(
        lambda: all(satellite.matched() for satellite in satellites) or over(), longest
    ):
        sentence = f"{names}: neighbours and plant have not been found within {longest:g} s"
        raise NodeError(sentence, EXIT_LOST)
    for satellite in satellites:
        satellite.say_ready()
        satellite.report.say("ready", node=satellite.name)

    def begun() -> bool:
        return over() or any(satellite.flying for satellite in satellites)

    def say_again() -> None:
        for satellite in satellites:
            satellite.say_again()

    def pulse() -> int:
        return sum(satellite.pulse for satellite in satellites)

    # The first state comes when the last of all nodes is ready; the next ones soon or never.
    silence = 2.0 * satellites[0].scenario.tolerated_silence
    in_time = executor.spin_while(lambda: not begun(), longest, progress=pulse)
    in_time = in_time and executor.spin_while(lambda: not over(), silence, say_again, pulse)
    _say_farewell(satellites, in_time=in_time)
    return EXIT_STOPPED if stop.asked else EXIT_DONE


def _say_farewell(satellites: Sequence[SatelliteNode], *, in_time: bool) -> None:
    """Say how it went, and leave when all has arrived.

    Raises:
        NodeError: the plant is no longer there.
    """
    for satellite in satellites:
        if in_time:
            satellite.see_off()
        else:
            satellite.command_nothing()
        satellite.say_how_it_went()
    first = satellites[0]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _KILOBYTE
    first.report.say("memory", process=first.name, bytes=memory)
    if not in_time:
        sentence = f"nothing heard from the plant at step {first.step}"
        first.report.say("lost", who=["plant"], step=first.step, reason=sentence)
        names = ", ".join(satellite.name for satellite in satellites)
        raise NodeError(f"{names}: {sentence}; thrusters off, stopping", EXIT_LOST)


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Fly one satellite; entry point of the executable `satellite_node`."""
    return run("satellite", fly, arguments, Report(pipe))


if __name__ == "__main__":
    sys.exit(main())
