# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the steps of a satellite ask of the node that carries them: to publish, and to store checkpoints."""

from collections.abc import Collection, Sequence
from typing import Protocol

from satform.flight.limits import Violation
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.membership.reconfiguration import Target
from satform.numeric.elementwise import Array

StampedMessage = tuple[tuple[int, int], list[float]]
"""Stamp and numbers of a neighbour message."""


class Checkpoints(Protocol):
    """Where a satellite keeps its last checkpoint.

    Attributes:
        step: of the checkpoint that was found at the start; -1 when there was none.
    """

    step: int

    def load(self) -> None:
        """Read the last checkpoint."""

    def restore(self, satellite: Satellite, neighbours: Sequence[int]) -> None:
        """Put a satellite with these in-neighbours into the state of the checkpoint."""

    def due(self, step: int) -> bool:
        """Whether a checkpoint is to be written before a step."""

    def keep(self, satellite: Satellite, neighbours: Sequence[int]) -> None:
        """Write a checkpoint if one is due at the satellite's step."""


class SatelliteOutput(Protocol):
    """What the steps of a satellite ask of the node that carries them."""

    def publish_command(self, step: int, decision: Decision, message: StampedMessage) -> None:
        """Publish the command of a step, with a copy of the neighbour message for the next one."""

    def publish_command_numbers(
        self, step: int, acceleration: Sequence[float], message: StampedMessage
    ) -> None:
        """As `publish_command`, of a satellite that commands an acceleration alone, m/s^2, three numbers."""

    def publish_violation(self, step: int, violation: Violation) -> None:
        """Publish a command of zero for a step, with what was beyond its limit."""

    def publish_next(self, step: int, message: StampedMessage) -> None:
        """Publish the neighbour message for a step."""

    def publish_joint_estimate(self, step: int, numbers: Array) -> None:
        """Publish the estimate of the whole formation that goes with the neighbour message for a step."""

    def publish_tracking(self, step: int, decision: Decision) -> None:
        """Publish reference, tracking error and estimates of a step."""

    def publish_tracking_numbers(self, step: int, numbers: Sequence[float]) -> None:
        """As `publish_tracking`, from 18 numbers.

        Args:
            step: its number.
            numbers: position, velocity and acceleration of the reference, errors of position and velocity,
                sliding variable.
        """

    def publish_changes(self, step: int) -> None:
        """Publish the parameters that have changed at a step."""

    def publish_ready(self) -> None:
        """Publish that this satellite is ready, and the checkpoint from which it would continue."""

    def forget_messages(self) -> None:
        """Do not retransmit what was published last: the satellite is lost."""

    def await_status(self) -> None:
        """A status is on its way, without which the step cannot go on."""

    def lost(self, step: int, *, planned: bool) -> None:
        """This satellite, which flies, is lost from a step on.

        Does not return if its process ends because of that.
        """

    def allow_replacement(self, lost: Collection[int]) -> None:
        """Accept restarted processes of satellites that have just been lost as publishers."""

    def add_neighbour(self, neighbour: int) -> None:
        """Subscribe to the messages of a neighbour."""

    def retarget(self, satellite: Satellite, target: Target) -> None:
        """Have the flight software fly by a target."""

    def reset_parameters(self) -> None:
        """Have the specifications of the scenario in force again."""

    def may_have_begun_here(self, step: int) -> bool:
        """On the wall clock: whether a flight that has come to a step can have begun with this process."""

    def require_lost(self, step: int, version: int, *, alive: bool, known_version: int) -> None:
        """Look whether another process flies this satellite, since a state came that is not for this one.

        Args:
            step: whose state has come.
            version: of the formation for which the state was published.
            alive: whether the satellite takes part by the plant's last status.
            known_version: of the formation in the plant's last status.
        """
