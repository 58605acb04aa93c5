# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The formation in the chief's rotating frame: paths in a plane, or in space with the communication graph."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from satform.numeric.elementwise import Array
from satform.plot.style import (
    FAINT,
    INK,
    MOST_NAMES,
    axes_or_new,
    colours,
    drawable,
    length_unit,
    time_unit,
)
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

_AXES = ("radial x", "along-track y", "cross-track z")

_FRAMES = 5
"""How often the formation is drawn in its last period."""

_MOST_POINTS = 4000
_MOST_POINTS_3D = 3000
_MARGIN = 1.06


def orbits(record: FlightRecord, axes: Axes | None = None, *, across: int = 1, up: int = 0) -> Axes:
    """Paths of all satellites in one plane of the chief's rotating frame.

    Args:
        record: of the flight.
        axes: to draw on; new ones when left out.
        across: component along the horizontal axis, 0 radial, 1 along-track, 2 cross-track.
        up: component along the vertical axis.
    """
    own, axes = axes is None, axes_or_new(axes)
    unit = length_unit(record.position)
    stride = max(1, len(record.position) // _MOST_POINTS)
    position = drawable(record.position) / unit.size
    path, last = position[::stride], position[-1]
    named = len(record.satellites) <= MOST_NAMES
    for column, colour in enumerate(colours(len(record.satellites))):
        name = record.satellites[column] if named else None
        axes.plot(path[:, column, across], path[:, column, up], color=colour, linewidth=1.0, label=name)
        axes.plot(path[0, column, across], path[0, column, up], "x", color=colour, markersize=6)
        axes.plot(last[column, across], last[column, up], "o", color=colour, markersize=6)
    axes.plot(0.0, 0.0, "+", color=FAINT, markersize=10)
    axes.set_xlabel(f"{_AXES[across]} [{unit.name}]")
    axes.set_ylabel(f"{_AXES[up]} [{unit.name}]")
    axes.set_aspect("equal", adjustable="datalim")
    if own and named:
        axes.legend(loc="upper right")
    return axes


def orbits_3d(record: FlightRecord, scenario: Scenario, axes: Any = None) -> Any:
    """Paths of all satellites in space, with the edges of the communication graph in the last period.

    Args:
        record: of the flight.
        scenario: that was flown.
        axes: of projection "3d", to draw on; new ones when left out.

    Returns:
        The axes.
    """
    if axes is None:
        import matplotlib.pyplot as plt  # noqa: PLC0415 - reports are drawn without it

        axes = plt.figure(figsize=(8.0, 7.6)).add_subplot(projection="3d")
    unit = length_unit(record.position)
    position = drawable(record.position) / unit.size
    first_row = _last_period_row(scenario, record)
    named = len(record.satellites) <= MOST_NAMES
    for column, colour in enumerate(colours(len(record.satellites))):
        name = record.satellites[column] if named else None
        _line(axes, position[: first_row + 1, column], color=colour, alpha=0.35, linewidth=0.9)
        _line(axes, position[first_row:, column], color=colour, linewidth=1.8, label=name)
        axes.scatter(*position[0, column], marker="x", color=colour, s=32)
        axes.scatter(*position[-1, column], color=colour, s=46, depthshade=False)
    _draw_links(axes, scenario, position, first_row)
    axes.scatter(0.0, 0.0, 0.0, marker="+", color=INK, s=70, label="chief")
    _equal_axes(axes, position)
    axes.set_xlabel(f"radial x [{unit.name}]", labelpad=8)
    axes.set_ylabel(f"along-track y [{unit.name}]", labelpad=10)
    axes.set_zlabel(f"cross-track z [{unit.name}]", labelpad=6)
    length = (record.steps - first_row) * record.step
    clock = time_unit(length)
    axes.set_title(
        f"Chief's rotating frame: approach (faint), last {length / clock.size:.3g} {clock.name} (bold)",
        fontsize=10,
    )
    return axes


def _line(axes: Any, path: Array, **style: Any) -> None:
    thin = path[:: max(1, len(path) // _MOST_POINTS_3D)]
    axes.plot(*thin.T, **style)


def _last_period_row(scenario: Scenario, record: FlightRecord) -> int:
    """First row of the last period; the middle of the flight when there is no period or none is complete."""
    period = scenario.nominal_motion.period
    if period is None or period > record.steps * record.step:
        return record.steps // 2
    return record.steps - round(period / record.step)


def _draw_links(axes: Any, scenario: Scenario, position: Array, first_row: int) -> None:
    """Lines between neighbours, at moments spread over the last period and at the end."""
    last = len(position) - 1
    edges = scenario.communication_graph().edges
    triangle = position.shape[1] == 3 and len(edges) == 6
    for frame in reversed(range(_FRAMES)):
        row = last - round(frame * (last - first_row) / _FRAMES)
        style = (
            {"color": INK, "linewidth": 1.3}
            if frame == 0
            else {"color": FAINT, "linewidth": 0.8, "alpha": 0.8}
        )
        for sender, receiver in edges:
            _line(axes, position[row, [sender, receiver]], **style)
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
