# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a report: one for each quantity, and an overview."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from satform import plot
from satform.plot.style import (
    STYLE,
    figure,
)
from satform.plot.time_series import has_arc_length_spread
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_tools.report.plots.overview import overview

_VIEWS = ((1, 0), (1, 2), (0, 2))


def draw(
    scenario: Scenario, record: FlightRecord, folder: Path, form: str = "png", wanted: tuple[str, ...] = ()
) -> list[Path]:
    """Draw pictures of a flight.

    Args:
        scenario: what was flown.
        record: of at least one step.
        folder: existing; pictures of the same name are replaced.
        form: of the files: png, svg or pdf.
        wanted: names of the pictures; all that the flight has when left out.

    Returns:
        The files.

    Raises:
        OSError: a file cannot be written.
    """
    parts: dict[str, Callable[[Scenario, FlightRecord], Figure]] = {
        "flight": overview,
        "orbits": orbits,
        "tracking_error": partial(_single, part=plot.tracking_error),
        "control": partial(_single, part=plot.control),
        "delta_v": partial(_single, part=plot.delta_v),
        "sliding_variable": partial(_single, part=plot.sliding_variable),
    }
    if record.pointing_error.size:
        parts["pointing_error"] = partial(_single, part=plot.pointing_error)
    if has_arc_length_spread(scenario, record):
        parts["arc_length_spread"] = spread
    files = []
    with mpl.rc_context(STYLE):
        for name, part in parts.items():
            if wanted and name not in wanted:
                continue
            file = folder / f"{name}.{form}"
            part(scenario, record).savefig(file)
            files.append(file)
    return files


def orbits(scenario: Scenario, record: FlightRecord) -> Figure:
    """Paths of all satellites in three views of the chief's frame."""
    drawn = figure(14.0, 5.4)
    drawn.suptitle(f"{scenario.title}", fontsize=12)
    panels = drawn.subplots(1, 3)
    for axes, (across, up) in zip(panels, _VIEWS, strict=True):
        plot.orbits(record, axes, across=across, up=up)
    panels[0].set_title("× start   ● end   + chief", fontweight="normal", fontsize=9)
    _name_satellites(drawn, panels[0])
    return drawn


def spread(scenario: Scenario, record: FlightRecord) -> Figure:
    """Spread of the arc lengths, with the prediction of linear theory."""
    drawn = figure(9.0, 4.6)
    plot.arc_length_spread(record, scenario, drawn.subplots())
    return drawn


def _single(
    scenario: Scenario, record: FlightRecord, part: Callable[[FlightRecord, Axes | None], Axes]
) -> Figure:
    drawn = figure(9.0, 4.6)
    axes = drawn.subplots()
    part(record, axes)
    axes.set_title(f"{axes.get_title(loc='left')}: {scenario.name}")
    axes.legend(loc="upper right", ncols=min(3, len(record.satellites)))
    return drawn


def _name_satellites(drawn: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        drawn.legend(handles, labels, loc="outside lower center", ncols=min(6, len(labels)))
