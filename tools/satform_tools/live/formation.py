# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live page takes from a scenario: orbits, chief, boresights, theory of the consensus."""

import math
from functools import cache
from typing import Any

import numpy as np

from satform.display.shapes import desired_orbit
from satform.flight.compile_satellite import flight_plan
from satform.flight.orbit_states import epoch_of, unperturbed_chief
from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief, earth_angle_at
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008, ROTATION_RATE
from satform.orbits.inertial_motion import unperturbed
from satform.plot import prediction
from satform.scenario import Scenario
from satform_tools.report.page.document import packed

_ORBIT_POINTS = 180
_MOST_ORBITS = 64
_MOST_PAIRS = 12
"""Satellites up to which every pair may become an edge of the page."""

_MOST_EDGES = 600
_PREDICTED = 400


class FormationView:
    """A scenario as the live page needs it.

    Attributes:
        scenario: that is flown.
        names: of the satellites.
        edges: receiver and sender of every edge that the page can draw.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.names = tuple(satellite.name for satellite in scenario.satellites)
        self.edges = _edges(scenario)
        self._chief = _chief(scenario)

    def chief(self, times: Array) -> Array:
        """Inertial position in m and velocity in m/s of the chief on its orbit of time zero.

        Args:
            times: s, shape (M,).

        Returns:
            Shape (M, 6); not a number where the scenario has no orbit about the Earth.
        """
        if self._chief is None:
            return np.full((len(times), 6), np.nan)
        frames = unperturbed(self._chief, times)
        return np.concatenate((frames.origin_position, frames.origin_velocity), axis=-1)

    @cache  # noqa: B019 - as long-lived as the page
    def description(self) -> dict[str, Any]:
        """What does not change in flight, as the page takes it."""
        timing, scenario = self.scenario.timing, self.scenario
        epoch = epoch_of(scenario)
        return {
            "name": scenario.name,
            "title": " ".join(scenario.title.split()),
            "names": list(self.names),
            "step": timing.step,
            "last_step": timing.steps,
            "period": scenario.nominal_motion.period or 0.0,
            "orbits": self._orbits(),
            "edges": self.edges,
            "boresights": self._boresights(),
            "chief_orbit": self._chief_orbit(),
            "chief_note": self._chief_note(),
            "earth_angle": 0.0 if epoch is None else earth_angle_at(epoch),
            "earth_rate": ROTATION_RATE,
            "agrees": _exchanges_phases(scenario),
            "theory": self._theory(),
        }

    def _orbits(self) -> list[str | None]:
        """The desired orbit of each satellite; of several on the same one only that of the first."""
        found: list[str | None] = []
        drawn: set[str] = set()
        for index in range(len(self.names)):
            spec = self.scenario.satellite(index)
            follows = spec.controller is not None and spec.controller.follows == "reference"
            curve = flight_plan(self.scenario, index).path.curve
            orbit = None
            if follows and float(curve.perimeter) > 0.0 and len(drawn) < _MOST_ORBITS:
                orbit = packed(desired_orbit(curve, _ORBIT_POINTS))
            found.append(None if orbit in drawn else orbit)
            if orbit is not None:
                drawn.add(orbit)
        return found

    def _boresights(self) -> list[list[float] | None]:
        found: list[list[float] | None] = []
        for index in range(len(self.names)):
            orientation = flight_plan(self.scenario, index).orientation
            axis = None if orientation is None else np.ravel(orientation.pointing.axes.boresight)
            found.append(None if axis is None else [float(value) for value in axis])
        return found

    def _chief_orbit(self) -> str | None:
        if self._chief is None:
            return None
        period = 2.0 * math.pi * math.sqrt(self._chief.semi_major_axis**3 / GRAVITATIONAL_PARAMETER_EGM2008)
        return packed(self.chief(np.linspace(0.0, period, 2 * _ORBIT_POINTS + 1))[:, :3])

    def _chief_note(self) -> str:
        if self._chief is None:
            return "The scenario has no orbit about the Earth."
        known = unperturbed_chief(self.scenario) is not None
        plane = "" if known else " The scenario does not fix its plane; that of the equator is drawn."
        return f"The chief is drawn on its orbit of time zero, without perturbations.{plane}"

    def _theory(self) -> dict[str, str] | None:
        if not _exchanges_phases(self.scenario):
            return None
        moments = np.linspace(0.0, self.scenario.timing.steps * self.scenario.timing.step, _PREDICTED + 1)
        expected = prediction.arc_length_spread(self.scenario, moments)
        return (
            None if expected is None else {"time": packed(moments, double=True), "spread": packed(expected)}
        )


def _exchanges_phases(scenario: Scenario) -> bool:
    """Whether there are satellites that send their phases to others."""
    return scenario.consensus.announces == "arc_length" and bool(scenario.communication_graph().edges)


def _edges(scenario: Scenario) -> list[tuple[int, int]]:
    """Every pair of few satellites; the possible edges of more of them, if they are not too many."""
    count = len(scenario.satellites)
    if count <= _MOST_PAIRS:
        return [(row, column) for row in range(count) for column in range(count) if row != column]
    pairs = [(int(row), int(column)) for row, column in np.argwhere(scenario.possible_graph().adjacency > 0)]
    return pairs if len(pairs) <= _MOST_EDGES else []


def _chief(scenario: Scenario) -> KeplerianChief | None:
    """The chief's orbit; in the equatorial plane where the scenario fixes none."""
    known = unperturbed_chief(scenario)
    if known is not None:
        return known
    rate = scenario.orbit.rate
    return KeplerianChief.from_mean_motion(rate) if rate > 0.0 else None
