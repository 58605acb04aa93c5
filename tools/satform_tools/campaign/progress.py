# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress of a campaign on standard error: a bar on a terminal, else a line now and then."""

from contextlib import AbstractContextManager

from satform_tools.run.progress import Report, bar_or_lines


def displayed(name: str, *, quiet: bool = False) -> AbstractContextManager[Report]:
    """Show the progress of a campaign for as long as the block lasts.

    Args:
        name: of the campaign.
        quiet: whether nothing is shown.

    Returns:
        Gives what to call as often as results come; it is cheap to call.
    """
    return bar_or_lines(name, None, progress_text, rate_text, counts=True, quiet=quiet)


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
