# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Real-time loop of the plant: steps begin by the wall clock, and late commands are not waited for."""

import resource
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from satform_nodes.runtime.signals import StopRequest
from satform_nodes.transport.executor import StepExecutor

_MAX_DELAYS = 1_000_000
"""Largest number of delays that are stored for the statistics."""


class RealtimePlant(Protocol):
    """What the loop needs of the plant's node."""

    @property
    def over(self) -> bool:
        """Whether there is nothing more to be done."""

    @property
    def flown(self) -> bool:
        """Whether the last step has been taken."""

    @property
    def stands_still(self) -> bool:
        """Whether no step is to be taken at present."""

    def check_rejoin_timeout(self) -> None:
        """End the flight when it has stood still for too long."""

    def tick(self) -> None:
        """Take the next step with the commands that there are."""


@dataclass
class Punctuality:
    """Delays of the plant's steps.

    Attributes:
        period: wall-clock time between two steps, s.
        delays: by which each step began late, s.
        overruns: steps that began so late that the clock was set anew.
    """

    period: float
    delays: list[float] = field(default_factory=list)
    overruns: int = 0

    def data(self) -> dict[str, Any]:
        """Figures for the result: mean, 99 % and largest delay of the ticks, s."""
        ordered = sorted(self.delays) or [0.0]
        return {
            "period": self.period,
            "ticks": len(self.delays),
            "delay_mean": sum(ordered) / len(ordered),
            "delay_99": ordered[int(0.99 * (len(ordered) - 1))],
            "delay_largest": ordered[-1],
            "overruns": self.overruns,
        }


class CommandMonitor:
    """Delays and misses of the satellites' commands.

    Attributes:
        misses: of each satellite, steps that were taken without its command.
        late: of each satellite, commands that arrived late.
        timed_out: of each satellite, steps that were taken with its thrusters off, its command being too old.
    """

    def __init__(self, satellites: int, clock: Callable[[], float] = time.monotonic) -> None:
        """No command has been received yet.

        Args:
            satellites: how many there are.
            clock: wall clock, s.
        """
        self._clock = clock
        self.misses = [0] * satellites
        self.late = [0] * satellites
        self.timed_out = [0] * satellites
        self._commanded = [-1] * satellites
        self._received_at = [0.0] * satellites

    def begin(self) -> None:
        """Start all satellites' timeouts now."""
        self._received_at = [self._clock()] * len(self._received_at)

    def restart_timeout(self, satellite: int) -> None:
        """Restart a satellite's timeout: a message of it has been received."""
        self._received_at[satellite] = self._clock()

    def first_due(self, satellite: int) -> int:
        """The first step for which a satellite has not commanded yet."""
        return self._commanded[satellite] + 1

    def note(self, satellite: int, step: int, now: int) -> None:
        """Note that a command came in, in time or late.

        Args:
            satellite: whose it is.
            step: for which it is.
            now: the present step.
        """
        self.restart_timeout(satellite)
        self._commanded[satellite] = step
        self.late[satellite] += step < now

    def count_missing(self, satellites: Iterable[int], step: int, tolerated: float) -> list[int]:
        """Count the commands that are missing as a step is taken.

        Args:
            satellites: that fly.
            step: that is taken.
            tolerated: timeout of a satellite, wall-clock time, s.

        Returns:
            Indices of the satellites that have timed out.
        """
        now, timed_out = self._clock(), []
        for satellite in satellites:
            self.misses[satellite] += self._commanded[satellite] < step
            if now - self._received_at[satellite] > tolerated:
                timed_out.append(satellite)
        return timed_out

    def expired(self, satellites: Iterable[int], step: int, held: int) -> list[int]:
        """Count and return those whose newest command is too old to be held on.

        Args:
            satellites: that fly.
            step: that is taken.
            held: steps after its own for which a command is held.
        """
        old = [satellite for satellite in satellites if step - self._commanded[satellite] > held]
        for satellite in old:
            self.timed_out[satellite] += 1
        return old

    def data(self, names: Sequence[str]) -> dict[str, dict[str, int]]:
        """Figures for the result: misses, late and timed-out commands by the satellites' names."""
        return {
            "timed_out": dict(zip(names, self.timed_out, strict=True)),
            "misses": dict(zip(names, self.misses, strict=True)),
            "late": dict(zip(names, self.late, strict=True)),
        }


def run_realtime(
    plant: RealtimePlant, executor: StepExecutor, stop: StopRequest, period: float
) -> Punctuality:
    """Take steps at their times until the flight is over.

    A step that would begin more than a period late sets the clock anew: steps are never made up for
    in a burst, which no spacecraft could.

    Args:
        plant: takes the steps.
        executor: does the waiting.
        stop: ends the flight early.
        period: wall-clock time between two steps, s.

    Returns:
        How punctual it was.
    """
    punctuality = Punctuality(period)
    due = time.monotonic() + period

    def going_on() -> bool:
        return not (plant.over or plant.flown or stop.asked)

    while going_on():
        executor.spin_till(due, going_on)
        if not going_on():
            break
        late = time.monotonic() - due
        if len(punctuality.delays) < _MAX_DELAYS:
            punctuality.delays.append(late)
        if plant.stands_still:
            plant.check_rejoin_timeout()
        else:
            plant.tick()
        if late > period:
            punctuality.overruns += 1
            due = time.monotonic()
        due += period
    return punctuality


def processor_seconds() -> float:
    """Processor time that this process has used so far, s."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
