# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The formation in the chief's rotating frame: paths in a plane or in space, and the communication graph."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from satform.numeric.elementwise import Array
from satform.plot.style import (
    FAINT,
    INK,
    axes_or_new,
    colours,
    drawable,
    labels,
    length_unit,
    time_unit,
)
from satform.plot.viewpoint import viewpoint
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

_AXES = ("radial x", "along-track y", "cross-track z")
_SPACE = (0, 1, 2)

_FRAMES = 5
"""How often the formation is drawn in its last period."""

_MOST_POINTS = 4000
_MARGIN = 1.06


def orbits(
    record: FlightRecord,
    axes: Axes | None = None,
    *,
    across: int = 1,
    up: int = 0,
    scenario: Scenario | None = None,
) -> Axes:
    """Paths of all satellites in one plane of the chief's rotating frame.

    Args:
        record: of the flight.
        axes: to draw on; new ones when left out.
        across: component along the horizontal axis, 0 radial, 1 along-track, 2 cross-track.
        up: component along the vertical axis.
        scenario: that was flown; if given, the last period is bold, with the edges of the graph.

    Returns:
        The axes.
    """
    own, axes = axes is None, axes_or_new(axes)
    unit = length_unit(record.position)
    _draw_formation(axes, record, drawable(record.position)[..., [across, up]] / unit.size, scenario)
    axes.set_xlabel(f"{_AXES[across]} [{unit.name}]")
    axes.set_ylabel(f"{_AXES[up]} [{unit.name}]")
    axes.set_aspect("equal", adjustable="datalim")
    if own:
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
    position = drawable(record.position)[..., _SPACE] / unit.size
    _draw_formation(axes, record, position, scenario)
    _equal_axes(axes, position)
    axes.set_xlabel(f"radial x [{unit.name}]", labelpad=8)
    axes.set_ylabel(f"along-track y [{unit.name}]", labelpad=10)
    axes.set_zlabel(f"cross-track z [{unit.name}]", labelpad=6)
    return axes


def line_styles(record: FlightRecord, scenario: Scenario) -> str:
    """What faint and bold lines of a formation mean, for a title."""
    length = (record.steps - _last_period_row(scenario, record)) * record.step
    clock = time_unit(length)
    return f"Chief's rotating frame: approach (faint), last {length / clock.size:.4g} {clock.name} (bold)"


def _draw_formation(axes: Any, record: FlightRecord, position: Array, scenario: Scenario | None) -> None:
    """Draw paths, first and last positions, the chief, and the edges of the graph.

    Args:
        axes: plane or in space.
        record: of the flight.
        position: components along the axes, shape (K, N, 2) or (K, N, 3).
        scenario: that was flown; without it all of a path is drawn alike, and no graph.
    """
    first_row = 0 if scenario is None else _last_period_row(scenario, record)
    names = labels(record.satellites)
    for column, colour in enumerate(colours(len(record.satellites))):
        _line(axes, position[: first_row + 1, column], color=colour, alpha=0.35, linewidth=0.9)
        _line(axes, position[first_row:, column], color=colour, linewidth=1.6, label=names[column])
        axes.plot(*position[:1, column].T, "x", color=colour, markersize=6)
        axes.plot(*position[-1:, column].T, "o", color=colour, markersize=6)
    if scenario is not None:
        _draw_graph(axes, scenario, position, first_row)
    axes.plot(*np.zeros((position.shape[-1], 1)), "+", color=INK, markersize=9, label="chief")


def _line(axes: Any, path: Array, **style: Any) -> None:
    thin = path[:: max(1, len(path) // _MOST_POINTS)]
    axes.plot(*thin.T, **style)


def _last_period_row(scenario: Scenario, record: FlightRecord) -> int:
    """First row of the last period; the middle of the flight when there is no period or none is complete."""
    period = scenario.nominal_motion.period
    if period is None or period > record.steps * record.step:
        return record.steps // 2
    return record.steps - round(period / record.step)


def _draw_graph(axes: Any, scenario: Scenario, position: Array, first_row: int) -> None:
    """Lines between neighbours, at moments spread over the last period and at the end."""
    last = len(position) - 1
    edges = scenario.communication_graph().edges
    triangle = position.shape[1:] == (3, 3) and len(edges) == 6
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
    axes.set_box_aspect(half, zoom=0.97)
    elevation, azimuth = viewpoint(points)
    axes.view_init(elev=elevation, azim=azimuth)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(5))
        axis.pane.set_facecolor("#fafbfc")
        axis.pane.set_edgecolor("#e3e6ea")
        axis._axinfo["grid"].update(color="#e3e6ea", linewidth=0.6)
