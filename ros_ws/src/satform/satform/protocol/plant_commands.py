# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that the plant has received: which of them count for the present step, and what they say."""

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from satform.communication.cdr_layout import Layout
from satform.communication.message_validator import MessageValidator, RejectionCounter
from satform.communication.topic_table import topic_name
from satform.flight.limits import QUANTITIES, Violation
from satform.membership.membership_manager import Change, MembershipManager
from satform.numeric.elementwise import Array

_ACCELERATION_AND_TORQUE = slice(3, 9)
"""Where a command message has what the plant needs."""


class CommandTiming(Protocol):
    """When commands arrive on the wall clock, and which are missing."""

    def begin(self) -> None:
        """Start all satellites' timeouts now."""

    def restart_timeout(self, satellite: int) -> None:
        """Restart a satellite's timeout."""

    def first_due(self, satellite: int) -> int:
        """The first step for which a satellite has not commanded yet."""

    def note(self, satellite: int, step: int, now: int) -> None:
        """Note that a command for a step came in at the present step."""

    def count_missing(self, satellites: Iterable[int], step: int, tolerated: float) -> list[int]:
        """Count the commands that are missing as a step is taken; the satellites that have timed out."""

    def expired(self, satellites: Iterable[int], step: int, held: int) -> list[int]:
        """Count and return those whose newest command is too old to be held on."""


class StepCommands(Protocol):
    """The commands of the present step, however they are received.

    Attributes:
        values: acceleration and wheel torque of each satellite, m/s^2 and N m, shape (N, 6).
        violations: violations of limits that satellites reported for the present step, by their indices.
        timing: of commands on the wall clock.
    """

    values: Array
    violations: dict[int, Violation]
    timing: CommandTiming

    def take(self, sender: int, data: bytes) -> bool:
        """Take in a command message of a satellite, or of a group of them; whether it is used."""

    def change(self, change: Change) -> None:
        """Apply a change of membership."""

    def final_command(self, satellite: int) -> bytes | None:
        """The last command of a satellite before the present step; None when there is none."""

    def announced_arc_length(self, satellite: int) -> float | None:
        """The phase in the last command of a satellite, m; None when there is none."""


class PlantCommands:
    """The commands of all satellites for the present step.

    Attributes:
        values: acceleration and wheel torque of each satellite, m/s^2 and N m, shape (N, 6).
        violations: violations of limits that satellites reported for the present step, by their indices.
        timing: of commands on the wall clock.
    """

    def __init__(
        self,
        membership: MembershipManager,
        form: Layout,
        validators: Sequence[MessageValidator],
        rejections: RejectionCounter,
        timing: CommandTiming,
        *,
        clocked: bool,
    ) -> None:
        """Nothing has been received yet.

        Args:
            membership: is updated with each command, and knows which commands are missing.
            form: of a command message.
            validators: of the commands of each satellite.
            rejections: counts rejected messages.
            timing: of commands on the wall clock.
            clocked: whether the flight goes by the wall clock.
        """
        self.values = np.zeros((len(membership.names), 6))
        self.violations: dict[int, Violation] = {}
        self.timing = timing
        self._membership = membership
        self._form = form
        self._validators = list(validators)
        self._rejections = rejections
        self._clocked = clocked
        # The last command of each satellite and the one before, each with its step.
        self._last: dict[int, tuple[int, bytes]] = {}
        self._before: dict[int, tuple[int, bytes]] = {}
        self._arc_length = form.fields.index("announced_arc_length")
        self._violation = form.fields.index("violation")
        self._value = form.fields.index("violating_value")

    def take(self, satellite: int, data: bytes) -> bool:
        """Take in a command message; whether it is used.

        Args:
            satellite: index of the one whose node has published it.
            data: the message.
        """
        membership = self._membership
        if not membership.formation.alive[satellite]:
            return False
        step = membership.step
        first = self.timing.first_due(satellite) if self._clocked else step
        numbers = self._validators[satellite].validate(data, first, step)
        if numbers is None or satellite in membership.commanded or membership.open:
            return False
        if numbers[self._violation] > len(QUANTITIES):
            topic = topic_name("command", membership.names[satellite])
            self._rejections.add(topic, "a violation of an unknown quantity")
            return False
        if self._clocked:
            self.timing.note(satellite, int(numbers[2]), step)
        if numbers[self._violation]:
            quantity, value = int(numbers[self._violation]), float(numbers[self._value])
            self.violations[satellite] = Violation(quantity, value)
        self.values[satellite] = numbers[_ACCELERATION_AND_TORQUE]
        if satellite in self._last:
            self._before[satellite] = self._last[satellite]
        self._last[satellite] = int(numbers[2]), data
        if numbers[2] == step:
            membership.record_command(satellite)
        return True

    def change(self, change: Change) -> None:
        """Apply a change of membership: use only the commands of the satellites that fly."""
        for satellite in change.lost:
            self.values[satellite] = 0.0
            self.violations.pop(satellite, None)
        for event in change.rejoined:
            if self._membership.formation.lost_at.get(event.satellite) != self._membership.step:
                # A command from before the loss is not its final command after the rejoin.
                self._last.pop(event.satellite, None)
                self._before.pop(event.satellite, None)
            self.timing.restart_timeout(event.satellite)

    def final_command(self, satellite: int) -> bytes | None:
        """The last command of a satellite since it joined, of a step before the present one.

        With it the satellite has sent its message for the present step. None when there is none.
        """
        last = self._last.get(satellite)
        if last is not None and last[0] == self._membership.step and not self._clocked:
            last = self._before.get(satellite)
        return None if last is None else last[1]

    def announced_arc_length(self, satellite: int) -> float | None:
        """The phase in the last command of a satellite, m; None when it has not commanded since it joined."""
        last = self._last.get(satellite)
        numbers: tuple[Any, ...] | None = self._form.unpack(last[1]) if last else None
        return None if numbers is None else float(numbers[self._arc_length])
