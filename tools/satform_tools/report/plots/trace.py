# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws some steps of a flight's trace: which process worked when, and on which message."""

import statistics
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl

from satform.communication.topic_table import PLANT, RECORDER
from satform.plot.style import FAINT, STYLE, colours, figure
from satform_tools.report.trace import Span, step_ends

FILE = "trace.png"
"""In a run's folder: the picture."""

STEPS = 3
"""Steps that are shown."""

_WIDTH, _ROW, _MARGIN = 9.0, 0.42, 1.1
_MICRO = 1e-3
"""Microseconds in a nanosecond."""


def window(found: list[Span]) -> tuple[list[int], list[Span]]:
    """Steps of a flight that took as long as its steps usually do.

    Args:
        found: spans of a flight in lockstep whose steps can be separated.

    Returns:
        When the `STEPS` steps begin and the last of them ends, ns of the machine's monotonic clock, and the
        spans that reach into them.

    Raises:
        ValueError: there are fewer steps.
    """
    moments = [span.begin for span in step_ends(found)]
    lengths = [end - begin for begin, end in zip(moments, moments[STEPS:], strict=False)]
    if not lengths:
        raise ValueError(f"a trace of {max(0, len(moments) - 1)} steps; {STEPS} are to be shown")
    usual = statistics.median(lengths)
    first = min(range(len(lengths)), key=lambda index: abs(lengths[index] - usual))
    limits = moments[first : first + STEPS + 1]
    return limits, [span for span in found if span.end > limits[0] and span.begin < limits[-1]]


def draw(found: list[Span], path: Path) -> None:
    """Draw a few steps that took as long as steps of this flight usually do.

    Args:
        found: spans of a flight in lockstep whose steps can be separated.
        path: of the picture.

    Raises:
        ValueError: there are fewer than `STEPS` steps.
        OSError: the file cannot be written.
    """
    limits, shown = window(found)
    rows = _rows({span.process for span in shown})
    kinds = sorted({_kind(span) for span in shown})
    with mpl.rc_context(STYLE):
        picture = figure(_WIDTH, _MARGIN + _ROW * len(rows))
        axes = picture.subplots()
        for kind, colour in zip(kinds, colours(len(kinds)), strict=True):
            for row, process in enumerate(rows):
                bars = [
                    ((span.begin - limits[0]) * _MICRO, (span.end - span.begin) * _MICRO)
                    for span in shown
                    if span.process == process and _kind(span) == kind
                ]
                axes.broken_barh(bars, (row - 0.35, 0.7), facecolors=colour)
            axes.broken_barh([], (0.0, 0.0), facecolors=colour, label=kind)
        for limit in limits:
            axes.axvline((limit - limits[0]) * _MICRO, color=FAINT, linestyle="--", linewidth=1.0)
        usual = statistics.median(end - begin for begin, end in pairwise(limits)) * _MICRO
        axes.set(
            xlim=(0.0, (limits[-1] - limits[0]) * _MICRO),
            xlabel="us",
            title=f"{STEPS} steps of {usual:.0f} us: processes and their messages",
        )
        axes.set_yticks(range(len(rows)), rows)
        axes.invert_yaxis()
        axes.grid(visible=False)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
        picture.savefig(path)


def _rows(processes: set[str]) -> Sequence[str]:
    """Processes from top to bottom: the plant, the satellites by name, the recorder."""
    return sorted(processes, key=lambda name: (name == RECORDER, name != PLANT, name))


def _kind(span: Span) -> str:
    """Kind of a message, without its satellite."""
    return span.name.rpartition("/")[2]
