# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Detection of a second process for one satellite: it ends itself, and does not publish beside the first."""

import time

from satform.common.exit_codes import EXIT_BAD_INPUT
from satform.flight.plans import TimingPlan
from satform_nodes.transport.node_error import NodeError

_DUPLICATE_STEPS = 3
"""Steps that have to be taken without this process until another one flies its satellite for sure."""


class DuplicateCheck:
    """Whether another process flies the satellite of this one.

    In lockstep the plant takes a step only with the command of each satellite that flies; on the wall clock
    one that does not command is lost after a while.
    """

    def __init__(self, name: str, timing: TimingPlan, rate: float) -> None:
        """Nothing has been seen yet.

        Args:
            name: of the satellite.
            timing: of the flight.
            rate: simulated seconds in each second of the wall clock; 0 for lockstep.
        """
        self._name = name
        self._timing = timing
        self._rate = rate
        # First step that was taken without this process though its satellite flies, and when that was seen.
        self._first: tuple[int, float] | None = None
        # Wall-clock time at which this satellite reported to the plant that it is ready.
        self._ready_at = float("inf")

    def note_ready(self) -> None:
        """Note that this satellite reports now that it is ready; only the first time counts."""
        self._ready_at = min(self._ready_at, time.monotonic())

    def may_have_begun_here(self, step: int) -> bool:
        """Whether a flight on the wall clock that has come to a step can have begun with this process.

        It begins when all are ready, and no step comes early: a flight that has taken more steps than fit
        into the time since this process was ready has begun without it.
        """
        since = time.monotonic() - self._ready_at
        return self._first is None and step * self._timing.step / self._rate <= since

    def require_lost(self, step: int, version: int, *, alive: bool, known_version: int) -> None:
        """End this process if another one flies this satellite: steps are taken, and it is not lost.

        States of before a rejoin may be received after the status that announces the rejoin. They are of an
        earlier version of the formation, in which the satellite was lost, and prove nothing.

        Args:
            step: whose state has come, in which this process does not take part.
            version: of the formation for which the state was published.
            alive: whether the satellite takes part by the plant's last status.
            known_version: of the formation in the plant's last status.

        Raises:
            NodeError: the satellite is not lost.
        """
        if not alive or step == 0 or version != known_version:
            self._first = None
            return
        self._first = first, since = self._first or (step, time.monotonic())
        timeout = 2.0 * self._timing.node_timeout if self._rate > 0.0 else 0.0
        if step >= first + _DUPLICATE_STEPS and time.monotonic() - since >= timeout:
            raise NodeError(
                f"{self._name} is not lost: another process flies it, at step {step}; only a lost satellite "
                "can rejoin",
                EXIT_BAD_INPUT,
            )
