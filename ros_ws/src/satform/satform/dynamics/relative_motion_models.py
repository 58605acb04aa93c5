# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Linear models of relative motion by name, with one protocol, for laws, plans and checks."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from satform.dynamics import cw
from satform.dynamics.j2_element_model import J2ElementModel
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief

ModelName = Literal["cw", "yamanaka_ankersen", "j2_elements"]

_ABSCISSAE, _WEIGHTS = np.polynomial.legendre.leggauss(3)


class RelativeMotionModel(Protocol):
    """Motion of a satellite relative to the chief, to first order in the distance."""

    def transition(self, start: float | Array, end: float | Array) -> Array:
        """State transition from one time to another.

        Args:
            start: since time zero, s, shape (...).
            end: likewise; may be before `start`.

        Returns:
            Of the state (position, velocity) in m and m/s, LVLH, shape (..., 6, 6).
        """

    def system_matrix(self, time: float | Array) -> Array:
        """Continuous-time matrix A of d(state)/dt = A state at a time in s of shape (...): (..., 6, 6)."""


@dataclass(frozen=True)
class CwModel:
    """Clohessy-Wiltshire motion about a circular orbit.

    Attributes:
        mean_motion: of the chief, rad/s.
    """

    mean_motion: float

    def transition(self, start: float | Array, end: float | Array) -> Array:
        """State transition from one time to another; as in `RelativeMotionModel.transition`."""
        duration = np.asarray(end, dtype=np.float64) - np.asarray(start, dtype=np.float64)
        coast = cw.FreeMotion.over(self.mean_motion, duration)
        above = (coast.position_from_position.matrix(), coast.position_from_velocity.matrix())
        below = (coast.velocity_from_position.matrix(), coast.velocity_from_velocity.matrix())
        return np.concatenate((np.concatenate(above, axis=-1), np.concatenate(below, axis=-1)), axis=-2)

    def system_matrix(self, time: float | Array) -> Array:
        """Continuous-time matrix, the same at all times; as in `RelativeMotionModel.system_matrix`."""
        matrix, _ = cw.system_matrices(self.mean_motion)
        return np.broadcast_to(matrix, (*np.shape(time), 6, 6)).copy()


def relative_motion_model(name: ModelName, chief: KeplerianChief) -> RelativeMotionModel:
    """The model of a name.

    Args:
        name: of the model.
        chief: its orbit, by osculating elements at time zero.

    Raises:
        ValueError: the model does not know such an orbit.
    """
    if name == "cw":
        return CwModel(chief.mean_motion)
    if name == "j2_elements":
        return J2ElementModel(chief)
    return YamanakaAnkersenModel(chief)


def impulse_responses(
    model: RelativeMotionModel, start: float | Array, end: float | Array, origin: float = 0.0
) -> tuple[Array, Array]:
    """Effect of unit velocity changes at the points of three-point Gauss-Legendre quadrature between times.

    An integral over the duration is the sum of weights times values, with an error that falls as the seventh
    power of the duration.

    Args:
        model: of the relative motion.
        start: since time zero, s, shape (...).
        end: likewise.
        origin: time zero of the model, s.

    Returns:
        Effect on the state at the end, shape (..., 3, 6, 3), and weights of the points, s, shape (..., 3).
    """
    first, last = np.broadcast_arrays(np.asarray(start, float), np.asarray(end, float))
    points, weights = quadrature_points(first, last, origin)
    ends = np.broadcast_to((last - origin)[..., None], points.shape)
    return model.transition(points, ends)[..., 3:], weights


def quadrature_points(start: Array, end: Array, origin: float = 0.0) -> tuple[Array, Array]:
    """Points and weights of three-point Gauss-Legendre quadrature between times.

    Args:
        start: since time zero, s, shape (...).
        end: likewise.
        origin: from which the points are counted, s.

    Returns:
        Times and weights, s, shape (..., 3).
    """
    half = 0.5 * (end - start)[..., None]
    return start[..., None] - origin + half * (1.0 + _ABSCISSAE), half * _WEIGHTS


def input_matrix(model: RelativeMotionModel, start: float | Array, end: float | Array) -> Array:
    """Effect on the state of an acceleration that is held in LVLH from one time to another.

    Args:
        model: of the relative motion.
        start: since time zero, s, shape (...).
        end: likewise.

    Returns:
        Shape (..., 6, 3): s^2 for the position rows, s for the velocity rows; by the quadrature of
        `impulse_responses`.
    """
    return held_response(*impulse_responses(model, start, end))


def held_response(impulses: Array, weights: Array) -> Array:
    """Effect of a held acceleration by the results of `impulse_responses`, shape (..., 6, 3)."""
    scaled = weights[..., None, None] * impulses
    effect: Array = scaled[..., 0, :, :] + scaled[..., 1, :, :] + scaled[..., 2, :, :]
    return effect
