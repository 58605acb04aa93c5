# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One picture of a whole flight: the formation in space, and how it got there."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_tools.report.plots.panels import (
    agrees,
    draw_control,
    draw_delta_v,
    draw_pointing_error,
    draw_spread,
    draw_tracking_error,
    draw_wheel_torque,
)
from satform_tools.report.plots.style import (
    FAINT,
    INK,
    MOST_NAMES,
    colours,
    drawable,
    figure,
    length_unit,
    time_unit,
)

_FRAMES = 5
"""How often the formation is drawn on its last lap."""

_MOST_POINTS = 3000
_MARGIN = 1.06
_LEGEND_COLUMNS, _LEGEND_SIGNS = 7, 80
"""A row of the legend has at most so many names, and letters."""


def overview(scenario: Scenario, record: FlightRecord) -> Figure:
    """The formation in space beside its error, its disagreement and its control over time."""
    drawn = figure(14.0, 7.6)
    halves: Any = drawn.subfigures(1, 2, width_ratios=(1.45, 1.0))
    space, time = halves
    axes = space.add_subplot(projection="3d")
    _draw_space(axes, scenario, record)
    handles, labels = axes.get_legend_handles_labels()
    columns = max(1, min(_LEGEND_COLUMNS, _LEGEND_SIGNS // (4 + max(map(len, labels)))))
    space.legend(handles, labels, loc="lower center", ncols=columns)
    panels = time.subplots(3, 1, sharex=True)
    if not np.any(record.control) and record.pointing_error.size:
        draw_pointing_error(panels[0], record)
        draw_wheel_torque(panels[1], record)
        draw_tracking_error(panels[-1], record)
    else:
        _draw_motion(panels, scenario, record)
    for panel in panels[:-1]:
        panel.set_xlabel("")
    drawn.suptitle(scenario.title, fontsize=14, fontweight="bold", color=INK)
    return drawn


def _draw_motion(panels: Any, scenario: Scenario, record: FlightRecord) -> None:
    draw_tracking_error(panels[0], record)
    if agrees(scenario):
        draw_spread(panels[1], scenario, record)
    else:
        draw_delta_v(panels[1], record)
    draw_control(panels[-1], record)


def _draw_space(axes: Any, scenario: Scenario, record: FlightRecord) -> None:
    unit = length_unit(record.position)
    position = drawable(record.position) / unit.size
    lap = _last_lap(scenario, record)
    named = len(record.satellites) <= MOST_NAMES
    for column, colour in enumerate(colours(len(record.satellites))):
        name = record.satellites[column] if named else None
        _line(axes, position[: lap + 1, column], color=colour, alpha=0.35, linewidth=0.9)
        _line(axes, position[lap:, column], color=colour, linewidth=1.8, label=name)
        axes.scatter(*position[0, column], marker="x", color=colour, s=32)
        axes.scatter(*position[-1, column], color=colour, s=46, depthshade=False)
    _draw_links(axes, scenario, position, lap)
    axes.scatter(0.0, 0.0, 0.0, marker="+", color=INK, s=70, label="chief")
    _equal_axes(axes, position)
    axes.set_xlabel(f"radial x [{unit.name}]", labelpad=8)
    axes.set_ylabel(f"along-track y [{unit.name}]", labelpad=10)
    axes.set_zlabel(f"cross-track z [{unit.name}]", labelpad=6)
    length = (record.steps - lap) * record.step
    clock = time_unit(length)
    axes.set_title(
        f"Chief's rotating frame: approach (faint), last {length / clock.size:.3g} {clock.name} (bold)",
        fontsize=10,
    )


def _line(axes: Any, path: Array, **style: Any) -> None:
    thin = path[:: max(1, len(path) // _MOST_POINTS)]
    axes.plot(*thin.T, **style)


def _last_lap(scenario: Scenario, record: FlightRecord) -> int:
    """First row of the last lap; the middle of the flight when it has no laps."""
    period = scenario.nominal_motion.period
    if period is None or period > record.steps * record.step:
        return record.steps // 2
    return record.steps - round(period / record.step)


def _draw_links(axes: Any, scenario: Scenario, position: Array, lap: int) -> None:
    """Lines between those who hear each other, at moments spread over the last lap and at the end."""
    last = len(position) - 1
    edges = scenario.communication_graph().edges
    triangle = position.shape[1] == 3 and len(edges) == 6
    for frame in reversed(range(_FRAMES)):
        row = last - round(frame * (last - lap) / _FRAMES)
        style = (
            {"color": INK, "linewidth": 1.3}
            if frame == 0
            else {"color": FAINT, "linewidth": 0.8, "alpha": 0.8}
        )
        for speaker, listener in edges:
            _line(axes, position[row, [speaker, listener]], **style)
        if triangle:
            shade = 0.22 if frame == 0 else 0.06
            axes.add_collection3d(Poly3DCollection([position[row]], facecolor="#E69F00", alpha=shade))


def _equal_axes(axes: Any, position: Array) -> None:
    """The same scale on all axes, in a quiet box."""
    points = position[np.isfinite(position).all(axis=-1)]
    # Where nobody can be drawn, the chief is left.
    points = points if len(points) else np.zeros((1, 3))
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (
        0.5 * (low + high),
        # A satellite that stays where it is still needs a box around it.
        0.5 * _MARGIN * np.maximum(high - low, max(0.25 * float(np.max(high - low)), 1e-6)),
    )
    for component, setter in enumerate((axes.set_xlim, axes.set_ylim, axes.set_zlim)):
        setter(middle[component] - half[component], middle[component] + half[component])
    axes.set_box_aspect(half, zoom=1.05)
    axes.view_init(elev=22.0, azim=32.0)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(5))
        axis.pane.set_facecolor("#fafbfc")
        axis.pane.set_edgecolor("#e3e6ea")
        axis._axinfo["grid"].update(color="#e3e6ea", linewidth=0.6)
