# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress on standard error, of a run or of anything else: a bar on a terminal, else a line now and then."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from satform.scenario import Scenario
from satform_tools.console import is_terminal, note

Report = Callable[[int, int], None]
"""Takes what is done and what is to be done: steps of a run, cases of a campaign."""

BAR_PERIOD = 0.1
LINE_PERIOD = 5.0


@contextmanager
def displayed(scenario: Scenario, *, quiet: bool = False) -> Iterator[Report]:
    """Show the progress of a run for as long as the block lasts.

    Args:
        scenario: what is flown.
        quiet: whether nothing is shown.

    Yields:
        What to call after every step, or as often as is known; it is cheap to call.
    """

    def line(done: int, total: int, speed: float) -> str:
        return f"{done} of {total} steps ({100 * done // total} %), {speed_text(scenario, speed)}"

    total = scenario.timing.steps
    with bar_or_lines(
        scenario.name, total, line, lambda speed: speed_text(scenario, speed), quiet=quiet
    ) as report:
        yield report


@contextmanager
def bar_or_lines(
    name: str,
    total: int | None,
    line: Callable[[int, int, float], str],
    speed_text: Callable[[float], str],
    *,
    counts: bool = False,
    quiet: bool = False,
) -> Iterator[Report]:
    """Show progress for as long as the block lasts: a bar on a terminal, else a line now and then.

    Args:
        name: of what progresses.
        total: of what is to be done; None where it is known from the first report.
        line: text of a line, from what is done, the total, and the speed in each second of wall-clock time.
        speed_text: text of the speed beside the bar.
        counts: whether the bar has numbers beside it, in place of percent.
        quiet: whether nothing is shown.

    Yields:
        What to call as often as something is done; it is cheap to call.
    """
    if quiet:
        yield lambda done, total: None
    elif is_terminal(sys.stderr):
        with _bar(name, total, speed_text, counts=counts) as report:
            yield report
    else:
        yield Throttled(lambda done, total, speed: note(f"{name}: {line(done, total, speed)}"), LINE_PERIOD)


def speed_text(scenario: Scenario, steps_per_second: float) -> str:
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


@contextmanager
def _bar(
    name: str, total: int | None, speed_text: Callable[[float], str], *, counts: bool
) -> Iterator[Report]:
    from rich import progress  # noqa: PLC0415 - only a terminal needs them
    from rich.console import Console  # noqa: PLC0415

    columns = (
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.MofNCompleteColumn() if counts else progress.TaskProgressColumn(),
        progress.TextColumn("{task.fields[speed]}"),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(name, total=total, speed="")

        def show(done: int, total: int, speed: float) -> None:
            shown.update(task, completed=done, total=total, speed=speed_text(speed))

        yield Throttled(show, BAR_PERIOD)
