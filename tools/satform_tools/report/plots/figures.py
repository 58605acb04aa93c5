# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report: one for each question, and one overview."""

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_tools.report.plots.overview import overview
from satform_tools.report.plots.panels import (
    agrees,
    draw_control,
    draw_delta_v,
    draw_spread,
    draw_tracking_error,
)
from satform_tools.report.plots.style import (
    FAINT,
    MOST_NAMES,
    STYLE,
    colours,
    drawable,
    figure,
    length_unit,
    series,
)

_AXES = ("radial x", "along-track y", "cross-track z")
_VIEWS = ((1, 0), (1, 2), (0, 2))
_MOST_POINTS = 4000


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
        "tracking_error": tracking_error,
        "control": control,
        "delta_v": delta_v,
        "sliding_variable": sliding_variable,
    }
    if record.pointing_error.size:
        parts["pointing_error"] = pointing
    if agrees(scenario):
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
    unit = length_unit(record.position)
    stride = max(1, len(record.position) // _MOST_POINTS)
    position = drawable(record.position) / unit.size
    path, last = position[::stride], position[-1]
    panels = drawn.subplots(1, 3)
    for axes, (across, up) in zip(panels, _VIEWS, strict=True):
        for column, colour in enumerate(colours(len(record.satellites))):
            name = record.satellites[column] if len(record.satellites) <= MOST_NAMES else None
            axes.plot(path[:, column, across], path[:, column, up], color=colour, linewidth=1.0, label=name)
            axes.plot(path[0, column, across], path[0, column, up], "x", color=colour, markersize=6)
            axes.plot(last[column, across], last[column, up], "o", color=colour, markersize=6)
        axes.plot(0.0, 0.0, "+", color=FAINT, markersize=10)
        axes.set_xlabel(f"{_AXES[across]} [{unit.name}]")
        axes.set_ylabel(f"{_AXES[up]} [{unit.name}]")
        axes.set_aspect("equal", adjustable="datalim")
    panels[0].set_title("× start   ● end   + chief", fontweight="normal", fontsize=9)
    _name_satellites(drawn, panels[0])
    return drawn


def tracking_error(scenario: Scenario, record: FlightRecord) -> Figure:
    """Distance of each satellite to its reference."""
    return _single(scenario, record, lambda axes: draw_tracking_error(axes, record))


def control(scenario: Scenario, record: FlightRecord) -> Figure:
    """Magnitude of each satellite's commanded acceleration."""
    return _single(scenario, record, lambda axes: draw_control(axes, record))


def delta_v(scenario: Scenario, record: FlightRecord) -> Figure:
    """Delta-v that each satellite has spent."""
    return _single(scenario, record, lambda axes: draw_delta_v(axes, record))


def sliding_variable(scenario: Scenario, record: FlightRecord) -> Figure:
    """Largest component of each satellite's sliding variable."""
    values = np.max(np.abs(record.sliding_variable), axis=-1)

    def part(axes: Axes) -> None:
        series(axes, record, values, "largest component [m/s]", logarithmic=True)
        axes.set_title("Sliding variable")

    return _single(scenario, record, part)


def pointing(scenario: Scenario, record: FlightRecord) -> Figure:
    """Angle between each satellite's boresight and its target."""

    def part(axes: Axes) -> None:
        series(axes, record, record.pointing_error, "angle [rad]", logarithmic=True)
        axes.set_title("Pointing error")

    return _single(scenario, record, part)


def spread(scenario: Scenario, record: FlightRecord) -> Figure:
    """Spread of the arc lengths, with what linear theory predicts."""
    drawn = figure(9.0, 4.6)
    draw_spread(drawn.subplots(), scenario, record)
    return drawn


def _single(scenario: Scenario, record: FlightRecord, part: Callable[[Axes], None]) -> Figure:
    drawn = figure(9.0, 4.6)
    axes = drawn.subplots()
    part(axes)
    axes.set_title(f"{axes.get_title(loc='left')}: {scenario.name}")
    if len(record.satellites) <= MOST_NAMES:
        axes.legend(loc="upper right", ncols=min(3, len(record.satellites)))
    return drawn


def _name_satellites(drawn: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        drawn.legend(handles, labels, loc="outside lower center", ncols=min(6, len(labels)))
