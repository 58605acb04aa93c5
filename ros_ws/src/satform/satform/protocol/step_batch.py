# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Protocol of what computes the steps of several satellites together, as seen by a satellite's node."""

from typing import Any, Protocol

from satform.flight.satellite import Satellite


class StepBatch(Protocol):
    """Collects the messages of one step of several satellites, and computes the step once all are there."""

    def add_neighbour_message(self, row: int, neighbour: int, step: int, message: tuple[float, ...]) -> None:
        """Add what a satellite received from a neighbour.

        Args:
            row: of the receiving satellite in the batch.
            neighbour: index of the sender.
            step: of the message: the present one or the next.
            message: time, then the numbers of the message.
        """

    def add_state(self, row: int, state: tuple[Any, ...]) -> None:
        """Add the state that a satellite received from the plant, all numbers of the message."""

    def add_attitude(self, row: int, attitude: tuple[Any, ...]) -> None:
        """Add the attitude that a satellite received from the plant, all numbers of the message."""

    def single(self, row: int) -> Satellite:
        """The flight software of one of the satellites by itself."""

    def dissolve(self) -> None:
        """Have each satellite compute its own steps from now on, from its own part of the state."""
