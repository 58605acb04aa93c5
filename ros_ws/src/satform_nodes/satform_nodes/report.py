"""What a node tells the process that started it: JSON lines on a pipe, when there is one."""

import json
import os
from typing import Any

REPORT_VARIABLE = "SATFORM_REPORT_FD"
"""Environment variable with the number of the pipe's file descriptor; unset when nobody listens."""


class Report:
    """A one-way line to whoever started the node; silent when nobody listens."""

    def __init__(self) -> None:
        number = os.environ.get(REPORT_VARIABLE, "")
        self._descriptor = int(number) if number.isdigit() else None

    def say(self, event: str, **details: Any) -> None:
        """Tell of an event; a listener that has gone away is not an error."""
        if self._descriptor is None:
            return
        line = json.dumps({"event": event, **details}) + "\n"
        try:
            os.write(self._descriptor, line.encode())
        except OSError:
            self._descriptor = None
