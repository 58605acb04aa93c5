# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a picture of a formation in flight shows, put together from what passes on its topics.

Nothing here is needed to fly. A picture may be late and may miss messages: each satellite is shown
where it was last seen, with the step at which that was.
"""

import math
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.consensus.graph import Graph
from satform.display.shapes import (
    GREY,
    Colour,
    attitude_in_lvlh,
    desired_orbit,
    heading,
    link_colour,
    satellite_colour,
)
from satform.flight.plans import ScenePlan
from satform.numeric.elementwise import Array, norm

ORBIT_SAMPLES = 96
"""Pieces of the polyline that shows a desired orbit."""

TRAIL_POINTS = 3000
"""Points of all trails together, at most, unless there are so many satellites that each has the fewest."""
FEWEST_TRAIL_POINTS = 20
"""Points that a trail may always have."""


@dataclass(frozen=True)
class Pose:
    """Where a satellite was seen, and how it was turned.

    Attributes:
        step: at which it was there.
        position: m, LVLH, shape (3,).
        orientation: x, y, z, w, from body to LVLH components, shape (4,); along the velocity for a
            satellite without attitude.
    """

    step: int
    position: Array
    orientation: Array


@dataclass(frozen=True)
class SatelliteView:
    """One satellite in a picture.

    Attributes:
        name: of the satellite.
        trail: where it was in the pictures so far, the oldest first, the last one now.
        colour: its own, or grey when it is lost.
        orbit: desired, closed polyline, m, LVLH, shape (points, 3).
    """

    name: str
    trail: tuple[Pose, ...]
    colour: Colour
    orbit: Array

    @property
    def pose(self) -> Pose:
        """Where it is now."""
        return self.trail[-1]


@dataclass(frozen=True)
class LinkView:
    """An edge of the communication graph: the half of the line between two satellites at the receiver.

    Attributes:
        start: position of the receiver, m, LVLH, shape (3,).
        end: half-way to the sender, m, LVLH, shape (3,).
        colour: by the age of the newest message, and by who is lost.
    """

    start: Array
    end: Array
    colour: Colour


@dataclass(frozen=True)
class Picture:
    """A formation at one moment.

    Attributes:
        step: the newest step at which any satellite was seen.
        satellites: those that have been seen, in the scenario's order.
        links: between those that have been seen.
    """

    step: int
    satellites: tuple[SatelliteView, ...]
    links: tuple[LinkView, ...]


class Scene:
    """Collects published states of a formation, and determines when a picture is due and what is in it."""

    def __init__(self, plan: ScenePlan, snapshots_per_period: int, trail_points: int) -> None:
        """A scene in which nothing has been seen yet.

        Args:
            plan: what is known of the formation.
            snapshots_per_period: how many pictures are wanted of a period, or of a flight shorter than that.
            trail_points: how many pictures a trail reaches back, unless there are very many satellites.
        """
        count = len(plan.names)
        length = max(TRAIL_POINTS // count, FEWEST_TRAIL_POINTS)
        self.names = plan.names
        self.interval = picture_interval(plan, snapshots_per_period)
        self._step_length = plan.step
        self._orbits = [desired_orbit(curve, ORBIT_SAMPLES) for curve in plan.curves]
        self._attitude_orbits = plan.attitude_orbits
        self._alive = [True] * count
        self._in_edges = plan.graph.adjacency.astype(bool)
        self._positions: dict[int, tuple[int, Array, Array]] = {}
        self._turned: dict[int, tuple[float, Array]] = {}
        self._published: dict[int, float] = {}
        self._trails: list[deque[Pose]] = [deque(maxlen=min(trail_points, length)) for _ in plan.names]
        self._last_picture: int | None = None

    @property
    def extent(self) -> float:
        """Distance of the farthest point of any desired orbit from the chief, m; 1 km if there is none."""
        return max(float(norm(orbit).max()) for orbit in self._orbits) or 1000.0

    @property
    def step(self) -> int:
        """The newest step at which any satellite was seen; -1 before the first."""
        return max((step for step, _, _ in self._positions.values()), default=-1)

    @property
    def due(self) -> bool:
        """Whether every satellite has been seen and enough simulated time has passed for a new picture."""
        if len(self._positions) < len(self.names):
            return False
        return self._last_picture is None or self.step >= self._last_picture + self.interval

    def set_motion(self, index: int, step: int, position: Sequence[float], velocity: Sequence[float]) -> None:
        """A satellite was seen at a step: position in m and velocity in m/s, LVLH."""
        self._positions[index] = (step, np.array(position), np.array(velocity))

    def set_attitude(self, index: int, step: int, mrp: Sequence[float]) -> None:
        """A satellite's attitude was seen at a step: modified Rodrigues parameters, inertial to body."""
        self._turned[index] = (step * self._step_length, np.array(mrp))

    def note_message(self, index: int, time: float) -> None:
        """A satellite announced what holds at a simulated time in s."""
        self._published[index] = time

    def set_formation(self, alive: Sequence[bool], receivers: Sequence[int], senders: Sequence[int]) -> None:
        """Take membership and graph from a status of the plant; one that does not fit is left out."""
        count = len(self.names)
        if len(alive) != count:
            return
        with suppress(ValueError):
            self._in_edges = Graph.of_edges(count, receivers, senders).adjacency.astype(bool)
            self._alive = [bool(takes_part) for takes_part in alive]

    def picture(self) -> Picture:
        """The formation as it was last seen; the trails grow by what is new."""
        for index, (step, position, velocity) in self._positions.items():
            trail = self._trails[index]
            if not trail or trail[-1].step != step:
                trail.append(Pose(step, position, self._orientation(index, velocity)))
        self._last_picture = self.step
        return Picture(self.step, tuple(self._views()), tuple(self._links()))

    def _orientation(self, index: int, velocity: Array) -> Array:
        orbit, attitude = self._attitude_orbits[index], self._turned.get(index)
        if orbit is None or attitude is None:
            return heading(velocity)
        time, mrp = attitude
        return attitude_in_lvlh(mrp, orbit, time)

    def _views(self) -> list[SatelliteView]:
        return [
            SatelliteView(
                name=name,
                trail=tuple(self._trails[index]),
                colour=satellite_colour(index) if self._alive[index] else GREY,
                orbit=self._orbits[index],
            )
            for index, name in enumerate(self.names)
            if self._trails[index]
        ]

    def _links(self) -> list[LinkView]:
        now = self.step * self._step_length
        links = []
        for receiver, sender in _pairs(self._in_edges):
            if receiver not in self._positions or sender not in self._positions:
                continue
            start, other = self._positions[receiver][1], self._positions[sender][1]
            colour = link_colour(
                (now - self._published.get(sender, -math.inf)) / self._step_length,
                receiver_alive=self._alive[receiver],
                sender_alive=self._alive[sender],
            )
            links.append(LinkView(start, 0.5 * (start + other), colour))
        return links


def picture_interval(plan: ScenePlan, snapshots_per_period: int) -> int:
    """Steps from one picture to the next.

    Args:
        plan: what is known of the formation.
        snapshots_per_period: of the longest period of any satellite, or of the whole flight if shorter;
            of the chief's orbit where every satellite holds a fixed point.

    Returns:
        One or more.
    """
    return max(1, round(plan.period / (snapshots_per_period * plan.step)))


def _pairs(in_edges: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Receiver and sender of every link."""
    return [(int(receiver), int(sender)) for receiver, sender in zip(*np.nonzero(in_edges), strict=True)]
