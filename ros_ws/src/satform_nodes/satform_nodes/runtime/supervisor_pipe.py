# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a node and the process that started it tell each other, on a pipe, when there is one."""

import select
from multiprocessing.connection import Connection
from typing import Any


class Report:
    """A line to whoever started the node; silent when nobody is there."""

    def __init__(self, pipe: Connection | None) -> None:
        self._pipe = pipe

    def say(self, event: str, **details: Any) -> None:
        """Tell of an event; a listener that has gone away is not an error."""
        if self._pipe is None:
            return
        try:
            self._pipe.send({"event": event, **details})
        except OSError:
            self._pipe = None

    def say_if_heard(self, event: str, **details: Any) -> None:
        """Tell of an event that may be left out, such as progress, unless the listener is behind."""
        if self._pipe is not None and select.select([], [self._pipe], [], 0.0)[1]:
            self.say(event, **details)

    def heard(self) -> list[dict[str, Any]]:
        """What whoever started the node has said since the last time."""
        said: list[dict[str, Any]] = []
        try:
            while self._pipe is not None and self._pipe.poll():
                said.append(self._pipe.recv())
        except (OSError, EOFError):
            self._pipe = None
        return said
