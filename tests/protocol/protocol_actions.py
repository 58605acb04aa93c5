# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which actions are possible in a state of a flight, and which of their orders lead to the same."""

import itertools
from collections.abc import Iterator
from typing import Any

from protocol_processes import COMMAND, PHASE, STATE, PlantProcess
from protocol_transitions import Action, Channel, Rest, State, Transitions, ViolationError
from rclpy.serialization import deserialize_message
from satform_msgs.msg import FormationStatus

UNORDERED = frozenset({"state", "announcement", "command", "ready"})
"""Kinds of channels whose messages may be lost, overtaken or repeated. Of statuses the protocol takes for
granted what DDS gives: none is lost, they keep their order, and a process that is started later gets them."""


class Actions(Transitions):
    """Adds to the states what may happen in them."""

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
            who, given = self._input(state, network, rest, self.channels[item[0]], item[1])
            if self._changes_nothing(state, who, self.channels[item[0]][0], given):
                return [("release", item)]
        for place, messages in enumerate(network):
            channel = self.channels[place]
            if not messages or channel[0] in ("lost", "ready"):
                continue
            who, given = self._input(state, network, rest, channel, messages[0])
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
        try:
            after, events, why = self._react(before, given)
            if events or why or after == before or not self._commutes(state, who, before, given):
                return False
        except ViolationError:
            # It is found where this order is followed.
            return False
        kind, *ends = channel
        if kind in ("announcement", "command") and self._may_be_dropped(ends[0], satellites, rest):
            return False
        return kind != "command" or (
            satellites[ends[0]] >= 0 and not self._is_reported_lost(ends[0], network)
        )

    def _commutes(self, state: State, who: str | int, process: int, given: tuple[Any, ...]) -> bool:
        """Whether a message may come before and after each other one that is on its way to its receiver."""
        _, _, network, held, rest = self._parts(state)
        others = [(place, messages[0]) for place, messages in enumerate(network) if messages]
        for place, number in (*others, *held):
            receiver, other = self._input(state, network, rest, self.channels[place], number)
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
