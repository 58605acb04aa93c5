# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The executor of all nodes: loops that execute callbacks until something holds or nothing moves any more."""

import time
from collections.abc import Callable
from typing import Any

from satform_nodes.transport.fast_path import LONGEST_WAIT, FastPathExecutor

LONGEST_PUT_OFF = 0.1
"""Wall-clock time by which a background poll is delayed at most if a deadline is near, s."""

BACKGROUND_POLL_TIME = 0.001
"""Wall-clock time allowed for a background poll before a deadline, s."""

POLLING_PERIOD = 0.005
"""Wall-clock time between two polls of a node that no other node waits for, s."""

RETRANSMIT_DELAY = 0.1
"""Wall-clock time without progress after which a node retransmits its last messages, s."""

SUSPENSION = 0.25
"""Wall-clock time of one iteration from which on this process counts as having been suspended, s."""

LONGEST_IDLE = 1.0
"""Longest wall-clock time between two retransmissions, s."""


class StepExecutor(FastPathExecutor):
    """A single-threaded executor with a fast path, and loops over steps."""

    def spin_while(
        self,
        condition: Callable[[], bool],
        timeout: float,
        idle: Callable[[], None] | None = None,
        progress: Callable[[], object] | None = None,
    ) -> bool:
        """Execute callbacks while a condition holds, with a timeout without progress.

        Args:
            condition: checked after every iteration.
            timeout: wall-clock time without progress after which this returns, s.
            idle: called when there was no progress for `RETRANSMIT_DELAY`, then twice that, and so on
                up to `LONGEST_IDLE` between two calls.
            progress: value that changes with progress; by default every hot message is progress.

        Returns:
            True if the condition no longer holds; False after the timeout.
        """
        last = seen = time.monotonic()
        before = progress() if progress else None
        wait, due = RETRANSMIT_DELAY, last + RETRANSMIT_DELAY
        while condition():
            now = time.monotonic()
            if now - seen > SUSPENSION:
                # This process was suspended itself: messages that arrived meanwhile are still to be taken.
                last += now - seen
            seen = now
            if now >= self.next_background_poll:
                self.poll_background(now)
            moved = self.take_hot(LONGEST_WAIT)
            if progress:
                here = progress()
                moved = here != before
                before = here
            if moved:
                last = now
                wait, due = RETRANSMIT_DELAY, now + RETRANSMIT_DELAY
            elif now - last > timeout:
                return False
            elif idle and now > due:
                wait = min(2.0 * wait, LONGEST_IDLE)
                due = now + wait
                idle()
        return True

    def spin_till(self, moment: float, condition: Callable[[], bool]) -> None:
        """Execute callbacks until a time of the monotonic clock in s, while the condition holds."""
        while condition():
            now = time.monotonic()
            if now >= moment:
                return
            # A background poll may take a while, and must not delay the deadline.
            overdue = now - self.next_background_poll
            if overdue > LONGEST_PUT_OFF or (overdue >= 0.0 and moment - now > BACKGROUND_POLL_TIME):
                self.poll_background(now)
            self.take_hot(min(LONGEST_WAIT, max(0.0, moment - time.monotonic())))

    def spin_polling(
        self, condition: Callable[[], bool], timeout: float, pause: Callable[[float], Any]
    ) -> bool:
        """As `spin_while`, for a node that no other node waits for: takes all messages, then pauses.

        Args:
            condition: checked after every iteration.
            timeout: wall-clock time without any hot message after which this returns, s.
            pause: waits for the given time in s, or less, for example until a signal.

        Returns:
            True if the condition no longer holds; False after the timeout.
        """
        last = time.monotonic()
        while condition():
            now = time.monotonic()
            if now >= self.next_background_poll:
                self.poll_background(now)
            if self.drain_hot():
                last = now
            elif now - last > timeout:
                return False
            pause(POLLING_PERIOD)
        return True

    def spin_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Execute callbacks until a condition holds.

        Args:
            condition: checked after every iteration.
            timeout: wall-clock time after which this returns, s.

        Returns:
            Whether the condition holds.
        """
        end = time.monotonic() + timeout
        while not condition():
            now = time.monotonic()
            if now >= end:
                return False
            if now >= self.next_background_poll:
                self.poll_background(now)
            self.take_hot(min(end - now, LONGEST_WAIT))
        return True
