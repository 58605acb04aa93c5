# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Quantities over time, each drawn on axes of its own, for pictures of one or of several."""

import numpy as np
from matplotlib.axes import Axes

from satform.evaluation.tracking import arc_length_spread
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_tools.report.plots import prediction
from satform_tools.report.plots.style import series, thinned, time_unit


def draw_tracking_error(axes: Axes, record: FlightRecord) -> None:
    """Draw the tracking errors on axes of a larger picture."""
    series(axes, record, record.tracking_error, "error [m]", logarithmic=True)
    axes.set_title("Distance to the reference")


def draw_control(axes: Axes, record: FlightRecord) -> None:
    """Draw the commanded accelerations on axes of a larger picture."""
    series(axes, record, record.control, "acceleration [m/s²]", logarithmic=True)
    axes.set_title("Control")


def draw_delta_v(axes: Axes, record: FlightRecord) -> None:
    """Draw the delta-v spent so far on axes of a larger picture."""
    series(axes, record, np.cumsum(record.effort, axis=0), "delta-v [m/s]", logarithmic=False)
    axes.set_title("Delta-v so far")


def draw_pointing_error(axes: Axes, record: FlightRecord) -> None:
    """Draw the angles between boresights and targets on axes of a larger picture."""
    series(axes, record, record.pointing_error, "angle [rad]", logarithmic=True)
    axes.set_title("Pointing error")


def draw_wheel_torque(axes: Axes, record: FlightRecord) -> None:
    """Draw the largest commanded torque of each satellite's wheels on axes of a larger picture."""
    series(axes, record, np.max(np.abs(record.wheel_torque), axis=-1), "torque [N m]", logarithmic=True)
    axes.set_title("Wheel torque asked for")


def agrees(scenario: Scenario) -> bool:
    """Whether there are satellites that agree on their phase."""
    return scenario.consensus.announces == "arc_length" and bool(scenario.communication_graph().edges)


def draw_spread(axes: Axes, scenario: Scenario, record: FlightRecord) -> None:
    """Draw the spread of the arc lengths on axes of a larger picture."""
    duration = record.steps * record.step
    unit = time_unit(duration)
    flown = arc_length_spread(record)[:, None]
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


def _positive(values: Array) -> Array:
    """Zeros as gaps, since a logarithmic axis has no place for them."""
    return np.where(values > 0.0, values, np.nan)
