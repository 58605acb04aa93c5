# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Being asked to stop by a signal: the one module that handles it, for nodes, flights and commands.

SIGINT (Ctrl-C), SIGTERM and SIGHUP (the terminal was closed) mean the same: stop in order. Whatever was
stopped by one of them ends with exit code 130, in every mode. A SIGHUP that the parent ignores stays ignored,
which is what `nohup` is for; SIGINT and SIGTERM are handled whatever the parent does with them, so that a
background job or a CI runner can be stopped as well. `programs` handles
signals until this module is imported.
"""

import os
import select
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType, TracebackType
from typing import Any, NoReturn, Self

from satform.common.exit_codes import EXIT_STOPPED

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that ask a process to stop."""

_TOGETHER = 0.3
"""Wall-clock time within which a signal that is repeated is still the first one, s.

`timeout`, and a supervisor that ends a group of processes, send it to a process and to its group.
"""


class StopRequest:
    """Counts the signals that ask this process to stop, instead of ending it, until it is closed.

    The first one, sent again at once, counts as one: so `timeout` sends it, to a process and to its group.

    Attributes:
        count: of signals so far.
        name: of the first one, such as SIGTERM; empty before it.
    """

    def __init__(self, *, exit_at_second: bool = True) -> None:
        """Handle the signals from now on; in another thread than the main one none is counted.

        Args:
            exit_at_second: whether the second signal ends the process at once.
        """
        self.count = 0
        self.name = ""
        self._first: tuple[int, float] | None = None
        self._exit_at_second = exit_at_second
        self._reader, self._writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._wakeup_before = -1
        self._before: dict[signal.Signals, Any] = {}
        # Only the main thread may set handlers; in another thread the program's own handlers stay.
        with suppress(ValueError):
            # A signal writes a byte here, which ends a pause at once.
            self._wakeup_before = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
            self._before = _handle(self._on_signal)

    @property
    def asked(self) -> bool:
        """Whether this process has been asked to stop."""
        return self.count > 0

    def pause(self, duration: float) -> None:
        """Wait for a wall-clock time in s, or until a signal arrives."""
        select.select([self._reader], [], [], 0.0 if self.asked else duration)

    def close(self) -> None:
        """Handle the signals as before."""
        if self._before:
            signal.set_wakeup_fd(self._wakeup_before)
        _restore(self._before)
        self._before = {}
        os.close(self._reader)
        os.close(self._writer)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.close()

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        now = time.monotonic()
        self._first = self._first or (number, now)
        if self.count == 1 and number == self._first[0] and now - self._first[1] < _TOGETHER:
            return
        self.count += 1
        self.name = self.name or signal.Signals(number).name
        if self._exit_at_second and self.count > 1:
            sys.exit(EXIT_STOPPED)


@contextmanager
def interrupting() -> Iterator[None]:
    """Have every signal that asks to stop raise KeyboardInterrupt, so that the block is left in order."""

    def interrupt(number: int, _frame: FrameType | None) -> NoReturn:
        raise KeyboardInterrupt(signal.Signals(number).name)

    before: dict[signal.Signals, Any] = {}
    with suppress(ValueError):
        before = _handle(interrupt)
    try:
        yield
    finally:
        _restore(before)


def _handle(handler: Any) -> dict[signal.Signals, Any]:
    """Set the handler of every signal that asks to stop; gives those of before."""
    keeps_running = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    handled = STOPPING[:2] if keeps_running else STOPPING
    return {number: signal.signal(number, handler) for number in handled}


def _restore(before: dict[signal.Signals, Any]) -> None:
    for number, handler in before.items():
        # A handler that was not set from Python cannot be set by it.
        signal.signal(number, signal.SIG_DFL if handler is None else handler)
