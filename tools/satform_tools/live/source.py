# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the server of the live page needs of a flight."""

from typing import Any, Protocol

from satform_tools.live.history import History, Recent


class Source(Protocol):
    """A flight that the live page shows.

    Attributes:
        history: what it shows over time.
        period: wall-clock time between two calls of `update`, s.
        events: so far, each with `time` in s and `text`.
        graphs: graph from the start on and after each change, each with `time` in s, `alive`, `pairs` of
            receiver and sender, and `connectivity`.
    """

    history: History
    period: float
    events: Recent
    graphs: Recent

    def formation(self) -> dict[str, Any]:
        """What does not change during the flight: names, orbits, theory."""

    def status(self) -> dict[str, Any]:
        """Phase, step, time, speed, and whether the flight is over."""

    def update(self) -> None:
        """Take what is new; returns at once."""


class Hands(Protocol):
    """What a page with control may do to a flight."""

    def ask(self, request: dict[str, Any], reply: "Reply") -> None:
        """Begin what a page asks for.

        Args:
            request: with `kind` and what belongs to it, as it came from the page.
            reply: called once with the outcome.
        """

    def update(self) -> None:
        """Look for replies of services; returns at once."""


class Reply(Protocol):
    """Takes the outcome of a request."""

    def __call__(self, *, success: bool, text: str, data: dict[str, Any] | None = None) -> None:
        """Send it to the page that asked."""
