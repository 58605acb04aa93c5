# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Time charts of a report's page: lines of each quantity, decimated, with units."""

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from satform.evaluation.arc_lengths import arc_length_spread
from satform.numeric.elementwise import Array
from satform.plot import prediction
from satform.plot.style import Unit, length_unit
from satform.plot.time_series import has_arc_length_spread
from satform.record.flight_record import FlightRecord
from satform_tools.report.event_log import GraphState, graph_states
from satform_tools.report.page.thinning import extremes
from satform_tools.run.stored_run import StoredRun

MOST_LINES = 24
"""Of more satellites than this only the smallest, the middle and the largest value are drawn."""

_MOST_POINTS = 12_000
_MOST_STRETCHES = 800
_MOST_PAIRS = 6
_WIDE = 100.0
"""A quantity whose values differ by more than this factor is drawn on a logarithmic axis."""

_MOST_PREDICTED = 600
_WINDOW = 60.0
"""In which an edge has to deliver a message, s, to count as one of the graph that delivered."""

_MOST_WINDOWS = 1500
_MOST_CONNECTED = 64
"""Satellites up to which the connectivity of what was delivered is drawn."""


Dash = Literal["solid", "dash", "dot"]


@dataclass(frozen=True)
class Line:
    """One line of a chart.

    Attributes:
        name: of what it shows.
        time: in the page's unit, shape (K,).
        values: shape (K,); not a number where the line has a gap.
        satellite: index of its satellite; None where it belongs to none.
        dash: how it is drawn.
    """

    name: str
    time: Array
    values: Array
    satellite: int | None = None
    dash: Dash = "solid"


@dataclass(frozen=True)
class Chart:
    """A quantity over time.

    Attributes:
        key: by which charts of two flights are matched.
        title: what it shows.
        axis: what the vertical axis measures, with its unit.
        lines: at least one.
        logarithmic: whether the vertical axis is.
        steps: whether a value holds until the next one.
        note: text below the chart.
    """

    key: str
    title: str
    axis: str
    lines: tuple[Line, ...]
    logarithmic: bool = False
    steps: bool = False
    note: str = ""


def charts(stored: StoredRun, unit: Unit) -> list[Chart]:
    """All charts of a flight that have something to show.

    Args:
        stored: the flight.
        unit: of the time axis.

    Returns:
        The charts, in the order of the page.
    """
    record = stored.record
    draw = Drawer(record, unit)
    sliding = np.max(np.abs(record.sliding_variable), axis=-1)
    found = [
        draw.each("tracking_error", "Tracking error", "distance to the reference [m]", record.tracking_error),
        _spread(stored, draw),
        draw.each("control", "Control", "commanded acceleration [m/s²]", record.control),
        draw.each("delta_v", "Delta-v", "spent so far [m/s]", np.cumsum(record.effort, axis=0)),
        draw.each("sliding_variable", "Sliding variable", "largest component [m/s]", sliding),
        _distances(stored, draw),
        *_equipment(record, draw),
        *_attitude(record, draw),
    ]
    return [chart for chart in found if chart is not None]


def graph_charts(stored: StoredRun, unit: Unit) -> list[Chart]:
    """Algebraic connectivity of the graph and of what its links delivered, and living satellites, over time.

    Args:
        stored: the flight.
        unit: of the time axis.

    Returns:
        The charts; none for a lone satellite.
    """
    count = len(stored.record.satellites)
    if count < 2:
        return []
    end = stored.record.steps * stored.record.step
    moments = [moment for moment in graph_states(stored) if moment.time <= end]
    time = np.array([*(moment.time for moment in moments), end]) / unit.size
    values = np.array([moment.connectivity for moment in (*moments, moments[-1])])
    note = "" if stored.events else "No events were recorded: the graph is that of the scenario."
    line = Line("algebraic connectivity", time, values)
    found = [
        Chart(
            "connectivity",
            "Algebraic connectivity",
            "λ₂ of the flying satellites",
            (line,),
            steps=True,
            note=note,
        )
    ]
    delivered = _delivered(stored, unit)
    found += [] if delivered is None else [delivered]
    if stored.events and count <= MOST_LINES:
        alive = tuple(_alive(stored, moments, time, column) for column in range(count))
        found.append(Chart("alive", "Living satellites", "", alive, steps=True))
    return found


def _delivered(stored: StoredRun, unit: Unit) -> Chart | None:
    """Connectivity of what the links delivered, in windows; None where every message arrives."""
    record, scenario = stored.record, stored.scenario
    if scenario.links is None or not record.steps or len(record.satellites) > _MOST_CONNECTED:
        return None
    links = record.links
    if links is None or not len(links.edges):
        return None
    window = max(1, round(min(_WINDOW, record.steps * record.step) / record.step))
    window = max(window, record.steps // _MOST_WINDOWS)
    begins, values = links.connectivity(min(window, record.steps))
    line = Line("delivered in the window", begins.astype(np.float64) * record.step / unit.size, values)
    return Chart(
        "delivered_connectivity",
        "Connectivity of delivered messages",
        "λ₂ of edges that delivered",
        (line,),
        steps=True,
        note=f"An edge counts in a window of {window * record.step:g} s if it delivered a message. "
        "The topology is that of the scenario.",
    )


@dataclass(frozen=True)
class Drawer:
    """Draws quantities of one flight.

    Attributes:
        record: the flight.
        unit: of the time axis.
    """

    record: FlightRecord
    unit: Unit

    def each(
        self, key: str, title: str, axis: str, values: Array, names: tuple[str, ...] | None = None
    ) -> Chart | None:
        """A chart with a line for each column; None when there is nothing but zeros to show.

        Args:
            key: of the chart.
            title: of the chart.
            axis: label, with the unit.
            values: shape (K, N) or (K + 1, N).
            names: of the columns; the satellites' when left out.
        """
        if not np.any(np.nan_to_num(values)):
            return None
        logarithmic = _spans(values)
        shown = np.where(values > 0.0, values, np.nan) if logarithmic else values
        satellites = names is None
        labels = self.record.satellites if names is None else names
        if shown.shape[1] > MOST_LINES:
            shown, labels, satellites = _envelope(shown), ("smallest", "median", "largest"), False
        stretches = min(_MOST_STRETCHES, _MOST_POINTS // shown.shape[1])
        lines = []
        for column, name in enumerate(labels):
            if np.all(np.isnan(shown[:, column])):
                continue
            rows = extremes(shown[:, column], stretches)
            time = self.record.time[rows] / self.unit.size
            lines.append(Line(name, time, shown[rows, column], column if satellites else None))
        return Chart(key, title, axis, tuple(lines), logarithmic)


def _spans(values: Array) -> bool:
    """Whether values are mostly positive and of very different size."""
    known = values[np.isfinite(values)]
    positive = known[known > 0.0]
    if np.any(known < 0.0) or len(positive) < 0.5 * max(1, len(known)):
        return False
    low, high = np.quantile(positive, (0.01, 1.0))
    return bool(high > _WIDE * low)


def _envelope(values: Array) -> Array:
    """Smallest, middle and largest of each row, shape (K, 3); NaN where a row is nothing else."""
    found: Array = np.full((len(values), 3), np.nan)
    known = ~np.all(np.isnan(values), axis=1)
    rows = values[known]
    found[known] = np.stack([f(rows, axis=1) for f in (np.nanmin, np.nanmedian, np.nanmax)], axis=1)
    return found


def _spread(stored: StoredRun, draw: Drawer) -> Chart | None:
    if not has_arc_length_spread(stored.scenario, stored.record):
        return None
    flown = arc_length_spread(stored.record)[:, None]
    axis = "largest minus smallest [m]"
    chart = draw.each("arc_length_spread", "Arc-length spread", axis, flown, ("flown",))
    moments = np.linspace(0.0, stored.record.steps * stored.record.step, _MOST_PREDICTED + 1)
    expected = prediction.arc_length_spread(stored.scenario, moments)
    if chart is None or expected is None:
        return chart
    if chart.logarithmic:
        expected = np.where(expected > 0.0, expected, np.nan)
    line = Line("linear theory", moments / draw.unit.size, expected, dash="dash")
    note = "Linear theory: the modes of the consensus law on the scenario's graph, in continuous time."
    return Chart(chart.key, chart.title, chart.axis, (*chart.lines, line), chart.logarithmic, note=note)


def _distances(stored: StoredRun, draw: Drawer) -> Chart | None:
    names, position = stored.record.satellites, stored.record.position
    pairs = list(combinations(range(len(names)), 2))
    if not 0 < len(pairs) <= _MOST_PAIRS:
        return None
    apart = [np.linalg.norm(position[:, i] - position[:, j], axis=-1) for i, j in pairs]
    labels = tuple(f"{names[i]} - {names[j]}" for i, j in pairs)
    values = np.stack(apart, axis=1)
    unit = length_unit(values)
    axis = f"distance [{unit.name}]"
    return draw.each("distances", "Distances between satellites", axis, values / unit.size, labels)


def _equipment(record: FlightRecord, draw: Drawer) -> list[Chart | None]:
    return [
        draw.each(
            "navigation_error",
            "Measurement error",
            "measured minus true position [m]",
            record.navigation_error,
        ),
        draw.each(
            "estimation_error",
            "Estimation error",
            "estimated minus true position [m]",
            record.estimation_error,
        ),
        draw.each("propellant", "Propellant", "left [kg]", record.propellant),
    ]


def _attitude(record: FlightRecord, draw: Drawer) -> list[Chart | None]:
    if not record.pointing_error.size:
        return []
    degrees = np.rad2deg(record.pointing_error)
    estimated = np.rad2deg(record.attitude_estimation_error)
    return [
        draw.each("pointing_error", "Pointing error", "boresight to target [deg]", degrees),
        draw.each(
            "attitude_estimation_error",
            "Attitude estimation error",
            "estimated to true attitude [deg]",
            estimated,
        ),
        draw.each("attitude_error", "Attitude error", "length of the MRP [1]", record.attitude_error),
        draw.each("panel_to_sun", "Panels to the sun", "|cos| of the angle [1]", record.panel_to_sun),
        draw.each(
            "angular_velocity",
            "Angular velocity",
            "largest component [rad/s]",
            _largest(record.angular_velocity),
        ),
        draw.each(
            "wheel_torque", "Wheel torque", "largest of the wheels [N m]", _largest(record.wheel_torque)
        ),
        draw.each(
            "wheel_momentum",
            "Wheel momentum",
            "largest of the wheels [N m s]",
            _largest(record.wheel_momentum),
        ),
    ]


def _largest(values: Array) -> Array:
    """Magnitude of the largest component."""
    found: Array = np.max(np.abs(values), axis=-1)
    return found


def _alive(stored: StoredRun, moments: list[GraphState], time: Array, column: int) -> Line:
    """A level line at a satellite's row while it is alive."""
    rows = [float(column) if moment.alive[column] else np.nan for moment in (*moments, moments[-1])]
    return Line(stored.record.satellites[column], time, np.array(rows), column)
