# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An explicit-state model checker that drives the objects that fly through every order of what may happen.

A state is that of the plant, of the satellites, of their checkpoints and of the messages between them. The
reaction of a process to an input is computed by the process itself, once for each of its states and each
input, and remembered; the explorer joins these reactions to all interleavings. States are visited breadth
first, so that the first violation that is found has a shortest history.
"""

import itertools
import random
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from protocol_processes import COMMAND, PHASE, STATE, Event, PlantProcess, ProcessEndedError, SatelliteProcess
from protocol_snapshots import clone, digest
from rclpy.serialization import deserialize_message
from satform_msgs.msg import FormationStatus

from satform.bag.absence_log import happened
from satform.consensus.graph import Graph
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.simulate import simulate
from satform.membership.formation import Formation, TopologyChanged
from satform.scenario import Scenario

Channel = tuple[Any, ...]
"""Kind of a stream of messages that keep their order, and its ends: `("state", i)`, `("status", i)`,
`("announcement", sender, receiver)`, `("command", i)`, `("ready", i)`, `("lost",)`."""

Network = list[tuple[int, ...]]
"""Numbers of the messages in each channel, the next one to be delivered first."""

Action = tuple[Any, ...]
State = tuple[int, ...]
"""Numbers of the states of plant and satellites, of all channels, of held messages, and of what is left."""

ALL_FAULTS = ("delay", "duplicate", "kill", "silent", "graph", "pause", "step")

_KINDS = ("lost", "status", "ready", "state", "announcement", "command")
"""Kinds of channels in the order in which a flight that nothing disturbs delivers their messages."""


class ViolationError(Exception):
    """An invariant does not hold."""


@dataclass(frozen=True)
class Rest:
    """What of a state is neither in a process nor on its way.

    Attributes:
        budget: disturbances that may still happen.
        incarnations: how many processes of each satellite were started before the present one.
        acted: of each satellite, the last step whose command it has published; -1 before.
        waiting: progress of the plant when all published their last messages again; empty before.
    """

    budget: int
    incarnations: tuple[int, ...]
    acted: tuple[int, ...]
    waiting: tuple[int, ...] = ()


@dataclass
class Outcome:
    """What an exploration has found.

    Attributes:
        states: number of states that were visited.
        transitions: between them.
        ends: states in which the flight is over.
        reactions: of processes that were computed.
        violation: what does not hold; empty when all does.
        history: actions from the start to the violation.
        complete: whether every reachable state was visited.
    """

    states: int = 0
    transitions: int = 0
    ends: int = 0
    reactions: int = 0
    violation: str = ""
    history: list[str] = field(default_factory=list)
    complete: bool = True


class Interned:
    """Values by number."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self._numbers: dict[Any, int] = {}

    def number(self, value: Any) -> int:
        """Number of a value, a new one for a new value."""
        known = self._numbers.get(value)
        if known is None:
            known = self._numbers[value] = len(self.values)
            self.values.append(value)
        return known


class Explorer:
    """Explores the flights of one scenario."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        budget: int,
        faults: tuple[str, ...] = ALL_FAULTS,
        plant: type[PlantProcess] = PlantProcess,
        satellite: type[SatelliteProcess] = SatelliteProcess,
        restarts: int = 1,
        reduced: bool = True,
    ) -> None:
        """Nothing has been visited yet.

        Args:
            scenario: in lockstep, without sensors, estimates and attitudes.
            budget: how many disturbances happen at most.
            faults: kinds of disturbances.
            plant: class of the plant's process.
            satellite: class of a satellite's process.
            restarts: of each satellite at most.
            reduced: whether orders that lead to the same are left out.
        """
        self.scenario = scenario
        self.plan: FormationPlan = compile_scenario(scenario)
        self.count = len(self.plan.names)
        self._budget = budget
        self._faults = faults
        self._restarts = restarts
        self._reduced = reduced
        self._plant_class, self._satellite_class = plant, satellite
        self._objects: list[Any] = []
        self._object_ids: dict[bytes, int] = {}
        self._reactions: dict[tuple[int, int], tuple[int, tuple[Event, ...], str]] = {}
        self._inputs = Interned()
        self._messages = Interned()
        self._networks = Interned()
        self._held = Interned()
        self._rests = Interned()
        self._disks = Interned()
        self._expected: dict[tuple[bytes, ...], Any] = {}
        self.channels = self._all_channels()
        self._channel_index = {channel: place for place, channel in enumerate(self.channels)}
        self._graphs = [self._other_graph()]
        self._no_messages: tuple[tuple[Any, ...], ...] = ((),) * len(self.channels)

    def _all_channels(self) -> list[Channel]:
        everyone = range(self.count)
        found: list[Channel] = [("lost",)]
        for kind in ("status", "ready", "state"):
            found += [(kind, index) for index in everyone]
        found += [("announcement", one, other) for one in everyone for other in everyone if one != other]
        found += [("command", index) for index in everyone]
        return sorted(found, key=lambda channel: (_KINDS.index(channel[0]), channel[1:]))

    def _other_graph(self) -> TopologyChanged:
        """The graph that the disturbance `graph` sets: a line in one direction."""
        adjacency = np.zeros((self.count, self.count))
        for index in range(self.count - 1):
            adjacency[index, index + 1] = 1.0
        return TopologyChanged(Graph(adjacency), "the graph was changed by a service")

    # Processes

    def _number_of(self, process: Any) -> int:
        key = digest(process)
        known = self._object_ids.get(key)
        if known is None:
            known = self._object_ids[key] = len(self._objects)
            self._objects.append(process)
        return known

    def _react(self, process: int, given: tuple[Any, ...]) -> tuple[int, tuple[Event, ...], str]:
        """State after an input, events, and why the process has ended; remembered."""
        key = (process, self._inputs.number(given))
        known = self._reactions.get(key)
        if known is not None:
            return known
        one = clone(self._objects[process])
        why = ""
        try:
            one.handle(*given)
        except ProcessEndedError as error:
            why = str(error)
        except (AssertionError, ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise ViolationError(f"a process fails: {type(error).__name__}: {error}") from error
        events = tuple(one.events)
        one.events.clear()
        if isinstance(one, PlantProcess):
            self._check_plant(one, events)
        else:
            events = tuple(
                (*event, view_of(one.steps.view.formation)) if event[0] == "acted" else event
                for event in events
            )
        result = (self._number_of(one), events, why)
        self._reactions[key] = result
        return result

    # Invariants of the plant

    def _check_plant(self, plant: PlantProcess, events: tuple[Event, ...]) -> None:
        """Remember what was published as status; check each step that was taken."""
        statuses = plant.__dict__.setdefault("statuses", [])
        versions = plant.__dict__.setdefault("versions", {})
        formation = plant.membership.formation
        versions.setdefault(formation.number, view_of(formation))
        for event in events:
            if event[0] == "publish" and event[1].endswith("status") and event[2] not in statuses[-1:]:
                statuses.append(event[2])
        for event in events:
            if event[0] == "taken":
                self._check_step(plant, event[1])

    def _check_step(self, plant: PlantProcess, step: int) -> None:
        taken_before = plant.steps.plant.step
        if taken_before != step + 1:
            raise ViolationError(f"step {step} is not the one that was due")
        found = plant.steps.plant.motion().position.tobytes()
        expected = self._expected_positions(tuple(plant.statuses), step + 1)
        if found != expected:
            raise ViolationError(f"after step {step} the plant has other bits than the flight in one process")

    def _expected_positions(self, statuses: tuple[bytes, ...], step: int) -> bytes:
        """Positions at a step of a flight in one process in which the same has happened."""
        relevant = []
        for data in statuses:
            status = deserialize_message(data, FormationStatus)
            if status.version and status.step < step:
                relevant.append(data)
        key = tuple(relevant)
        record = self._expected.get(key)
        if record is None:
            messages = [deserialize_message(data, FormationStatus) for data in relevant]
            events = happened(messages, [], self.plan.membership)
            try:
                record = simulate(self.scenario, events=events, stacked=False).position
            except ValueError as error:
                raise ViolationError(f"the flight cannot be repeated: {error}") from error
            self._expected[key] = record
        positions: bytes = np.ascontiguousarray(record[step]).tobytes()
        return positions

    # States

    def start(self) -> State:
        """The state in which all nodes are ready and the plant publishes the first states."""
        process = self._plant_class(self.plan)
        rest = Rest(self._budget, (0,) * self.count, (-1,) * self.count)
        for index in range(self.count):
            process.handle("ready", index, writer_of(index, rest), -1)
        plant = self._number_of(process)
        satellites = [self._number_of(self._satellite_class(self.plan, i, None)) for i in range(self.count)]
        state = (plant, *satellites, self._networks.number(self._no_messages), self._held.number(()), 0)
        return self._applied(state, list(self._no_messages), rest, "plant", ("begin",))

    def _parts(self, state: State) -> tuple[int, tuple[int, ...], tuple[Any, ...], tuple[Any, ...], Rest]:
        return (
            state[0],
            state[1 : 1 + self.count],
            self._networks.values[state[-3]],
            self._held.values[state[-2]],
            self._rests.values[state[-1]],
        )

    def over(self, state: State) -> bool:
        """Whether the flight is over."""
        return not self._objects[state[0]].steps.flying

    def _applied(
        self, state: State, network: Network, rest: Rest, who: str | int, given: tuple[Any, ...]
    ) -> State:
        """State after an input to a process, whose messages are on their way then."""
        slots = list(state[: 1 + self.count])
        place = 0 if who == "plant" else 1 + int(who)
        number, events, why = self._react(slots[place], given)
        slots[place] = number
        acted = list(rest.acted)
        for event in events:
            match event[0]:
                case "publish":
                    self._send(network, slots, who, rest, event[1], event[2])
                case "ready":
                    writer = writer_of(int(who), rest)
                    self._put(network, ("ready", who), (writer, event[1]))
                case "acted":
                    self._check_act(int(who), event, acted, slots[0])
                    acted[int(who)] = event[1]
        rest = replace(rest, acted=tuple(acted))
        if why:
            return self._dead(slots, network, rest, int(who), state[-2])
        return self._packed(slots, network, state[-2], rest)

    def _packed(self, slots: list[int], network: Network, held: int, rest: Rest) -> State:
        return (*slots, self._networks.number(tuple(network)), held, self._rests.number(rest))

    def _put(self, network: Network, channel: Channel, message: Any) -> None:
        network[self._channel_index[channel]] += (self._messages.number(message),)

    def _send(
        self, network: Network, slots: list[int], who: str | int, rest: Rest, topic: str, data: bytes
    ) -> None:
        name, _, kind = topic.rpartition("/")
        names = self.plan.names
        if kind == "status":
            for index in range(self.count):
                if slots[1 + index] >= 0:
                    self._put(network, ("status", index), data)
        elif kind == "state" and name in names:
            index = names.index(name)
            if slots[1 + index] >= 0:
                self._put(network, ("state", index), data)
        elif kind == "command":
            self._put(network, ("command", who), (writer_of(int(who), rest), data))
        elif kind == "arc_length":
            for index in range(self.count):
                if index != who and slots[1 + index] >= 0:
                    self._put(network, ("announcement", who, index), (writer_of(int(who), rest), data))

    def _check_act(self, satellite: int, event: Event, acted: list[int], plant: int) -> None:
        _, step, view = event
        name = self.plan.names[satellite]
        if step <= acted[satellite]:
            raise ViolationError(f"{name} acts in step {step} after it has acted in step {acted[satellite]}")
        if not view[2][satellite]:
            raise ViolationError(f"{name} acts in step {step} though it knows that it is lost")
        versions = self._objects[plant].versions
        if versions.get(view[0]) != view:
            raise ViolationError(f"{name} acts in step {step} by another formation than the plant's")

    def _dead(self, slots: list[int], network: Network, rest: Rest, satellite: int, held: int) -> State:
        """State after the end of a satellite's process, which the supervisor reports to the plant."""
        process = self._objects[slots[1 + satellite]]
        slots[1 + satellite] = -1 - self._disks.number(process.checkpoint.data)
        for place, channel in enumerate(self.channels):
            if receiver_of(channel) == satellite:
                network[place] = ()
        self._put(network, ("lost",), satellite)
        kept = tuple(
            item for item in self._held.values[held] if receiver_of(self.channels[item[0]]) != satellite
        )
        return self._packed(slots, network, self._held.number(kept), rest)

    # Actions

    def actions(self, state: State) -> list[Action]:
        """What has to be explored from a state: everything that may happen next, or a part that is enough."""
        if self._reduced:
            enough = self._enough(state)
            if enough:
                return enough
        return list(self._everything(state))

    def _enough(self, state: State) -> list[Action]:
        """The actions with one message, if its delivery may come before whatever else happens; empty if none.

        A message that changes nothing now and later (a repetition, one of a rejected writer) is delivered at
        once. So is one that its receiver only stores, and that leads to the same before and after each other
        message on its way to this receiver, unless its sender may be lost first; what a disturbance may do to
        it is explored as well.
        """
        _, _, network, held, rest = self._parts(state)
        for item in held:
            who, given = self._input(self.channels[item[0]], item[1])
            if self._changes_nothing(state, who, self.channels[item[0]][0], given):
                return [("release", item)]
        for place, messages in enumerate(network):
            channel = self.channels[place]
            if not messages or channel[0] in ("lost", "ready"):
                continue
            who, given = self._input(channel, messages[0])
            if self._changes_nothing(state, who, channel[0], given):
                return [("deliver", place)]
            if self._only_stores(state, who, channel, given):
                return [("deliver", place), *self._to_messages(place, rest)]
        return []

    def _to_messages(self, place: int, rest: Rest) -> list[Action]:
        """What a disturbance may do to a message that its receiver would only store."""
        kind, *ends = self.channels[place]
        if not rest.budget or kind not in UNORDERED:
            return []
        found = [(fault, place) for fault in ("delay", "duplicate") if fault in self._faults]
        return found + ([("silent", ends[0])] if kind == "command" and "silent" in self._faults else [])

    def _only_stores(self, state: State, who: str | int, channel: Channel, given: tuple[Any, ...]) -> bool:
        """Whether a receiver stores a message and does nothing else, whatever else may happen before."""
        _, satellites, network, _, rest = self._parts(state)
        before = state[0] if who == "plant" else state[1 + int(who)]
        after, events, why = self._react(before, given)
        if events or why or after == before:
            return False
        kind, *ends = channel
        if kind in ("announcement", "command") and self._may_be_dropped(ends[0], satellites, rest):
            return False
        if not self._commutes(state, who, before, given):
            return False
        return kind != "command" or (
            satellites[ends[0]] >= 0 and not self._is_reported_lost(ends[0], network)
        )

    def _commutes(self, state: State, who: str | int, process: int, given: tuple[Any, ...]) -> bool:
        """Whether a message may come before and after each other one that is on its way to its receiver."""
        _, _, network, held, _ = self._parts(state)
        others = [(place, messages[0]) for place, messages in enumerate(network) if messages]
        for place, number in (*others, *held):
            receiver, other = self._input(self.channels[place], number)
            if receiver != who or other == given:
                continue
            if self._both(process, given, other) != self._both(process, other, given):
                return False
        return True

    def _both(self, process: int, one: tuple[Any, ...], other: tuple[Any, ...]) -> tuple[Any, ...]:
        """What follows from two inputs one after another."""
        between, events, why = self._react(process, one)
        if why:
            return between, events, why
        after, later, why = self._react(between, other)
        return after, (*events, *later), why

    def _may_be_dropped(self, sender: int, satellites: tuple[int, ...], rest: Rest) -> bool:
        """Whether a sender may end before a message of it is delivered, which then may be lost."""
        return bool(rest.budget) and "kill" in self._faults and satellites[sender] >= 0

    def _is_reported_lost(self, satellite: int, network: tuple[Any, ...]) -> bool:
        """Whether the plant is about to learn that a process of a satellite has ended."""
        values = self._messages.values
        return any(values[each] == satellite for each in network[self._channel_index[("lost",)]])

    def _changes_nothing(self, state: State, who: str | int, kind: str, given: tuple[Any, ...]) -> bool:
        """Whether a message changes nothing, now and later."""
        before = state[0] if who == "plant" else state[1 + int(who)]
        if kind == "ready":
            return False
        after, events, why = self._react(before, given)
        return after == before and not events and not why and self._is_old(before, kind, given)

    def _kills(self, satellite: int, network: tuple[Any, ...]) -> list[Action]:
        """Ends of a satellite's process, by how many of its last messages each of their receivers gets."""
        own = [
            place
            for place, (kind, *ends) in enumerate(self.channels)
            if kind in ("announcement", "command", "ready") and ends[0] == satellite and network[place]
        ]
        choices = itertools.product(*(range(len(network[place]), -1, -1) for place in own))
        return [("kill", satellite, tuple(zip(own, choice, strict=True))) for choice in choices]

    def _is_old(self, process: int, kind: str, given: tuple[Any, ...]) -> bool:
        """Whether a message that changes nothing now changes nothing later either."""
        one = self._objects[process]
        match kind:
            case "command":
                return bool(COMMAND.unpack(given[-1])[2] < one.steps.plant.step)
            case "state":
                return bool(one.steps.flying and STATE.unpack(given[-1])[2] < one.steps.step)
            case "announcement":
                return bool(one.steps.flying and PHASE.unpack(given[-1])[2] < one.steps.step)
        status = deserialize_message(given[-1], FormationStatus)
        return bool(status.version <= one.steps.view.formation.number)

    def _everything(self, state: State) -> Iterator[Action]:
        """Everything that may happen next."""
        plant, satellites, network, held, rest = self._parts(state)
        process: PlantProcess = self._objects[plant]
        quiet = True
        for place, messages in enumerate(network):
            if messages:
                quiet = False
                yield ("deliver", place)
        for item in dict.fromkeys(held):
            yield ("release", item)
        if process.steps.paused:
            yield ("resume",)
        elif quiet:
            yield ("idle",) if rest.waiting != process.steps.progress else ("timeout",)
        for index, slot in enumerate(satellites):
            if slot < 0 and rest.incarnations[index] < self._restarts:
                yield ("restart", index)
        if rest.budget:
            possible = self._disturbances(process, satellites, network)
            yield from (action for action in possible if action[0] in self._faults)

    def _disturbances(
        self, process: PlantProcess, satellites: tuple[int, ...], network: tuple[Any, ...]
    ) -> Iterator[Action]:
        steps, names = process.steps, self.plan.names
        for place, messages in enumerate(network):
            if messages and self.channels[place][0] in UNORDERED:
                yield from ((kind, place) for kind in ("delay", "duplicate"))
        for index, slot in enumerate(satellites):
            if slot >= 0:
                yield from self._kills(index, network)
        if not process.membership.awaited:
            yield from (("silent", names.index(name)) for name in steps.missing() if name in names)
        if not steps.last_step_taken:
            yield ("graph", 0)
        yield ("step",) if steps.paused else ("pause",)

    def after(self, state: State, action: Action) -> State:
        """The state that follows from an action.

        Raises:
            ViolationError: an invariant does not hold in it.
        """
        _, _, messages, held, rest = self._parts(state)
        network = list(messages)
        kind = action[0]
        if kind == "deliver":
            message, *left = network[action[1]]
            network[action[1]] = tuple(left)
            return self._delivered(state, network, rest, self.channels[action[1]], message)
        if kind == "release":
            kept = list(held)
            kept.remove(action[1])
            state = (*state[:-2], self._held.number(tuple(kept)), state[-1])
            return self._delivered(state, network, rest, self.channels[action[1][0]], action[1][1])
        if kind == "resume":
            return self._applied(state, network, rest, "plant", ("resume",))
        if kind == "idle":
            return self._idle(state)
        if kind == "timeout":
            return self._timed_out(state, network, rest)
        if kind == "restart":
            return self._restarted(state, network, rest, action[1])
        return self._disturbed(state, network, held, rest, action)

    def _delivered(self, state: State, network: Network, rest: Rest, channel: Channel, number: int) -> State:
        who, given = self._input(channel, number)
        return self._applied(state, network, rest, who, given)

    def _input(self, channel: Channel, number: int) -> tuple[str | int, tuple[Any, ...]]:
        """Who gets a message of a channel, and the input that it is."""
        kind, *ends = channel
        message = self._messages.values[number]
        match kind:
            case "lost":
                return "plant", ("lost", message)
            case "command" | "ready":
                return "plant", (kind, ends[0], *message)
            case "announcement":
                return ends[1], (kind, ends[0], *message)
        return ends[0], (kind, message)

    def _timed_out(self, state: State, network: Network, rest: Rest) -> State:
        """The plant has waited for its timeout; nobody who waits for others himself is to be blamed."""
        unresponsive = self._unresponsive(state)
        answering = set(self.plan.names) - set(unresponsive)
        before = self._objects[state[0]].membership.formation.alive
        after = self._applied(state, network, rest, "plant", ("timeout", unresponsive))
        alive = self._objects[after[0]].membership.formation.alive
        for index, name in enumerate(self.plan.names):
            if name in answering and before[index] and not alive[index]:
                raise ViolationError(f"{name} answers, and is counted as lost")
        return after

    def _unresponsive(self, state: State) -> tuple[str, ...]:
        """Names of satellites that publish nothing again: those without a process that flies."""
        slots = state[1 : 1 + self.count]
        return tuple(
            name
            for name, slot in zip(self.plan.names, slots, strict=True)
            if slot < 0 or not self._objects[slot].steps.flying
        )

    def _idle(self, state: State) -> State:
        """Every process publishes its last messages again, since nothing moves."""
        rest = replace(self._rests.values[state[-1]], waiting=self._objects[state[0]].steps.progress)
        state = (*state[:-1], self._rests.number(rest))
        for who in ("plant", *range(self.count)):
            if who != "plant" and state[1 + int(who)] < 0:
                continue
            _, _, messages, _, rest = self._parts(state)
            state = self._applied(state, list(messages), rest, who, ("retransmit",))
        return state

    def _restarted(self, state: State, network: Network, rest: Rest, satellite: int) -> State:
        """A new process of a satellite: it gets the statuses that were published before, and is ready."""
        slots = list(state[: 1 + self.count])
        disk = self._disks.values[-1 - slots[1 + satellite]]
        slots[1 + satellite] = self._number_of(self._satellite_class(self.plan, satellite, disk))
        for status in self._objects[slots[0]].statuses:
            self._put(network, ("status", satellite), status)
        incarnations = list(rest.incarnations)
        incarnations[satellite] += 1
        rest = replace(rest, incarnations=tuple(incarnations))
        state = self._packed(slots, network, state[-2], rest)
        return self._applied(state, network, rest, satellite, ("begin",))

    def _disturbed(
        self, state: State, network: Network, held: tuple[Any, ...], rest: Rest, action: Action
    ) -> State:
        # A disturbed retransmission may be repeated.
        rest = replace(rest, budget=rest.budget - 1, waiting=())
        slots = list(state[: 1 + self.count])
        match action[0]:
            case "delay" | "duplicate":
                item = (action[1], network[action[1]][0])
                if action[0] == "delay":
                    network[action[1]] = network[action[1]][1:]
                ordered = tuple(sorted((*held, item)))
                return self._packed(slots, network, self._held.number(ordered), rest)
            case "kill":
                for place, survivors in action[2]:
                    network[place] = network[place][:survivors]
                return self._dead(slots, network, rest, action[1], state[-2])
            case "silent":
                return self._applied(state, network, rest, "plant", ("silent", action[1]))
            case "graph":
                return self._applied(state, network, rest, "plant", ("graph", self._graphs[action[1]]))
        return self._applied(state, network, rest, "plant", action)

    # Exploration

    def explore(self, limit: int = 10**9) -> Outcome:
        """Visit every reachable state, breadth first, until an invariant does not hold.

        Args:
            limit: of the number of states.
        """
        outcome = Outcome()
        self.parents: dict[State, Any] = {}
        try:
            first = self.start()
        except ViolationError as error:
            outcome.violation = str(error)
            return outcome
        parents: dict[State, tuple[State, Action] | None] = self.parents
        parents[first] = None
        calm: dict[State, State] = {}
        queue = deque([first])
        while queue and not outcome.violation:
            state = queue.popleft()
            if self.over(state):
                outcome.ends += 1
                continue
            try:
                actions = self.actions(state)
                for action in actions:
                    outcome.transitions += 1
                    following = self.after(state, action)
                    if following not in parents:
                        parents[following] = (state, action)
                        queue.append(following)
                    if state not in calm and (len(actions) == 1 or self._goes_on_by(state, action)):
                        calm[state] = following
            except ViolationError as error:
                outcome.violation = str(error)
                outcome.history = [*self._history(parents, state), self.described(action)]
            if len(parents) > limit:
                outcome.complete = False
                break
        stuck = None if outcome.violation or not outcome.complete else self._stuck(parents, calm)
        if stuck is not None:
            outcome.violation = "the flight does not go on, though nothing disturbs it any more"
            outcome.history = self._history(parents, stuck)
        outcome.states, outcome.reactions = len(parents), len(self._reactions)
        return outcome

    def ended_plants(self) -> list[PlantProcess]:
        """The plants of all visited states in which the flight is over."""
        return self.ended_in(self.parents)

    def ended_in(self, states: Iterable[State]) -> list[PlantProcess]:
        """The plants of those states in which the flight is over."""
        return [self._objects[state[0]] for state in states if self.over(state)]

    def _goes_on_by(self, state: State, action: Action) -> bool:
        """Whether an action happens next if nothing disturbs the flight."""
        if action[0] == "restart":
            return action[1] in self._objects[state[0]].membership.awaited
        return action[0] in ("deliver", "resume", "idle", "timeout")

    def _stuck(self, states: Iterable[State], calm: dict[State, State]) -> State | None:
        """A state from which the flight does not end if messages are delivered and nothing else happens."""
        ending: set[State] = set()
        for first in states:
            chain: dict[State, None] = {}
            state = first
            while state not in ending and not self.over(state):
                if state in chain or state not in calm:
                    return first
                chain[state] = None
                state = calm[state]
            ending.update(chain)
        return None

    def _history(self, parents: dict[State, Any], state: State) -> list[str]:
        found: list[str] = []
        step = parents[state]
        while step is not None:
            state, action = step
            found.append(self.described(action))
            step = parents[state]
        return found[::-1]

    def follow(self, history: Iterable[str]) -> State:
        """The state after actions in words, as a history has them.

        Raises:
            ViolationError: an invariant does not hold on the way.
            LookupError: an action is not possible.
        """
        state = self.start()
        for words in history:
            possible = {self.described(action): action for action in self._everything(state)}
            state = self.after(state, possible[words])
        return state

    def walk(self, seed: int, walks: int) -> Outcome:
        """Follow random walks from the start to the end of a flight.

        Args:
            seed: of the random numbers.
            walks: how many.
        """
        numbers = random.Random(seed)
        outcome = Outcome(complete=False)
        visited: set[State] = set()
        history: list[str] = []
        try:
            for _ in range(walks):
                history = []
                state = self.start()
                while not self.over(state):
                    visited.add(state)
                    action = self._drawn(list(self._everything(state)), numbers)
                    history.append(self.described(action))
                    outcome.transitions += 1
                    state = self.after(state, action)
                outcome.ends += 1
        except ViolationError as error:
            outcome.violation, outcome.history = str(error), history
        outcome.states, outcome.reactions = len(visited), len(self._reactions)
        return outcome

    def _drawn(self, possible: list[Action], numbers: random.Random) -> Action:
        """One of the possible actions; a disturbance now and then."""
        calm = [each for each in possible if each[0] in CALM]
        others = [each for each in possible if each[0] not in CALM]
        return numbers.choice(others if others and (not calm or numbers.random() < DISTURBED) else calm)

    def described(self, action: Action) -> str:
        """An action in words."""
        if action[0] in ("deliver", "delay", "duplicate"):
            return f"{action[0]} {self._named(self.channels[action[1]])}"
        if action[0] == "release":
            return f"release {self._named(self.channels[action[1][0]])}"
        if action[0] == "kill":
            kept = ", ".join(f"{count} of {self._named(self.channels[place])}" for place, count in action[2])
            return f"kill {self.plan.names[action[1]]}" + (f" (left: {kept})" if kept else "")
        if action[0] in ("silent", "restart"):
            return f"{action[0]} {self.plan.names[action[1]]}"
        return str(action[0])

    def _named(self, channel: Channel) -> str:
        kind, *ends = channel
        if kind == "announcement":
            return f"announcement {self.plan.names[ends[0]]} to {self.plan.names[ends[1]]}"
        return f"{kind} {self.plan.names[ends[0]]}" if ends else str(kind)


UNORDERED = frozenset({"state", "announcement", "command", "ready"})
"""Kinds of channels whose messages may be lost, overtaken or repeated. Of statuses the protocol takes for
granted what DDS gives: none is lost, they keep their order, and a process that is started later gets them."""

CALM = frozenset({"deliver", "release", "resume", "idle", "timeout"})
"""Kinds of actions that are no disturbance."""

DISTURBED = 0.05
"""Probability with which a random walk is disturbed where it can be."""


def view_of(formation: Formation) -> tuple[Any, ...]:
    """What all nodes have to know alike of a version of the formation."""
    return (
        formation.number,
        formation.step,
        formation.alive.tobytes(),
        formation.graph.adjacency.tobytes(),
        tuple(sorted(formation.lost_at.items())),
        tuple(sorted(formation.rejoined_at.items())),
    )


def writer_of(satellite: int, rest: Rest) -> bytes:
    """Identifier of the writers of a satellite's present process."""
    return b"%d#%d" % (satellite, rest.incarnations[satellite])


def receiver_of(channel: Channel) -> int:
    """Index of the satellite that receives from a channel; -1 for the plant."""
    kind, *ends = channel
    if kind == "announcement":
        return int(ends[1])
    return int(ends[0]) if kind in ("state", "status") else -1
