# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Data of the 3-D view of a page: positions over time, reference orbits and edges of the graph."""

from dataclasses import dataclass

import numpy as np

from satform.flight.compile_satellite import flight_plan
from satform.numeric.elementwise import Array
from satform.plot.style import Unit, drawable
from satform_tools.report.event_log import graph_states
from satform_tools.run.stored_run import StoredRun

_MOST_POSITIONS = 24_000
_MOST_MOMENTS = 1500
_FEWEST_MOMENTS = 60
_MOST_LINKS = 600
_MOST_ORBITS = 48
_CURVE_POINTS = 145
_TRAIL = 0.25
"""Length of a satellite's trail as a fraction of its period, or of the flight where it has none."""


@dataclass(frozen=True)
class Links:
    """Edges of the graph, from a time on.

    Attributes:
        moment: first one.
        pairs: indices of two satellites with an edge between them in either direction.
        alive: one for each satellite.
    """

    moment: int
    pairs: tuple[tuple[int, int], ...]
    alive: tuple[bool, ...]


@dataclass(frozen=True)
class Space:
    """A flight in space.

    Attributes:
        names: of the satellites.
        time: of the moments, in the page's unit, evenly spread, shape (M,).
        position: in the chief's rotating frame, in the page's unit, shape (M, N, 3); NaN where it was not
            finite.
        orbits: the desired closed curve of each satellite, in order, shape (P, 3); none of no points.
        links: from the first moment on and after each change.
        trail: moments that a satellite's trail goes back.
        triangle: whether the formation is a triangle of which every side is a link.
        note: what is left out.
    """

    names: tuple[str, ...]
    time: Array
    position: Array
    orbits: tuple[Array, ...]
    links: tuple[Links, ...]
    trail: int
    triangle: bool
    note: str


def space(stored: StoredRun, length: Unit, clock: Unit) -> Space | None:
    """The 3-D view of a flight; None where no satellite moves.

    Args:
        stored: the flight.
        length: unit of positions.
        clock: unit of times.
    """
    record = stored.record
    count = len(record.satellites)
    position = drawable(record.position)
    known = position[~np.isnan(position).any(axis=-1)]
    if not known.size or float(np.ptp(known, axis=0).max()) < 1e-6:
        return None
    wanted = max(_FEWEST_MOMENTS, min(_MOST_MOMENTS, _MOST_POSITIONS // count))
    moments = np.unique(np.linspace(0, record.steps, min(wanted, record.steps + 1)).round().astype(np.int64))
    links, note = _links(stored, record.time[moments])
    period = stored.scenario.nominal_motion.period or record.steps * record.step
    trail = _TRAIL * min(period, record.steps * record.step) / (record.steps * record.step)
    return Space(
        names=record.satellites,
        time=record.time[moments] / clock.size,
        position=position[moments] / length.size,
        orbits=tuple(_orbit(stored, index, length) for index in range(count))
        if count <= _MOST_ORBITS
        else (),
        links=links,
        trail=max(2, round(trail * len(moments))),
        triangle=count == 3 and len(links[0].pairs) == 3,
        note=" ".join(filter(None, (note, _left_out(position)))),
    )


def _left_out(position: Array) -> str:
    unknown = np.isnan(position).any(axis=-1)
    if not unknown.any():
        return ""
    step = int(np.argwhere(unknown)[0][0])
    return f"From step {step} on there are positions that are not finite; they are left out."


def _orbit(stored: StoredRun, index: int, length: Unit) -> Array:
    spec = stored.scenario.satellite(index)
    curve = flight_plan(stored.scenario, index).path.curve
    if float(curve.perimeter) == 0.0 or spec.controller is None or spec.controller.follows != "reference":
        return np.empty((0, 3))
    points: Array = curve.point(np.linspace(0.0, 2.0 * np.pi, _CURVE_POINTS)).position / length.size
    return points


def _links(stored: StoredRun, time: Array) -> tuple[tuple[Links, ...], str]:
    found, note = [], ""
    for moment in graph_states(stored):
        linked = np.triu((moment.adjacency + moment.adjacency.T) > 0.0)
        pairs = [(int(i), int(j)) for i, j in np.argwhere(linked)]
        if len(pairs) > _MOST_LINKS:
            pairs, note = [], f"{len(pairs)} links are too many to be drawn."
        first = int(np.searchsorted(time, moment.time))
        if first < len(time):
            found.append(Links(first, tuple(pairs), moment.alive))
    return tuple(found), note
