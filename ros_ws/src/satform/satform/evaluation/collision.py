# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of collision risk: collision probability, e/i-vector separation, and passive safety.

Their models are `satform.orbits.collision_probability`, `satform.orbits.radial_normal` and
`satform.dynamics.free_drift`.
"""

import math
from collections.abc import Mapping
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from satform.common.spec import Positive, PositivePerAxis, Vector
from satform.control.protocol import FlightSetting, Motion
from satform.control.relative_elements import elements_from_motion
from satform.dynamics.free_drift import SAMPLES_PER_ORBIT, least_free_distance, least_free_distances
from satform.evaluation.pairs import Approaches, ClosestApproaches, OfPairs, between, pairs_of
from satform.evaluation.reducers import ExtremeOf, OverStretch
from satform.numeric.elementwise import Array, dot, joined
from satform.orbits.collision_probability import collision_probability
from satform.orbits.radial_normal import least_radial_normal_distance
from satform.record.flight_block import FlightBlock
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import Part, Stretch
from satform.scenario.parts import SatelliteSpec, Timing

LARGEST_ECCENTRICITY = 0.01
"""Of the chief's orbit, up to which the Clohessy-Wiltshire equations are used."""

MOST_FREE_SAMPLES = 500_000_000
"""Instants of free motion, of all states and pairs, that passive safety computes: some minutes."""

_MOTION = ("position", "velocity")


class CollisionProbability(OfPairs):
    """Probability that two satellites collide at their closest approach, the largest of the pairs.

    Foster's integral in the encounter plane, across the relative velocity in inertial space. The relative
    position has a normal distribution about the true one, whose covariance is given, or is the sum of those
    of both satellites' filters.
    """

    figure_name = "collision probability"
    kind: Literal["collision_probability"] = "collision_probability"
    combined_radius: Positive
    """Sum of the radii of the two satellites, each taken as a sphere, m."""
    standard_deviation: PositivePerAxis | None = None
    """Of the relative position, in LVLH, m; uncorrelated axes."""
    covariance: tuple[Vector, Vector, Vector] | None = None
    """Of the relative position, in LVLH, by rows, m^2. When neither this nor `standard_deviation` is given,
    the filters of both satellites give it at the closest approach."""

    @model_validator(mode="after")
    def _one_covariance(self) -> "CollisionProbability":
        if self.standard_deviation is not None and self.covariance is not None:
            raise ValueError("give standard_deviation or covariance, not both")
        if self.covariance is not None:
            matrix = np.array(self.covariance)
            if (matrix != matrix.T).any() or np.linalg.eigvalsh(matrix)[0] <= 0.0:
                raise ValueError("covariance has to be symmetric and positive definite")
        return self

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        found = super().complaints_about_satellites(satellites, announces)
        if self._matrix() is not None:
            return found
        bare = [name for name in self.satellites or satellites if not satellites[name].estimates_motion]
        if bare:
            have = "has" if len(bare) == 1 else "have"
            found.append(
                f"{', '.join(bare)} {have} no filter, whose covariance would be used; give "
                "standard_deviation or covariance"
            )
        return found

    def reducer(self, flight: FlightShape) -> Reducer:
        matrix = self._matrix()
        stretch = self.stretch(flight, flight.states, of_bodies=True)
        figure = partial(self._largest, matrix=matrix, settings=flight.settings)
        return ClosestApproaches(stretch, flight.step, figure, covariances=matrix is None)

    def _matrix(self) -> Array | None:
        if self.covariance is not None:
            return np.array(self.covariance)
        return None if self.standard_deviation is None else np.diag(np.square(self.standard_deviation))

    def _largest(self, found: Approaches, matrix: Array | None, settings: tuple[FlightSetting, ...]) -> Array:
        """The largest probability of each run's pairs, shape (R,)."""
        runs, pairs = found.time.shape
        across = _across(found.separation, inertial_velocity(found, settings))
        probabilities = np.empty((runs, pairs))
        for run, pair in np.ndindex(runs, pairs):
            covariance = found.covariance[run, pair] if matrix is None else matrix
            probabilities[run, pair] = collision_probability(
                found.separation[run, pair], across[run, pair], covariance, self.combined_radius
            )
        return np.asarray(probabilities.max(axis=1))


class RadialNormalDistance(OfPairs):
    """Least distance of two satellites in the radial/normal plane over a revolution, in m.

    The separation of relative eccentricity and inclination vectors, from the osculating relative elements of
    each state; the least of the stretch and of the pairs. The chief's orbit has to be nearly circular.
    """

    unit = "m"
    figure_name = "least radial/normal distance of a revolution"
    kind: Literal["radial_normal_distance"] = "radial_normal_distance"

    def holds_in_part(self) -> bool:
        return self.extreme_holds_in_part("minimum")

    def orbit_complaints(self, setting: FlightSetting, timing: Timing) -> list[str]:
        return _of_circular_chief(setting)

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.states, of_bodies=True)
        figure = partial(radial_normal_distances, pairs=pairs_of(stretch), rates=flight.mean_motions[:, None])
        return ExtremeOf(stretch, _motion, _MOTION, which="minimum", transform=figure)


class PassiveSafety(OfPairs):
    """Least distance of two satellites over some orbits if all thrust stopped, in m.

    Free motion without perturbations from every k-th state of the stretch, by the Clohessy-Wiltshire
    equations, about an eccentric chief by those of Yamanaka and Ankersen; the least of all states and pairs.
    """

    unit = "m"
    kind: Literal["passive_safety"] = "passive_safety"
    orbits: Annotated[float, Field(gt=0.0, le=1000.0)]
    """Orbits of free motion after thrust has stopped."""
    every: Annotated[int, Field(ge=1, le=1_000_000)] = 10
    """Steps from a state whose free motion is computed to the next one."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = super().complaints(satellites, timing)
        count = len(satellites) if self.satellites is None else len(self.satellites)
        end = timing.duration if self.before is None else self.before
        states = 1 + math.floor((end - self.after) / timing.step) // self.every
        samples = math.comb(count, 2) * states * max(1, math.ceil(self.orbits * SAMPLES_PER_ORBIT))
        if not own and samples > MOST_FREE_SAMPLES:
            every, pairs = math.ceil(self.every * samples / MOST_FREE_SAMPLES), math.comb(count, 2)
            own.append(
                f"free motion over {self.orbits:g} orbits from {states} states of {pairs} pairs is "
                f"{samples:.2g} samples, and at most {MOST_FREE_SAMPLES:.0e} are computed: give every at "
                f"least {every}, or fewer orbits or satellites"
            )
        return own

    def holds_in_part(self) -> bool:
        return self.extreme_holds_in_part("minimum")

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.states, of_bodies=True)
        return _LeastFreeDistance(stretch, flight, self.orbits, self.every)

    def describe(self) -> str:
        orbits = "1 orbit" if self.orbits == 1.0 else f"{self.orbits:g} orbits"
        return self.label or f"least distance over {orbits} without thrust{self.when()}{self.whose()}"


class _LeastFreeDistance(OverStretch):
    """The least distance of free motion from every k-th state of a stretch on."""

    def __init__(self, stretch: Stretch, flight: FlightShape, orbits: float, every: int) -> None:
        super().__init__(stretch, _motion, _MOTION)
        self._pairs, self._first, self._step = pairs_of(stretch), stretch.first, flight.step
        self._rates, chiefs = flight.mean_motions[:, None], [own.chief for own in flight.settings]
        self._eccentric = {run: own for run, own in enumerate(chiefs) if own and own.eccentricity > 0.0}
        self._orbits, self._every = orbits, every
        self._least: Array = np.full((), np.inf)

    def take(self, part: Part) -> None:
        skipped = (self._first - part.first) % self._every
        values = part.values[skipped :: self._every]
        if not len(values):
            return
        apart = between(values, self._pairs)
        distance = np.empty(apart.shape[:-1])
        circular = [run for run in range(apart.shape[1]) if run not in self._eccentric]
        if circular:
            own, rates = apart[:, circular], np.broadcast_to(self._rates, (apart.shape[1], 1))[circular]
            distance[:, circular], _ = least_free_distance(own[..., :3], own[..., 3:], rates, self._orbits)
        steps = part.first + skipped + self._every * np.arange(len(values))
        times = np.asarray(self._step * steps, dtype=np.float64)
        for run, chief in self._eccentric.items():
            own = apart[:, run]
            distance[:, run] = least_free_distances(chief, times, own[..., :3], own[..., 3:], self._orbits)
        self._least = np.minimum(self._least, distance.min(axis=(0, 2)))

    def found(self) -> Array:
        return self._least


def _motion(block: FlightBlock) -> Array:
    """Position and velocity side by side, shape (rows, R, N, 6)."""
    return np.concatenate((block.position, block.velocity), axis=-1)


def radial_normal_distances(values: Array, pairs: tuple[tuple[int, int], ...], rates: Array) -> Array:
    """Least distance in the radial/normal plane of each pair over a revolution, m, shape (..., P).

    Args:
        values: position and velocity, LVLH, m and m/s, shape (..., columns, 6).
        pairs: P of them, by positions among the columns.
        rates: mean motion of the chief, rad/s, broadcast against (..., P).
    """
    apart = between(values, pairs)
    # Where the chief is on its orbit turns both vectors alike, which leaves the distance as it is.
    elements = elements_from_motion(Motion(apart[..., :3], apart[..., 3:]), rates, np.zeros(()))
    return least_radial_normal_distance(elements.as_array())


def inertial_velocity(found: Approaches, settings: tuple[FlightSetting, ...]) -> Array:
    """Relative velocity against inertial space, in LVLH components.

    Args:
        found: R runs with P pairs each, with velocities in the rotating frame.
        settings: of each run; none where the chief is not known.

    Returns:
        m/s, shape (R, P, 3); NaN where the chief is not known.
    """
    rates = np.full(found.time.shape, np.nan)
    for run, setting in enumerate(settings):
        chief, times = setting.chief, found.time[run].tolist()
        if chief is None or chief.eccentricity == 0.0:
            rates[run] = setting.mean_motion
        else:
            rates[run] = [chief.angular_rate(time) if math.isfinite(time) else math.nan for time in times]
    x, y = found.separation[..., 0], found.separation[..., 1]
    return found.velocity + joined(-rates * y, rates * x, np.zeros_like(rates))


def _across(separation: Array, velocity: Array) -> Array:
    """The part of a relative velocity across the separation, m/s, shape (..., 3).

    At a closest approach it is all of it. Where the stretch begins or ends while two satellites come nearer
    or move apart, the separation has its full length in the plane across this part.
    """
    squared = dot(separation, separation)
    ratio = dot(velocity, separation) / np.where(squared > 0.0, squared, 1.0)
    part: Array = velocity - separation * ratio[..., None]
    return part


def _of_circular_chief(setting: FlightSetting) -> list[str]:
    chief = setting.chief
    if chief is None or chief.eccentricity <= LARGEST_ECCENTRICITY:
        return []
    return [
        f"the figure is that of a nearly circular chief, up to eccentricity {LARGEST_ECCENTRICITY:g}; the "
        f"chief's is {chief.eccentricity:g}"
    ]
