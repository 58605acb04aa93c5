# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""States of a flight, what each action leads to by the reactions of the processes, and the invariants.

A state is that of the plant, of the satellites, of their checkpoints and of the messages between them. The
reaction of a process to an input is computed by the process itself, once for each of its states and each
input, and remembered.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from protocol_processes import Event, PlantProcess, ProcessEndedError, SatelliteProcess
from protocol_snapshots import clone, digest
from rclpy.serialization import deserialize_message
from satform_msgs.msg import FormationStatus

from satform.consensus.graph import Graph
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.simulate import simulate
from satform.membership.absence_log import happened
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

KINDS = ("lost", "status", "ready", "state", "announcement", "command")
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


class Transitions:
    """States of the flights of one scenario, and what the actions in them lead to."""

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
        return sorted(found, key=lambda channel: (KINDS.index(channel[0]), channel[1:]))

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
            if given[0] == "lost":
                self._check_report(self._objects[process], one, *given[1:])
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

    def _check_report(self, before: PlantProcess, after: PlantProcess, satellite: int, writer: bytes) -> None:
        """The end of a former process counts neither against the present one nor against its offer."""
        if before.ready_writers.name_of(writer) is None:
            return
        was, now = before.membership, after.membership
        alive = bool(was.formation.alive[satellite]) and satellite not in was.about_to_be_lost
        still = bool(now.formation.alive[satellite]) and satellite not in now.about_to_be_lost
        offered = satellite in was._returning
        if (alive and not still) or (offered and not still and satellite not in now._returning):
            name = self.plan.names[satellite]
            raise ViolationError(f"the end of a former process of {name} counts against the present one")

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
                case "reports read":
                    network[self._channel_index["lost",]] = ()
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
        who, given = self._input(state, network, rest, channel, number)
        return self._applied(state, network, rest, who, given)

    def _input(
        self, state: State, network: Sequence[tuple[int, ...]], rest: Rest, channel: Channel, number: int
    ) -> tuple[str | int, tuple[Any, ...]]:
        """Who gets a message of a channel, and the input that it is."""
        kind, *ends = channel
        message = self._messages.values[number]
        match kind:
            case "lost":
                return "plant", ("lost", message, b"" if state[1 + message] < 0 else writer_of(message, rest))
            case "ready":
                reports = network[self._channel_index["lost",]]
                return "plant", (
                    kind,
                    ends[0],
                    *message,
                    tuple(map(self._messages.values.__getitem__, reports)),
                )
            case "command":
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
