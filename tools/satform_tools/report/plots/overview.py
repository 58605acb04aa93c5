# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Overview of a flight in one figure: the formation in space, and errors and control over time."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from satform import plot
from satform.plot.style import (
    INK,
    figure,
)
from satform.plot.time_series import agrees
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

_LEGEND_COLUMNS, _LEGEND_SIGNS = 7, 80
"""A row of the legend has at most so many names, and letters."""


def overview(scenario: Scenario, record: FlightRecord) -> Figure:
    """The formation in space beside its error, arc-length spread and control over time."""
    drawn = figure(14.0, 7.6)
    halves: Any = drawn.subfigures(1, 2, width_ratios=(1.45, 1.0))
    space, time = halves
    axes = space.add_subplot(projection="3d")
    plot.orbits_3d(record, scenario, axes)
    handles, labels = axes.get_legend_handles_labels()
    columns = max(1, min(_LEGEND_COLUMNS, _LEGEND_SIGNS // (4 + max(map(len, labels)))))
    space.legend(handles, labels, loc="lower center", ncols=columns)
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


def _draw_motion(panels: Any, scenario: Scenario, record: FlightRecord) -> None:
    plot.tracking_error(record, panels[0])
    if agrees(scenario):
        plot.arc_length_spread(record, scenario, panels[1])
    else:
        plot.delta_v(record, panels[1])
    if scenario.links is not None and scenario.links.physical and record.steps:
        plot.delivered_connectivity(record, panels[-1])
    else:
        plot.control(record, panels[-1])
