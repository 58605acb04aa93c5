# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Quantities of a flight over time, each drawn on axes that are given or new."""

import numpy as np
from matplotlib.axes import Axes

from satform.evaluation import arc_lengths
from satform.numeric.elementwise import Array
from satform.plot import prediction
from satform.plot.style import axes_or_new, colours, labels, thinned, time_unit
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario


def tracking_error(record: FlightRecord, axes: Axes | None = None) -> Axes:
    """Distance of each satellite to its reference over time, m.

    Args:
        record: of the flight.
        axes: to draw on; new ones when left out, as for all functions here.
    """
    return _series(
        axes, record, record.tracking_error, "Distance to the reference", "error [m]", logarithmic=True
    )


def control(record: FlightRecord, axes: Axes | None = None) -> Axes:
    """Magnitude of each satellite's commanded acceleration over time, m/s^2."""
    return _series(axes, record, record.control, "Control", "acceleration [m/s²]", logarithmic=True)


def delta_v(record: FlightRecord, axes: Axes | None = None) -> Axes:
    """Delta-v that each satellite has spent over time, m/s."""
    return _series(
        axes, record, np.cumsum(record.effort, axis=0), "Delta-v so far", "delta-v [m/s]", logarithmic=False
    )


def sliding_variable(record: FlightRecord, axes: Axes | None = None) -> Axes:
    """Largest component of each satellite's sliding variable over time, m/s."""
    values = np.max(np.abs(record.sliding_variable), axis=-1)
    return _series(axes, record, values, "Sliding variable", "largest component [m/s]", logarithmic=True)


def pointing_error(record: FlightRecord, axes: Axes | None = None) -> Axes:
    """Angle between each satellite's boresight and its target over time, rad."""
    return _series(axes, record, record.pointing_error, "Pointing error", "angle [rad]", logarithmic=True)


def wheel_torque(record: FlightRecord, axes: Axes | None = None) -> Axes:
    """Largest commanded torque of each satellite's wheels over time, N m."""
    values = np.max(np.abs(record.wheel_torque), axis=-1)
    return _series(axes, record, values, "Commanded wheel torque", "torque [N m]", logarithmic=True)


def phases(record: FlightRecord, axes: Axes | None = None) -> Axes:
    """Phase of each satellite over time: its generalised arc length less the formation's mean, m."""
    flying = np.isfinite(record.arc_length)
    count = np.maximum(flying.sum(axis=1, keepdims=True), 1)
    mean = np.where(flying, record.arc_length, 0.0).sum(axis=1, keepdims=True) / count
    return _series(
        axes, record, (record.arc_length - mean)[:-1], "Phases", "phase less mean [m]", logarithmic=False
    )


def has_arc_length_spread(scenario: Scenario, record: FlightRecord) -> bool:
    """Whether satellites exchange their arc lengths, and these differ at some time of the flight."""
    exchanged = scenario.consensus.announces == "arc_length" and scenario.communication_graph().edges
    return bool(exchanged) and bool(np.any(arc_lengths.arc_length_spread(record) > 0.0))


def arc_length_spread(record: FlightRecord, scenario: Scenario, axes: Axes | None = None) -> Axes:
    """Spread of the arc lengths over time, m, with what linear consensus theory predicts."""
    axes = axes_or_new(axes)
    duration = record.steps * record.step
    unit = time_unit(duration)
    flown = arc_lengths.arc_length_spread(record)[:, None]
    time, thin = thinned(record.time, flown)
    axes.plot(time / unit.size, _positive(thin[:, 0]), color="#0072B2", label="flown")
    moments = np.linspace(0.0, duration, 601)
    expected = prediction.arc_length_spread(scenario, moments)
    if expected is not None:
        axes.plot(
            moments / unit.size,
            _positive(expected),
            "--",
            color="#D55E00",
            linewidth=1.6,
            label="linear theory",
        )
    if np.any(flown > 0.0):
        axes.set_yscale("log")
    axes.set_xlim(0.0, duration / unit.size)
    axes.set_xlabel(f"time [{unit.name}]")
    axes.set_ylabel("spread [m]")
    axes.set_title("Disagreement on the arc length")
    axes.legend(loc="upper right")
    return axes


def _positive(values: Array) -> Array:
    """Zeros as gaps, since a logarithmic axis has no place for them."""
    return np.where(values > 0.0, values, np.nan)


def _series(
    axes: Axes | None, record: FlightRecord, values: Array, title: str, label: str, *, logarithmic: bool
) -> Axes:
    """Draw a quantity of each satellite over time.

    Args:
        axes: to draw on; new ones with a legend where none are given.
        record: of the flight.
        values: shape (K, N).
        title: of the axes.
        label: of the vertical axis, with its unit.
        logarithmic: whether the axis is.

    Returns:
        The axes.
    """
    own, axes = axes is None, axes_or_new(axes)
    unit = time_unit(record.steps * record.step)
    time, thin = thinned(record.time[:-1], values)
    names = labels(record.satellites)
    for column, colour in enumerate(colours(len(record.satellites))):
        axes.plot(time / unit.size, thin[:, column], color=colour, label=names[column])
    if logarithmic and np.any(thin > 0.0):
        axes.set_yscale("log")
    axes.set_xlabel(f"time [{unit.name}]")
    axes.set_ylabel(label)
    axes.set_title(title)
    axes.set_xlim(0.0, record.steps * record.step / unit.size)
    if own:
        axes.legend(loc="upper right")
    return axes
