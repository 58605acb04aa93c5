# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress of a run on standard error: a bar on a terminal, else a line now and then."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from satform.scenario import Scenario
from satform_tools.console import is_terminal, note

Report = Callable[[int, int], None]
"""Takes the steps flown and the steps to fly."""

BAR_PERIOD = 0.1
LINE_PERIOD = 5.0


@contextmanager
def displayed(scenario: Scenario) -> Iterator[Report]:
    """Show the progress of a run for as long as the block lasts.

    Args:
        scenario: what is flown.

    Yields:
        What to call after every step, or as often as is known; it is cheap to call.
    """
    if is_terminal(sys.stderr):
        with _bar(scenario) as report:
            yield report
    else:
        yield Throttled(lambda done, total, speed: _print(scenario, done, total, speed), LINE_PERIOD)


def pace(scenario: Scenario, steps_per_second: float) -> str:
    """Speed of a run as text."""
    factor = steps_per_second * scenario.timing.step
    return f"{steps_per_second:,.0f} steps/s, {factor:,.{0 if factor >= 10 else 2}f} x real time"


class Throttled:
    """Passes progress on at most once a period, with the speed since the first step."""

    def __init__(self, show: Callable[[int, int, float], None], period: float) -> None:
        self._show = show
        self._period = period
        self._start: tuple[float, int] | None = None
        self._next = 0.0

    def __call__(self, done: int, total: int) -> None:
        """Take the progress; the first call begins the measurement of the speed."""
        now = time.monotonic()
        if self._start is None:
            self._start = (now, done)
            self._next = now + self._period
        if now < self._next:
            return
        self._next = now + self._period
        since, first = self._start
        self._show(done, total, (done - first) / max(now - since, 1e-9))


def _print(scenario: Scenario, done: int, total: int, speed: float) -> None:
    text = f"{scenario.name}: {done} of {total} steps ({100 * done // total} %), {pace(scenario, speed)}"
    note(text)


@contextmanager
def _bar(scenario: Scenario) -> Iterator[Report]:
    from rich.console import Console  # noqa: PLC0415 - only a terminal needs them
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn  # noqa: PLC0415

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[speed]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(scenario.name, total=scenario.timing.steps, speed="")

        def show(done: int, total: int, speed: float) -> None:
            progress.update(task, completed=done, total=total, speed=pace(scenario, speed))

        yield Throttled(show, BAR_PERIOD)
