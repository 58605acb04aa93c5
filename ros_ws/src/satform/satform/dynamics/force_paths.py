# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The forces of `orbital_forces` at many instants at once, for integrators that know these before.

What a force needs of an instant alone (the Earth's orientation, the positions of Sun and Moon) is computed
once, however often the satellites' motion is improved. Gravity, density and shadow come from the same
functions of brahe as in `orbital_forces`, tides and drag from the same formulas over whole arrays.
"""

from collections.abc import Callable, Sequence

import brahe
import numpy as np

from satform.dynamics.orbital_forces import (
    Body,
    Drag,
    Force,
    ForceModel,
    Gravity,
    SolarPressure,
    ThirdBodies,
    central_gravity,
    egm2008,
    gravitational_parameter,
)
from satform.numeric.elementwise import Array, cross, norm

PathForce = Callable[[Sequence[int], Array, Array, Sequence[Body]], Array]
"""Numbers of K of the instants, positions in m and velocities in m/s, shape (K, M, 3), and bodies, M or none,
to accelerations in m/s^2, shape (K, M, 3)."""


def along(model: ForceModel, times: Sequence[float]) -> PathForce:
    """All forces at given instants.

    Args:
        model: the forces.
        times: s after the epoch.
    """
    parts = [_part(force, times) for force in model.forces]

    def acceleration(
        instants: Sequence[int], position: Array, velocity: Array, bodies: Sequence[Body]
    ) -> Array:
        total = parts[0](instants, position, velocity, bodies)
        for part in parts[1:]:
            total = total + part(instants, position, velocity, bodies)
        return total

    return acceleration


def _part(force: Force, times: Sequence[float]) -> PathForce:
    match force:
        case Gravity():
            return _gravity(force, times)
        case ThirdBodies():
            return _tides(force, times)
        case Drag():
            return _drag(force, times)
        case SolarPressure():
            return _sunlight(force, times)
    return _one_by_one(force, times)


def _gravity(force: Gravity, times: Sequence[float]) -> PathForce:
    if force.degree == 0:
        parameter = gravitational_parameter()
        return lambda _instants, position, _velocity, _bodies: central_gravity(position, parameter)
    model, matrices = egm2008(), [force.rotation.matrix(time) for time in times]
    evaluate, degree, order = brahe.accel_gravity_spherical_harmonics, force.degree, force.order

    def acceleration(
        instants: Sequence[int], position: Array, _velocity: Array, _bodies: Sequence[Body]
    ) -> Array:
        result = np.empty(position.shape)
        for instant, points, rates in zip(instants, position, result, strict=True):
            matrix = matrices[instant]
            for row, point in enumerate(points):
                rates[row] = evaluate(point, matrix, model, degree, order)
        return result

    return acceleration


def _tides(force: ThirdBodies, times: Sequence[float]) -> PathForce:
    """Source: Montenbruck & Gill, Satellite Orbits, Eq. (3.37)."""
    chosen = []
    if force.sun:
        chosen.append((brahe.GM_SUN, brahe.sun_position))
    if force.moon:
        chosen.append((brahe.GM_MOON, brahe.moon_position))
    third_bodies = []
    for parameter, position_of in chosen:
        point = np.array([position_of(force.epoch + time) for time in times])[:, None]
        third_bodies.append((parameter, point, central_gravity(point, parameter)))

    def acceleration(
        instants: Sequence[int], position: Array, _velocity: Array, _bodies: Sequence[Body]
    ) -> Array:
        result = np.zeros(position.shape)
        for parameter, point, on_earth in third_bodies:
            # Towards the body, less its attraction of the Earth.
            result -= central_gravity(point.take(instants, axis=0) - position, parameter)
            result += on_earth.take(instants, axis=0)
        return result

    return acceleration


def _drag(force: Drag, times: Sequence[float]) -> PathForce:
    """Source: Montenbruck & Gill, Satellite Orbits, Eq. (3.97)."""
    densities = [force.atmosphere.at(time) for time in times]
    turning = brahe.OMEGA_EARTH * force.equator[2]

    def acceleration(
        instants: Sequence[int], position: Array, velocity: Array, bodies: Sequence[Body]
    ) -> Array:
        dense = np.array(
            [
                [densities[instant](point) for point in points]
                for instant, points in zip(instants, position, strict=True)
            ]
        )
        areas = np.array([-0.5 * body.drag_coefficient * body.drag_area / body.mass for body in bodies])
        wind = velocity - cross(turning, position)
        result: Array = (dense * areas * norm(wind))[..., None] * wind
        return result

    return acceleration


def _sunlight(force: SolarPressure, times: Sequence[float]) -> PathForce:
    suns = [brahe.sun_position(force.epoch + time) for time in times]

    def acceleration(
        instants: Sequence[int], position: Array, _velocity: Array, bodies: Sequence[Body]
    ) -> Array:
        result = np.empty(position.shape)
        for instant, points, rates in zip(instants, position, result, strict=True):
            sun = suns[instant]
            for row, (point, body) in enumerate(zip(points, bodies, strict=True)):
                pressure = brahe.accel_solar_radiation_pressure(
                    point, sun, body.mass, body.reflectivity, body.radiation_area, brahe.P_SUN
                )
                rates[row] = brahe.eclipse_conical(point, sun) * pressure
        return result

    return acceleration


def _one_by_one(force: Force, times: Sequence[float]) -> PathForce:
    """Of a force that is not one of `orbital_forces`."""

    def acceleration(
        instants: Sequence[int], position: Array, velocity: Array, bodies: Sequence[Body]
    ) -> Array:
        rows = zip(instants, position, velocity, strict=True)
        return np.array([force.acceleration(times[number], at, speed, bodies) for number, at, speed in rows])

    return acceleration
