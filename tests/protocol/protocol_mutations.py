# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Deliberate faults of the protocol, each of which the explorer has to find."""

from collections.abc import Callable
from typing import Any

from protocol_processes import PlantProcess, SatelliteProcess

from satform.membership.formation import SatelliteLost, SatelliteRejoined, TopologyChanged
from satform.membership.membership_manager import Loss, MembershipManager
from satform.protocol.formation_view import FormationView
from satform.protocol.neighbour_messages import NeighbourMessages
from satform.protocol.plant_commands import PlantCommands
from satform.protocol.plant_steps import PlantSteps
from satform.protocol.satellite_steps import SatelliteSteps
from satform.protocol.step_messages import StepMessages
from satform_nodes.satellite.publishers import SatellitePublishers

Patch = tuple[type, str, Any]
"""A class, the name of one of its attributes, and what takes its place."""

MUTATIONS: dict[str, Callable[[], list[Patch]]] = {}
"""The faults by what is wrong with them."""


def mutation(sentence: str) -> Callable[[Callable[[], list[Patch]]], Callable[[], list[Patch]]]:
    """Register a fault under a sentence."""

    def register(make: Callable[[], list[Patch]]) -> Callable[[], list[Patch]]:
        MUTATIONS[sentence] = make
        return make

    return register


@mutation("a satellite does not wait for the status of a state's version")
def _no_version_check() -> list[Patch]:
    return [(SatelliteSteps, "_knows", lambda _self, _number: True)]


@mutation("a neighbour forgets the final announcement of a lost satellite")
def _no_final_commands() -> list[Patch]:
    def forget(self: NeighbourMessages, step: int, received: dict[int, Any]) -> None:
        self.by_step[step] = received

    return [(NeighbourMessages, "add_final_commands", forget)]


@mutation("a neighbour does not use the final announcement of a lost satellite")
def _final_not_used() -> list[Patch]:
    def used(self: FormationView, satellite: int, step: int) -> bool:
        formation = self.formation
        return bool(formation.alive[satellite]) and formation.rejoined_at.get(satellite, -1) < step

    return [(FormationView, "is_used_by_neighbours", used)]


@mutation("the plant takes a late command for one of the present step")
def _late_command() -> list[Patch]:
    take = PlantCommands.take

    def late(self: PlantCommands, satellite: int, data: bytes) -> bool:
        if take(self, satellite, data):
            return True
        membership = self._membership
        numbers = self._form.unpack(data)
        if numbers is None or numbers[2] != membership.step - 1 or not membership.formation.alive[satellite]:
            return False
        if membership.open or satellite in membership.commanded:
            return False
        self.values[satellite] = numbers[3:9]
        membership.record_command(satellite)
        return True

    return [(PlantCommands, "take", late)]


@mutation("the plant goes on to apply the command of a lost satellite")
def _lost_applied() -> list[Patch]:
    return [(PlantCommands, "change", lambda _self, _change: None)]


@mutation("the plant takes commands of a lost satellite")
def _lost_commands() -> list[Patch]:
    take = PlantCommands.take

    def any_take(self: PlantCommands, satellite: int, data: bytes) -> bool:
        alive = self._membership.formation.alive
        own, alive[satellite] = alive[satellite], True
        taken = take(self, satellite, data)
        alive[satellite] = own
        return taken

    return [(PlantCommands, "take", any_take)]


@mutation("a rejoined satellite does not go on from its checkpoint")
def _no_restore() -> list[Patch]:
    from protocol_processes import Checkpoint

    return [(Checkpoint, "restore", lambda _self, _satellite, _neighbours: None)]


@mutation("a checkpoint counts though the command before it has not arrived")
def _unflown_checkpoint() -> list[Patch]:
    accept = MembershipManager._accept_rejoin

    def any_checkpoint(self: MembershipManager, satellite: int, checkpoint: int) -> None:
        self._flown[satellite].append((-1, checkpoint))
        accept(self, satellite, checkpoint)

    return [(MembershipManager, "_accept_rejoin", any_checkpoint)]


@mutation("a satellite rejoins at whatever state comes first")
def _any_join() -> list[Patch]:
    join = SatelliteSteps.join

    def early(self: SatelliteSteps, step: int) -> bool:
        own = self._index
        if own not in self.view.returns and step:
            self.view.returns[own] = (step, -1)
            done = join(self, step)
            del self.view.returns[own]
            return done
        return join(self, step)

    return [(SatelliteSteps, "join", early)]


@mutation("a message for the next step counts for the present one")
def _mixed_steps() -> list[Patch]:
    complete = StepMessages.complete

    def mixed(self: StepMessages, step: int) -> Any:
        messages = self._neighbours.by_step
        for neighbour, message in messages.get(step + 1, {}).items():
            messages.setdefault(step, {})[neighbour] = message
        return complete(self, step)

    return [(StepMessages, "complete", mixed)]


@mutation("a satellite acts without the messages of all neighbours")
def _no_waiting() -> list[Patch]:
    def impatient(self: StepMessages, step: int) -> Any:
        messages = self._neighbours.by_step.get(step, {})
        senders = [each for each in self._neighbours.senders(step) if each in messages]
        return None if self._lacks_plant(step) else (messages, senders)

    return [(StepMessages, "complete", impatient)]


@mutation("a satellite acts once more at a repeated state")
def _acts_twice() -> list[Patch]:
    act = SatelliteSteps._act

    def again(self: SatelliteSteps, step: int, *given: Any) -> None:
        kept = dict(self.neighbour_messages.by_step)
        act(self, step, *given)
        self.step = step
        self.neighbour_messages.by_step.update(kept)

    return [(SatelliteSteps, "_act", again)]


@mutation("the plant does not wait for the last command")
def _one_missing() -> list[Patch]:
    return [
        (
            MembershipManager,
            "complete",
            property(lambda self: len(self.commanded) >= max(1, self._present - 1)),
        )
    ]


@mutation("the plant does not publish a state again")
def _no_state_again() -> list[Patch]:
    return [(PlantSteps, "retransmit", lambda self: self._output.republish_status())]


@mutation("a satellite publishes nothing again")
def _no_retransmission() -> list[Patch]:
    return [(SatellitePublishers, "retransmit", lambda _self: None)]


@mutation("a satellite publishes its command again, but not its message")
def _only_command_again() -> list[Patch]:
    def command_only(self: SatellitePublishers) -> None:
        if self._last_command:
            self._command_publisher.publish(self._last_command)

    return [(SatellitePublishers, "retransmit", command_only)]


@mutation("a changed graph takes effect within the step")
def _graph_at_once() -> list[Patch]:
    schedule = MembershipManager.schedule

    def at_once(self: MembershipManager, event: Any) -> int:
        if isinstance(event, TopologyChanged) and not self.open:
            self.formation.apply([event], self.step, self.names)
            return self.step
        return schedule(self, event)

    return [(MembershipManager, "schedule", at_once)]


@mutation("a satellite that has commanded is lost at once")
def _lost_at_once() -> list[Patch]:
    def at_once(self: MembershipManager, satellite: int, reason: str) -> Loss:
        if not self.formation.alive[satellite]:
            return Loss()
        if self.step == 0:
            return Loss(end=reason)
        change = self._apply([SatelliteLost(satellite, reason)])
        return Loss(change, "" if self._present else reason)

    final = PlantCommands.final_command

    def newest(self: PlantCommands, satellite: int) -> bytes | None:
        last = self._last.get(satellite)
        return final(self, satellite) if last is None else last[1]

    return [(MembershipManager, "lose", at_once), (PlantCommands, "final_command", newest)]


@mutation("a satellite that waits for the last message of a lost one is blamed")
def _blamed() -> list[Patch]:
    return [(MembershipManager, "about_to_be_lost", property(lambda _self: []))]


@mutation("the first message of a rejoined satellite is used at once")
def _used_at_once() -> list[Patch]:
    def used(self: FormationView, satellite: int, step: int) -> bool:
        formation = self.formation
        return bool(formation.alive[satellite]) or formation.lost_at.get(satellite) == step

    return [(FormationView, "is_used_by_neighbours", used)]


@mutation("commands of the step before still count")
def _not_cleared() -> list[Patch]:
    begin = MembershipManager.begin

    def keep(self: MembershipManager, step: int) -> Any:
        kept = set(self.commanded)
        change = begin(self, step)
        self.commanded.update(kept)
        return change

    return [(MembershipManager, "begin", keep)]


@mutation("the plant waits for a satellite that is lost")
def _waits_for_lost() -> list[Patch]:
    apply = MembershipManager._apply

    def all_present(self: MembershipManager, events: Any) -> Any:
        before = self._present
        change = apply(self, events)
        self._present = before
        return change

    return [(MembershipManager, "_apply", all_present)]


@mutation("a neighbour does not accept the new process of a satellite")
def _no_replacement() -> list[Patch]:
    return [(SatelliteProcess, "allow_replacement", lambda _self, _lost: None)]


@mutation("the plant reads the end of a former process after the offer of the present one")
def _read_late() -> list[Patch]:
    return [(PlantProcess, "read_loss_reports", lambda _self: None)]


@mutation("the plant waits for ever")
def _no_timeout() -> list[Patch]:
    return [(PlantSteps, "end_waiting", lambda _self, *_given: None)]


@mutation("a satellite flies on though it is lost")
def _flies_on() -> list[Patch]:
    return [(SatelliteSteps, "_on_own_loss", lambda _self, **_given: None)]


@mutation("a satellite comes back within a step")
def _back_at_once() -> list[Patch]:
    request = MembershipManager.request_rejoin

    def at_once(self: MembershipManager, satellite: int, checkpoint: int) -> None:
        if self.formation.alive[satellite] or self.open:
            request(self, satellite, checkpoint)
        else:
            self._apply([SatelliteRejoined(satellite, None)])

    return [(MembershipManager, "request_rejoin", at_once)]
