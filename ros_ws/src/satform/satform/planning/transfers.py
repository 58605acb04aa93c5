# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Impulsive transfers: between circular orbits, and from point to point about a circular orbit.

Equations: docs/controllers/planning.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from satform.control.protocol import Motion
from satform.dynamics import cw
from satform.dynamics.relative_motion_models import RelativeMotionModel
from satform.numeric.elementwise import Array, norm

LARGEST_CONDITION = 1e8


def hohmann_delta_v(
    start_radius: float, end_radius: float, gravitational_parameter: float
) -> tuple[float, float]:
    """Speed changes of the two burns between coplanar circular orbits.

    Args:
        start_radius: m.
        end_radius: m.
        gravitational_parameter: of the central body, m^3/s^2.

    Returns:
        Magnitudes of the first and of the second burn, m/s.

    Source: Hohmann 1925; Curtis, Orbital Mechanics for Engineering Students, ch. 6.
    """
    total = start_radius + end_radius
    start_speed = math.sqrt(gravitational_parameter / start_radius)
    end_speed = math.sqrt(gravitational_parameter / end_radius)
    first = start_speed * abs(math.sqrt(2.0 * end_radius / total) - 1.0)
    second = end_speed * abs(1.0 - math.sqrt(2.0 * start_radius / total))
    return first, second


@dataclass(frozen=True)
class HohmannTransfer:
    """Two tangential burns between coplanar circular orbits.

    Attributes:
        first: speed change of the first burn along the velocity, m/s; negative to a lower orbit.
        second: likewise of the second burn.
        duration: from burn to burn, half a revolution on the transfer ellipse, s.
        semi_major_axis: of the transfer ellipse, m.
        eccentricity: of the transfer ellipse.
        lead_angle: by which a target on the end orbit leads the satellite at the first burn, so that both
            arrive together, rad; negative where it trails.
        waiting_period: time after which the same lead angle comes again, s; infinite for equal radii.
    """

    first: float
    second: float
    duration: float
    semi_major_axis: float
    eccentricity: float
    lead_angle: float
    waiting_period: float

    def delta_v(self) -> float:
        """Sum of both magnitudes, m/s."""
        return abs(self.first) + abs(self.second)


def hohmann_transfer(
    start_radius: float, end_radius: float, gravitational_parameter: float
) -> HohmannTransfer:
    """Burns, duration and phasing of the transfer between coplanar circular orbits.

    Args:
        start_radius: m.
        end_radius: m.
        gravitational_parameter: of the central body, m^3/s^2.

    Returns:
        The transfer.

    Source: Hohmann 1925; Curtis, Orbital Mechanics for Engineering Students, ch. 6 and 8.
    """
    axis = 0.5 * (start_radius + end_radius)
    up = math.copysign(1.0, end_radius - start_radius)
    first, second = hohmann_delta_v(start_radius, end_radius, gravitational_parameter)
    duration = math.pi * math.sqrt(axis**3 / gravitational_parameter)
    end_rate = math.sqrt(gravitational_parameter / end_radius**3)
    difference = abs(end_rate - math.sqrt(gravitational_parameter / start_radius**3))
    return HohmannTransfer(
        first=up * first,
        second=up * second,
        duration=duration,
        semi_major_axis=axis,
        eccentricity=abs(end_radius - start_radius) / (2.0 * axis),
        lead_angle=math.pi - end_rate * duration,
        waiting_period=math.tau / difference if difference > 0.0 else math.inf,
    )


def drift_rate(
    semi_major_axis_offset: float, semi_major_axis: float, gravitational_parameter: float
) -> float:
    """Rate at which a circular orbit's longitude runs ahead of a neighbouring circular orbit's.

    Args:
        semi_major_axis_offset: of the drifting orbit from the other, m.
        semi_major_axis: of the other orbit, m.
        gravitational_parameter: of the central body, m^3/s^2.

    Returns:
        rad/s, positive eastward, which is for the lower orbit.

    Source: Kepler's third law; its linear part is the drift of Clohessy & Wiltshire 1960.
    """
    drifting = math.sqrt(gravitational_parameter / (semi_major_axis + semi_major_axis_offset) ** 3)
    return drifting - math.sqrt(gravitational_parameter / semi_major_axis**3)


def semi_major_axis_offset_for_drift(
    rate: float, semi_major_axis: float, gravitational_parameter: float
) -> float:
    """Offset of the circular orbit that drifts at a given rate: the inverse of `drift_rate`.

    Args:
        rate: rad/s, positive eastward.
        semi_major_axis: of the orbit that is drifted along, m.
        gravitational_parameter: of the central body, m^3/s^2.

    Returns:
        m, negative for an eastward drift.
    """
    motion = math.sqrt(gravitational_parameter / semi_major_axis**3) + rate
    return float(np.cbrt(gravitational_parameter / motion**2)) - semi_major_axis


def node_crossing_rate(orbital_speed: float, inclination: float, distance: float) -> float:
    """Angular rate at which an inclined satellite passes an equatorial one at its node.

    Args:
        orbital_speed: of both, m/s.
        inclination: between the two orbits, rad.
        distance: closest, m.

    Returns:
        rad/s; infinite at no distance.

    Source: Geometry: two equal velocities at an angle differ by twice the speed times the half angle's
    sine.
    """
    speed = 2.0 * orbital_speed * math.sin(0.5 * inclination)
    return speed / distance if distance > 0.0 else math.inf


@dataclass(frozen=True)
class Transfer:
    """A coast between two impulses.

    Attributes:
        first_impulse: velocity change at the start, LVLH, m/s, shape (..., 3).
        second_impulse: velocity change on arrival, LVLH, m/s, shape (..., 3).
    """

    first_impulse: Array
    second_impulse: Array

    def delta_v(self) -> Array:
        """Sum of both magnitudes, m/s, shape (...)."""
        return norm(self.first_impulse) + norm(self.second_impulse)


def two_impulse_transfer(
    start: Motion,
    target: Motion,
    mean_motion: float,
    duration: float,
    disturbance: Array | None = None,
) -> Transfer:
    """Impulses that take a satellite from one position and velocity to another in a given time.

    Args:
        start: position (m) and velocity (m/s) before the first impulse, LVLH, each (..., 3).
        target: position (m) and velocity (m/s) after the second impulse, LVLH, each (..., 3).
        mean_motion: of the chief's orbit, rad/s.
        duration: of the coast, s.
        disturbance: constant acceleration during the coast, m/s^2, shape (..., 3); none by default.

    Returns:
        The two impulses.

    Raises:
        ValueError: the duration is not positive, or so near to a whole number of half orbits that
            the departure velocity cannot be solved for.

    Source: Clohessy & Wiltshire 1960: rendezvous in two impulses.
    """
    transition, _ = coast_to_point(mean_motion, duration)
    constant = np.zeros(3) if disturbance is None else disturbance
    return _between(start, target, transition, constant @ cw.input_matrix(mean_motion, duration).T)


def two_impulse_transfer_by_model(
    start: Motion, target: Motion, model: RelativeMotionModel, departure: float, duration: float
) -> Transfer:
    """Impulses as of `two_impulse_transfer`, by any model of relative motion, as about an eccentric chief.

    Args:
        start: position (m) and velocity (m/s) before the first impulse, LVLH, each (..., 3).
        target: position (m) and velocity (m/s) after the second impulse, LVLH, each (..., 3).
        model: of the relative motion, such as `satform.dynamics.relative_motion_models` has by name.
        departure: time of the first impulse, s.
        duration: of the coast, s.

    Returns:
        The two impulses.

    Raises:
        ValueError: the duration is not positive, or the departure velocity cannot be solved for, as for a
            whole number of orbits.

    Source: Yamanaka & Ankersen 2002 for an eccentric chief.
    """
    velocity_to_point(model, departure, duration)
    return _between(start, target, model.transition(departure, departure + duration), np.zeros(6))


def velocity_to_point(model: RelativeMotionModel, departure: float, duration: float) -> Array:
    """Effect of a velocity at departure on the position after a coast, where any point can be reached.

    Args:
        model: of the relative motion.
        departure: time at which the coast begins, s.
        duration: of the coast, s.

    Returns:
        Regular matrix, s, shape (3, 3).

    Raises:
        ValueError: the duration is not positive, or the departure velocity cannot be solved for, as for a
            whole number of orbits.
    """
    if not duration > 0.0:
        raise ValueError(f"a transfer takes a positive time, got {duration:g} s")
    effect: Array = model.transition(departure, departure + duration)[:3, 3:]
    if np.linalg.cond(effect) > LARGEST_CONDITION:
        raise ValueError(
            f"a transfer of {duration:g} s from {departure:g} s on has no two-impulse solution; choose "
            "another time, no whole number of half orbits"
        )
    return effect


def _between(start: Motion, target: Motion, transition: Array, offset: Array) -> Transfer:
    """The impulses at both ends of a coast that ends `offset` (6,) from where it would."""
    drift = start.position @ transition[:3, :3].T + offset[..., :3]
    departure = (target.position - drift) @ np.linalg.inv(transition[:3, 3:]).T
    arrival = start.position @ transition[3:, :3].T + departure @ transition[3:, 3:].T + offset[..., 3:]
    return Transfer(departure - start.velocity, target.velocity - arrival)


def coast_to_point(mean_motion: float, duration: float) -> tuple[Array, Array]:
    """Free motion over a duration after which any point can be reached by an impulse at the start.

    Args:
        mean_motion: of the chief's orbit, rad/s.
        duration: of the coast, s.

    Returns:
        Transition matrix (6, 6), and its part from velocity to position (3, 3), which is regular.

    Raises:
        ValueError: the duration is not positive, or so near to a whole number of half orbits that
            the impulse cannot be solved for.
    """
    if not duration > 0.0:
        raise ValueError(f"a transfer takes a positive time, got {duration:g} s")
    transition = cw.transition_matrix(mean_motion, duration)
    velocity_to_position = transition[:3, 3:]
    if np.linalg.cond(velocity_to_position) > LARGEST_CONDITION:
        raise ValueError(
            f"a transfer of {duration:g} s, {mean_motion * duration / (2.0 * math.pi):.6g} orbits, has no "
            "two-impulse solution; choose a time that is no whole number of half orbits"
        )
    return transition, velocity_to_position


@dataclass(frozen=True)
class Leg:
    """One coast of a tour and how it ends.

    Attributes:
        position: where it ends, LVLH, m, shape (3,).
        duration: s.
        stop: whether the satellite comes to rest in LVLH there, or passes on with one impulse.
    """

    position: Array
    duration: float
    stop: bool


def total_delta_v(impulses: Sequence[Array]) -> float:
    """Sum of the magnitudes of impulses, m/s."""
    return float(sum(np.linalg.norm(impulse) for impulse in impulses))
