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


def input_matrix(model: RelativeMotionModel, start: float | Array, end: float | Array) -> Array:
    """Effect on the state of an acceleration that is held in LVLH from one time to another.

    Args:
        model: of the relative motion.
        start: since time zero, s, shape (...).
        end: likewise.

    Returns:
        Shape (..., 6, 3): s^2 for the position rows, s for the velocity rows. The integral is taken by
        three-point Gauss-Legendre quadrature, so that its error falls as the seventh power of the duration.
    """
    first, last = np.broadcast_arrays(np.asarray(start, float), np.asarray(end, float))
    abscissae, weights = np.polynomial.legendre.leggauss(3)
    half = 0.5 * (last - first)
    effect = np.zeros((*first.shape, 6, 3))
    for abscissa, weight in zip(abscissae.tolist(), weights.tolist(), strict=True):
        response = model.transition(first + half * (1.0 + abscissa), last)
        effect += (weight * half)[..., None, None] * response[..., 3:]
    return effect
