# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that the plant has received as arrays, one from each group of satellites."""

from collections.abc import Sequence

import numpy as np

from satform.communication.array_validator import ArrayValidator
from satform.communication.message_validator import RejectionCounter
from satform.communication.satellite_groups import SatelliteGroups
from satform.communication.topic_table import topic_name
from satform.flight.limits import QUANTITIES, Violation
from satform.membership.membership_manager import Change, MembershipManager
from satform.protocol.plant_commands import CommandTiming


class GroupCommands:
    """The commands of all satellites for the present step.

    Groups neither lose satellites nor take them back: the loss of a process ends the flight.

    Attributes:
        values: acceleration of each satellite, m/s^2, and zeros for the wheels, shape (N, 6).
        violations: violations of limits that satellites reported for the present step, by their indices.
        timing: of commands on the wall clock, which lockstep does without.
        commanded: indices of the groups that have commanded in the present step.
    """

    def __init__(
        self,
        membership: MembershipManager,
        groups: SatelliteGroups,
        validators: Sequence[ArrayValidator],
        rejections: RejectionCounter,
        timing: CommandTiming,
    ) -> None:
        """Nothing has been received yet.

        Args:
            membership: is updated with each message, and knows which commands are missing.
            groups: of the satellites.
            validators: of the commands of each group.
            rejections: counts rejected messages.
            timing: of commands on the wall clock.
        """
        self.values = np.zeros((len(membership.names), 6))
        self.violations: dict[int, Violation] = {}
        self.timing = timing
        self._membership = membership
        self._groups = groups
        self._rows = groups.rows
        self._validators = list(validators)
        self._rejections = rejections
        self._commanded: tuple[int, set[int]] = (-1, set())

    @property
    def missing(self) -> list[int]:
        """Groups that have not commanded in the present step, ascending; none while there is no such step."""
        membership = self._membership
        if membership.open or membership.over:
            return []
        step, commanded = self._commanded
        there = commanded if step == membership.step else set()
        return [index for index in range(len(self._rows)) if index not in there]

    def take(self, sender: int, data: bytes) -> bool:
        """Take in a command message; whether it is used.

        Args:
            sender: index of the group whose node has published it.
            data: the message.
        """
        membership, step = self._membership, self._membership.step
        message = self._validators[sender].validate(data, step, step)
        if message is None or sender not in self.missing:
            return False
        fields, members = message.fields, self._groups.members[sender]
        violation, row = int(fields["violation"]), int(fields["violating_satellite"])
        if violation > len(QUANTITIES) or row >= len(members):
            topic = topic_name("group_command", self._groups.names[sender])
            self._rejections.add(topic, "a violation of an unknown quantity or satellite")
            return False
        if violation:
            self.violations[members[row]] = Violation(violation, float(fields["violating_value"]))
        self.values[self._rows[sender], :3] = fields["acceleration"].reshape(-1, 3)
        if self._commanded[0] != step:
            self._commanded = (step, set())
        self._commanded[1].add(sender)
        membership.record_commands(members)
        return True

    def change(self, change: Change) -> None:
        """No satellite leaves or joins a flight of groups."""

    def final_command(self, satellite: int) -> bytes | None:
        """No command of a group is of a single satellite."""
        return None

    def announced_arc_length(self, satellite: int) -> float | None:
        """No phase is asked for: groups get no new targets."""
        return None
