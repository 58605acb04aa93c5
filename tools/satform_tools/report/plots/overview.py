# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Overview of a flight in one figure: the formation, and errors and control over time."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from satform import plot
from satform.plot.formation import line_styles
from satform.plot.style import (
    INK,
    figure,
)
from satform.plot.time_series import has_arc_length_spread
from satform.plot.viewpoint import plane
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

_LEGEND_COLUMNS, _LEGEND_SIGNS = 7, 80
"""A row of the legend has at most so many names, and letters."""

_PLAN = (1, 0)
"""Components of the plan view, horizontal and vertical: along-track and radial."""


def overview(scenario: Scenario, record: FlightRecord) -> Figure:
    """The formation beside its error, arc-length spread and control over time.

    A formation that lies in a plane is drawn in this plane, any other one in space with a plan view below.
    """
    drawn = figure(14.0, 7.6)
    drawn.get_layout_engine().set(w_pad=0.14, h_pad=0.06)  # type: ignore[union-attr, call-arg]
    halves: Any = drawn.subfigures(1, 2, width_ratios=(1.3, 1.0))
    space, time = halves
    axes = _draw_space(space, scenario, record)
    handles, labels = axes.get_legend_handles_labels()
    columns = max(1, min(_LEGEND_COLUMNS, _LEGEND_SIGNS // (4 + max(map(len, labels)))))
    space.legend(handles, labels, loc="outside lower center", ncols=columns)
    panels = time.subplots(3, 1, sharex=True)
    if not np.any(record.control) and record.pointing_error.size:
        plot.pointing_error(record, panels[0])
        plot.wheel_torque(record, panels[1])
        plot.tracking_error(record, panels[-1])
    else:
        _draw_motion(panels, scenario, record)
    for panel in panels[:-1]:
        panel.set_xlabel("")
    drawn.suptitle(scenario.title, fontsize=14, fontweight="bold", color=INK)
    return drawn


def _draw_space(part: Any, scenario: Scenario, record: FlightRecord) -> Any:
    """Draw the formation, and return the axes with the names of satellites."""
    flat = plane(record)
    if flat is not None:
        axes = part.subplots()
        plot.orbits(record, axes, across=flat[0], up=flat[1], scenario=scenario)
    else:
        upper, lower = part.subfigures(2, 1, height_ratios=(2.1, 1.0))
        axes = upper.add_subplot(projection="3d")
        plot.orbits_3d(record, scenario, axes)
        plot.orbits(record, lower.subplots(), across=_PLAN[0], up=_PLAN[1], scenario=scenario)
    axes.set_title(line_styles(record, scenario), fontsize=10)
    return axes


def _draw_motion(panels: Any, scenario: Scenario, record: FlightRecord) -> None:
    plot.tracking_error(record, panels[0])
    if has_arc_length_spread(scenario, record):
        plot.arc_length_spread(record, scenario, panels[1])
    else:
        plot.delta_v(record, panels[1])
    if scenario.links is not None and scenario.links.physical and record.steps:
        plot.delivered_connectivity(record, panels[-1])
    else:
        plot.control(record, panels[-1])
