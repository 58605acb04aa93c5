# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A linear model of relative motion over the control periods of a flight, whose matrices change with time."""

import functools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.dynamics.j2_element_model import J2ElementModel
from satform.dynamics.relative_motion_models import (
    ModelName,
    RelativeMotionModel,
    held_response,
    impulse_responses,
    quadrature_points,
    relative_motion_model,
)
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief
from satform.orbits.j2_elements import drifted

_BLOCK = 64
"""Control periods whose matrices are computed together, from a multiple of this number on.

The bits of a matrix so do not depend on who asks for it, nor on which steps were asked for before.
"""


_PANELS = 16
"""Stretches with three quadrature points each, for several control periods in a row: per revolution about a
circle, and about an ellipse by the angular velocity at perigee."""


@dataclass(frozen=True)
class StepMatrices:
    """Matrices over one control period or several; not to be changed, as others are given them too.

    Attributes:
        transition: of the state (position in m, velocity in m/s), LVLH, shape (6, 6).
        response: to an acceleration held over the period, shape (6, 3).
        impulses: effect at the end of the period of a unit velocity change at each quadrature point of it,
            shape (P, 6, 3); P is 3 for one control period.
        weights: of these points, s, shape (P,).
    """

    transition: Array
    response: Array
    impulses: Array
    weights: Array


@dataclass(frozen=True)
class StepwiseModel:
    """The linear model of a name over each control period of a flight.

    Attributes:
        name: of the model.
        chief: its orbit, by osculating elements at time zero.
        step: control period, s.
    """

    name: Literal["yamanaka_ankersen", "j2_elements"]
    chief: KeplerianChief
    step: float

    def over(self, number: int) -> StepMatrices:
        """Matrices from the step of this number to the next one.

        Args:
            number: of the step, 0 at the start of the flight.
        """
        block, row = divmod(number, _BLOCK)
        return _block(self, block)[row]

    def across(self, first: int, count: int) -> StepMatrices:
        """Matrices over several control periods in a row; the work is bounded by the revolutions in them.

        Args:
            first: number of the step at which the first of them begins.
            count: how many, at least 1.
        """
        motion, begin, end = _motion(self), self.step * first, self.step * (first + count)
        eccentricity = self.chief.eccentricity
        perigee_rate = self.chief.mean_motion * (1.0 + eccentricity) ** 2 / (1.0 - eccentricity**2) ** 1.5
        panels = min(count, math.ceil(_PANELS * (end - begin) * perigee_rate / (2.0 * math.pi)))
        edges = begin + (end - begin) / panels * np.arange(panels + 1, dtype=np.float64)
        points, weights = quadrature_points(edges[:-1], edges[1:])
        impulses = motion.transition(points.ravel(), np.full(points.size, end))[..., 3:]
        weights = weights.ravel()
        response = np.add.reduce(weights[:, None, None] * impulses, axis=0)
        return StepMatrices(motion.transition(begin, end), response, impulses, weights)


def stepwise_model(name: ModelName, chief: KeplerianChief | None, step: float) -> StepwiseModel | None:
    """The model of a name over control periods.

    Args:
        name: of the model.
        chief: its orbit; None for a circular one in an unknown plane.
        step: control period, s.

    Returns:
        None where it is that of Clohessy and Wiltshire, which is the same in all control periods:
        yamanaka_ankersen about a circular chief in an unknown plane is.

    Raises:
        ValueError: the model does not know such an orbit.
    """
    if name == "cw" or (name == "yamanaka_ankersen" and chief is None):
        return None
    if chief is None:
        raise ValueError("j2_elements needs the plane of the chief's orbit, which nothing here gives")
    model = StepwiseModel(name, chief, step)
    _motion(model)
    return model


@functools.lru_cache(maxsize=32)
def _block(model: StepwiseModel, block: int) -> tuple[StepMatrices, ...]:
    """Matrices of the steps from `block` times `_BLOCK` on."""
    motion = _motion(model)
    edges = model.step * np.arange(block * _BLOCK, (block + 1) * _BLOCK + 1, dtype=np.float64)
    begins, ends = edges[:-1], edges[1:]
    transitions = motion.transition(begins, ends)
    # Over a period J2 changes what a command does by a thousandth of what the Earth's gravity changes.
    forced, origin = motion, 0.0
    if isinstance(motion, J2ElementModel):
        origin = float(begins[0])
        forced = YamanakaAnkersenModel(drifted(motion.mean, origin))
    impulses, weights = impulse_responses(forced, begins, ends, origin)
    responses = held_response(impulses, weights)
    for array in (transitions, responses, impulses, weights):
        array.flags.writeable = False
    return tuple(
        StepMatrices(*matrices) for matrices in zip(transitions, responses, impulses, weights, strict=True)
    )


@functools.lru_cache(maxsize=8)
def _motion(model: StepwiseModel) -> RelativeMotionModel:
    """The model itself, built once."""
    return relative_motion_model(model.name, model.chief)
