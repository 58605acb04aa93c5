# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear relative motion under J2 about a chief of any eccentricity, by mean relative elements.

Mean relative elements change by `satform.orbits.j2_elements`; they become position and velocity by the
derivative of the mean-to-osculating map of J2 and of Kepler's equations, taken by central differences.

Equations: docs/controllers/eccentric.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.frames import chief_frame
from satform.orbits.j2_elements import as_array, drifted, element_transition, oblate_acceleration
from satform.orbits.mean_elements import mean_chief, osculating_elements

_PROBE = 1e-5
"""Size of a relative element that is tried: its square is far above rounding and its cube below."""

_RATE_PROBE = 2e-5
"""Part of an orbit over which the rate of the transition is taken."""

LOWEST_INCLINATION = 1e-3
"""To the equator, rad, from which the node is well defined."""


@dataclass(frozen=True)
class J2ElementModel:
    """Relative motion under the Earth's oblateness, to first order in the distance and in J2.

    Attributes:
        osculating: the chief's orbit by osculating elements at time zero.
    """

    osculating: KeplerianChief

    def __post_init__(self) -> None:
        """Refuse an orbit in the equator, whose node is undefined.

        Raises:
            ValueError: the inclination is too near to 0 or pi.
        """
        if math.sin(self.osculating.inclination) < LOWEST_INCLINATION:
            raise ValueError(
                f"j2_elements: the chief's inclination of {self.osculating.inclination:g} rad leaves the "
                "node undefined; use yamanaka_ankersen"
            )

    @cached_property
    def mean(self) -> KeplerianChief:
        """The chief's mean elements at time zero."""
        return mean_chief(self.osculating)

    def transition(self, start: float | Array, end: float | Array) -> Array:
        """State transition from one time to another.

        Args:
            start: since time zero, s, shape (...).
            end: likewise; may be before `start`.

        Returns:
            Of the state (position, velocity) in m and m/s, LVLH, shape (..., 6, 6). The velocity is taken in
            the frame as it truly turns.

        Source: Koenig, Guffanti & D'Amico 2017.
        """
        first, last = np.broadcast_arrays(np.asarray(start, float), np.asarray(end, float))
        # The end of one step is the start of the next: each instant is computed once.
        instants, places = np.unique(np.concatenate((first.ravel(), last.ravel())), return_inverse=True)
        chiefs = [drifted(self.mean, instant) for instant in instants.tolist()]
        motions = motions_from_mean_elements(chiefs)
        found = []
        for begin, finish in zip(*np.split(places, 2), strict=True):
            duration = float(instants[finish] - instants[begin])
            moved = motions[finish] @ element_transition(chiefs[begin], duration)
            found.append(np.linalg.solve(motions[begin].T, moved.T).T)
        return np.asarray(found, dtype=np.float64).reshape(*first.shape, 6, 6)

    def system_matrix(self, time: float | Array) -> Array:
        """Continuous-time matrix A of d(state)/dt = A state at a time in s of shape (...): (..., 6, 6)."""
        middle = np.asarray(time, dtype=np.float64)
        half = _RATE_PROBE * self.mean.period
        rate = (self.transition(middle, middle + half) - self.transition(middle, middle - half)) / (
            2.0 * half
        )
        rate[..., :3, :3], rate[..., :3, 3:] = 0.0, np.eye(3)
        return rate


def motions_from_mean_elements(chiefs: Sequence[KeplerianChief]) -> list[Array]:
    """Map of small mean relative elements to motion, at one instant of each of several orbits.

    Args:
        chiefs: by mean elements at that instant.

    Returns:
        Of each shape (6, 6): of (da, dlambda, dex, dey, dix, diy), dimensionless, to position in m and
        velocity in m/s, LVLH.
    """
    import brahe  # noqa: PLC0415  slow to import, and few scenarios need this model

    radians: Any = brahe.AngleFormat.RADIANS
    tried = np.concatenate((_PROBE * np.eye(6), -_PROBE * np.eye(6)))
    rows = []
    for chief in chiefs:
        own = as_array(chief)
        own[3:] = np.remainder(own[3:], math.tau)
        rows += [own[None], brahe.state_roe_to_oe(own, tried, radians)]
    osculating = osculating_elements(np.concatenate(rows))
    osculating[:, 3:] = np.remainder(osculating[:, 3:], math.tau)
    found = []
    for states in np.split(brahe.state_koe_to_eci(osculating, radians), len(chiefs)):
        position, velocity = states[:, :3], states[:, 3:]
        acceleration = oblate_acceleration(position[0], GRAVITATIONAL_PARAMETER)
        frame = chief_frame(position[0], velocity[0], acceleration)
        moved = np.concatenate(frame.to_lvlh(position[1:], velocity[1:]), axis=-1)
        found.append(np.asarray((moved[:6] - moved[6:]).T / (2.0 * _PROBE), dtype=np.float64))
    return found
