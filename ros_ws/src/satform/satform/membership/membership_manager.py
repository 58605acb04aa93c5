# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Membership of a formation by step: satellites lost and rejoined, commands received, rejoins awaited.

The manager decides at which step an event takes effect; `Formation.apply` in `formation` changes the
formation. It changes only where the satellites can all learn of it before they act. A step is *open* from
its beginning until its states are published: until then its formation can still change. After that a loss
takes effect at once only if the satellite has not commanded yet; everything else waits for the next step.
The plant's flight loop (`satform_nodes.plant.flight_loop`) detects that a satellite does not answer within
its timeout. The supervisor reports the end of a satellite's process, and restarts it.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from satform.membership.formation import (
    Event,
    Formation,
    MembershipPlan,
    SatelliteLost,
    SatelliteRejoined,
    rejoins_after,
)
from satform.membership.reconfiguration import Target, TargetsChanged

ALL_LOST = "no satellite is left"
"""How the reason of a flight ends that has lost its last satellite."""


@dataclass(frozen=True)
class Change:
    """The formation is another one from the present step on, which every node has to receive.

    Attributes:
        lost: indices of the satellites that no longer take part.
        rejoined: those that take part again.
    """

    lost: tuple[int, ...]
    rejoined: tuple[SatelliteRejoined, ...]


@dataclass(frozen=True)
class Loss:
    """What the loss of a satellite comes to.

    Attributes:
        change: of the formation at the present step; None when there is none, or not before the next step.
        end: why the flight cannot go on; empty when it can.
    """

    change: Change | None = None
    end: str = ""


class MembershipManager:
    """Checks at each step that every member has commanded, and decides when the formation changes.

    Attributes:
        formation: present membership and communication graph.
        names: of the satellites.
        everyone: names of all that have to be ready before the flight.
        step: the present one.
        open: whether the states of the present step are still to be published.
        commanded: indices of those that have commanded in the present step.
        awaited: those that the scenario brings back at the present step, by their indices.
    """

    def __init__(
        self, plan: MembershipPlan, watchers: Collection[str] = (), *, lockstep: bool = True
    ) -> None:
        """A formation of which every satellite takes part and no node is ready yet.

        Args:
            plan: what the scenario plans.
            watchers: names of those that have to be ready too, though they do not fly.
            lockstep: whether a step waits for the commands of all; on the wall clock it does not.
        """
        self.formation = Formation.of(plan)
        self.names = list(plan.names)
        self.everyone = frozenset({*self.names, *watchers})
        self.step = 0
        self.open = False
        self.commanded: set[int] = set()
        self.awaited: dict[int, SatelliteRejoined] = {}
        self._lockstep = lockstep
        self._last_step = plan.steps
        self._plan = plan.events
        self._present = len(self.names)
        self._ready: set[str] = set()
        self._pending: list[Event] = []
        # Those that could come back, with the step of their checkpoints, and those that announced it before
        # their loss has taken effect.
        self._returning: dict[int, int] = {}
        self._early: dict[int, int] = {}
        # By the index of a satellite, from where to where it has flown: the step at which it came back, or -1
        # for the start, and that of the loss after it, the first one without its command.
        self._flown: dict[int, list[tuple[int, int]]] = {}

    # Before the flight

    def note_ready(self, name: str) -> None:
        """Note that a node is ready."""
        self._ready.add(name)

    @property
    def unready(self) -> list[str]:
        """Names of the nodes that are not ready yet, in alphabetical order."""
        return sorted(self.everyone - self._ready)

    # Steps

    def begin(self, step: int) -> Change | None:
        """Begin a step; what the scenario changes at it, but for returns, which are waited for.

        Args:
            step: its number.

        Returns:
            The change, if there is one.
        """
        self.step = step
        self.commanded.clear()
        events = self._plan.get(step, [])
        change = self._apply([event for event in events if not isinstance(event, SatelliteRejoined)])
        self.awaited = {event.satellite: event for event in events if isinstance(event, SatelliteRejoined)}
        self.open = True
        return change

    @property
    def rejoins_ready(self) -> bool:
        """Whether all whom the scenario brings back at this step could take part again."""
        return self.awaited.keys() <= self._returning.keys()

    def close(self) -> Change | None:
        """Apply the events that are due, rejoining included: the states of this step are published now.

        Returns:
            The change, if there is one.
        """
        due = [*map(self._as_it_can_be, self.awaited.values()), *self._pending]
        self.awaited, self._pending = {}, []
        change = self._apply(due)
        self.open = False
        return change

    @property
    def is_empty(self) -> bool:
        """Whether no satellite takes part any more, and none is about to."""
        return not self._present and not any(isinstance(event, SatelliteRejoined) for event in self._pending)

    def record_command(self, satellite: int) -> None:
        """Note that a satellite that flies has commanded in this step."""
        self.commanded.add(satellite)

    def record_commands(self, satellites: Iterable[int]) -> None:
        """Note that some satellites that fly have commanded in this step."""
        self.commanded.update(satellites)

    @property
    def complete(self) -> bool:
        """Whether all that fly have commanded in this step."""
        return len(self.commanded) == self._present

    @property
    def not_commanded(self) -> list[int]:
        """Indices of those that fly and have not commanded in this step, ascending."""
        return [satellite for satellite in self.flying if satellite not in self.commanded]

    @property
    def missing(self) -> list[str]:
        """Names of the satellites that keep the step from going on."""
        if self.awaited:
            return [self.names[satellite] for satellite in self.awaited]
        if self.open or self.step == self._last_step:
            return []
        return [self.names[satellite] for satellite in self.not_commanded]

    @property
    def next_step(self) -> int:
        """The first step in which something that happens now can take effect."""
        return self.step if self.open else self.step + 1

    @property
    def next_targets(self) -> Mapping[int, Target]:
        """Targets in force at the next step, those planned or scheduled for it included.

        By the indices of the satellites whose target is not that of the scenario's start.
        """
        planned = [] if self.open else self._plan.get(self.next_step, [])
        targets: Mapping[int, Target] = self.formation.targets
        for event in (*planned, *self._pending):
            if isinstance(event, TargetsChanged):
                targets = event.applied(targets, self.next_step)
        return targets

    @property
    def over(self) -> bool:
        """Whether the states after the last step have been published."""
        return self.step == self._last_step and not self.open

    @property
    def last_step_taken(self) -> bool:
        """Whether no step follows in which something could take effect."""
        return self.next_step >= self._last_step

    # Losses, returns and other graphs

    @property
    def flying(self) -> list[int]:
        """Indices of the satellites that take part, ascending."""
        indices: list[int] = np.flatnonzero(self.formation.alive).tolist()
        return indices

    @property
    def lost(self) -> list[int]:
        """Indices of those that do not, ascending."""
        indices: list[int] = np.flatnonzero(~self.formation.alive).tolist()
        return indices

    def lose(self, satellite: int, reason: str) -> Loss:
        """Go on without a satellite.

        Args:
            satellite: its index.
            reason: in words.

        Returns:
            What comes of it now; nothing when it takes effect at the next step.
        """
        # It may have been started anew before an earlier loss took effect, and have died again.
        self._early.pop(satellite, None)
        if not self.formation.alive[satellite]:
            # It may have been about to come back.
            self._cancel_rejoin(satellite)
            return Loss()
        if satellite in self.commanded:
            # It has had its part in this step; from the next one on it is lost.
            if not self._is_lost_next(satellite):
                self._pending.append(SatelliteLost(satellite, reason))
            return Loss()
        if self.step == 0 and self._lockstep:
            return Loss(end=f"{reason}, before its first command")
        change = self._apply([SatelliteLost(satellite, reason)])
        return Loss(change, "" if self._present else f"{reason}; {ALL_LOST}")

    @property
    def about_to_be_lost(self) -> list[int]:
        """Indices of those that have commanded in this step and are lost from the next one on."""
        return [event.satellite for event in self._pending if isinstance(event, SatelliteLost)]

    def lose_now(self) -> Loss:
        """Let losses of the next step take effect at the present one, whose commands are dropped.

        A satellite may have commanded and ended before its message for this step had reached all neighbours,
        which then wait for it in vain.

        Returns:
            What comes of it; nothing when no satellite is about to be lost.
        """
        due = [event for event in self._pending if isinstance(event, SatelliteLost)]
        if not due:
            return Loss()
        reason = "; ".join(event.reason for event in due)
        if self.step == 0 and self._lockstep:
            return Loss(end=f"{reason}, before its first message had reached all neighbours")
        self._pending = [event for event in self._pending if event not in due]
        return Loss(self._apply(due), "" if self._present else f"{reason}; {ALL_LOST}")

    def request_rejoin(self, satellite: int, checkpoint: int) -> None:
        """Note that a satellite, started anew, could take part from the next step on.

        Args:
            satellite: its index.
            checkpoint: step of the checkpoint that it has; -1 when it knows its flight plan only.
        """
        if not self.formation.alive[satellite]:
            self._accept_rejoin(satellite, checkpoint)
        elif self._is_lost_next(satellite):
            # It is back before its loss has taken effect.
            self._early[satellite] = checkpoint

    def schedule(self, event: Event) -> int:
        """Have something happen at the next step; the step's number."""
        self._pending.append(event)
        return self.next_step

    def _as_it_can_be(self, planned_return: SatelliteRejoined) -> SatelliteRejoined:
        """A planned return with the checkpoint that there is, where the scenario has one be used."""
        checkpoint = self._returning[planned_return.satellite]
        if planned_return.checkpoint is None:
            return planned_return
        return replace(planned_return, checkpoint=checkpoint if checkpoint >= 0 else None)

    def _is_lost_next(self, satellite: int) -> bool:
        return any(
            isinstance(event, SatelliteLost) and event.satellite == satellite for event in self._pending
        )

    def _cancel_rejoin(self, satellite: int) -> None:
        self._returning.pop(satellite, None)
        self._pending = [
            event
            for event in self._pending
            if not (isinstance(event, SatelliteRejoined) and event.satellite == satellite)
        ]

    def _accept_rejoin(self, satellite: int, checkpoint: int) -> None:
        self._cancel_rejoin(satellite)
        if not any(since < checkpoint <= until for since, until in self._flown[satellite]):
            # It was stored after a command that the plant has not received: no step of the flight.
            checkpoint = -1
        self._returning[satellite] = checkpoint
        if satellite not in self.awaited and not rejoins_after(self._plan, satellite, self.step + 1):
            self._pending.append(SatelliteRejoined(satellite, checkpoint if checkpoint >= 0 else None))

    def _apply(self, events: Sequence[Event]) -> Change | None:
        """Change the formation at the present step."""
        changes = self.formation.apply(events, self.step, self.names)
        if not changes:
            return None
        self._present = int(np.count_nonzero(self.formation.alive))
        lost = tuple(event.satellite for event in changes if isinstance(event, SatelliteLost))
        rejoined = tuple(event for event in changes if isinstance(event, SatelliteRejoined))
        for satellite in lost:
            self.commanded.discard(satellite)
            since = self.formation.rejoined_at.get(satellite, -1)
            self._flown.setdefault(satellite, []).append((since, self.step))
            if satellite in self._early:
                self._accept_rejoin(satellite, self._early.pop(satellite))
        for event in rejoined:
            self._returning.pop(event.satellite, None)
        return Change(lost, rejoined)
