# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress of a campaign on standard error: a bar on a terminal, else a line now and then."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from satform_tools.console import is_terminal, note
from satform_tools.run.progress import BAR_PERIOD, LINE_PERIOD, Throttled

Report = Callable[[int, int], None]
"""Takes the cases that have a result and the number of all cases."""


@contextmanager
def displayed(name: str) -> Iterator[Report]:
    """Show the progress of a campaign for as long as the block lasts.

    Args:
        name: of the campaign.

    Yields:
        What to call as often as results come; it is cheap to call.
    """
    if is_terminal(sys.stderr):
        with _bar(name) as report:
            yield report
    else:
        yield Throttled(
            lambda done, total, speed: note(f"{name}: {progress_text(done, total, speed)}"), LINE_PERIOD
        )


def progress_text(done: int, total: int, speed: float) -> str:
    """Cases done, their rate, and the remaining time, as text.

    Args:
        done: cases that have a result.
        total: all cases.
        speed: cases a second of wall-clock time.
    """
    text = f"{done} of {total} cases ({100 * done // total} %), {rate_text(speed)}"
    return f"{text}, {duration_text((total - done) / speed)} left" if speed > 0.0 else text


def rate_text(speed: float) -> str:
    """Cases a second, or a minute where that is less than one."""
    return f"{speed:.3g} cases/s" if speed >= 1.0 else f"{60.0 * speed:.3g} cases/min"


def duration_text(seconds: float) -> str:
    """A wall-clock time in the units that a clock has."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


@contextmanager
def _bar(name: str) -> Iterator[Report]:
    from rich.console import Console  # noqa: PLC0415 - only a terminal needs them
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn  # noqa: PLC0415

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[speed]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(name, total=None, speed="")

        def show(done: int, total: int, speed: float) -> None:
            progress.update(task, completed=done, total=total, speed=rate_text(speed))

        yield Throttled(show, BAR_PERIOD)
