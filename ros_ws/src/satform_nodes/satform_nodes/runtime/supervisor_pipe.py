# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pipe between a node and the supervisor that started its process."""

import select
from multiprocessing.connection import Connection
from typing import Any


class SupervisorPipe:
    """A node's end of the pipe to the supervisor; without one nothing is sent or received."""

    def __init__(self, pipe: Connection | None) -> None:
        self._pipe = pipe

    def send(self, event: str, **details: Any) -> None:
        """Send an event; a supervisor that has ended is no error."""
        if self._pipe is None:
            return
        try:
            self._pipe.send({"event": event, **details})
        except OSError:
            self._pipe = None

    def send_if_ready(self, event: str, **details: Any) -> None:
        """Send an event that may be dropped, such as progress, unless the pipe is full."""
        if self._pipe is not None and select.select([], [self._pipe], [], 0.0)[1]:
            self.send(event, **details)

    def received(self) -> list[dict[str, Any]]:
        """Events that the supervisor has sent since the last call."""
        events: list[dict[str, Any]] = []
        try:
            while self._pipe is not None and self._pipe.poll():
                events.append(self._pipe.recv())
        except (OSError, EOFError):
            self._pipe = None
        return events
