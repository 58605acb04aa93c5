# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Error that an integrator makes on a chief's orbit, from two-body motion whose solution is known."""

import math
from dataclasses import dataclass

import numpy as np

from satform.dynamics.collocation import Collocation, accelerations, change
from satform.dynamics.cw_error import two_body
from satform.dynamics.integrators import Adaptive, FixedStep, substeps
from satform.numeric.elementwise import Array, dot
from satform.orbits.chief import KeplerianChief
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.frames import chief_frame

_MOST_STEPS = 400
"""Steps that are integrated; the error of shorter ones follows from the method's order."""


@dataclass(frozen=True)
class IntegrationError:
    """Largest error within the time looked at.

    Attributes:
        inertial: of positions in inertial space, m.
        relative: of the satellite's position relative to the chief, m.
    """

    inertial: float
    relative: float


def integration_error(
    integrator: FixedStep | Adaptive | Collocation,
    step: float,
    chief: KeplerianChief,
    position_lvlh: Array,
    duration: float,
) -> IntegrationError:
    """Error of an integrator under point-mass gravity.

    Args:
        integrator: fixed step, adaptive, or collocation.
        step: control period, s, which no sub-step exceeds; steps of collocation are whole numbers of it.
        chief: its orbit.
        position_lvlh: of a satellite at the start, m, LVLH, shape (3,); at rest in the rotating frame.
        duration: looked at, s.

    Returns:
        The largest errors at the ends of steps. For a fixed step that is too short to be tried out it is
        extrapolated from a longer one by the order of the method.
    """
    frame = chief_frame(*chief.state_in_own_axes())
    satellite = frame.to_inertial(position_lvlh, np.zeros(3))
    start = np.stack(
        (np.stack((frame.origin_position, satellite[0])), np.stack((frame.origin_velocity, satellite[1])))
    )
    if isinstance(integrator, Adaptive):
        return _difference(start, *_adaptive(integrator, start, duration))
    if isinstance(integrator, Collocation):
        periods, parts = integrator.division(step)
        return _difference(start, *_by_collocation(start, periods * step / parts, duration))
    length = step / substeps(step, integrator.maximum_step)
    tried = max(length, duration / _MOST_STEPS)
    found = _difference(start, *_fixed(integrator, start, tried, max(1, math.ceil(duration / tried - 1e-9))))
    scale = (length / tried) ** integrator.tableau.order
    return IntegrationError(scale * found.inertial, scale * found.relative)


def _gravity(_time: float, motion: Array | tuple[Array, Array]) -> Array:
    position = motion[0]
    squared = dot(position, position)
    gravity = position * (-GRAVITATIONAL_PARAMETER / (squared * np.sqrt(squared)))[..., None]
    return np.stack((motion[1], gravity))


def _fixed(integrator: FixedStep, start: Array, length: float, count: int) -> tuple[Array, Array]:
    """Times in s, shape (n,), and motion at the ends of equal steps, shape (n, 2, 2, 3)."""
    whole = FixedStep(integrator.tableau, length)
    motion, remainder = start, np.zeros_like(start)
    flown = np.empty((count, *start.shape))
    for index in range(count):
        motion, remainder = whole.advance(_gravity, 0.0, motion, remainder, length)
        flown[index] = motion
    return length * np.arange(1.0, count + 1.0), flown


def _adaptive(integrator: Adaptive, start: Array, duration: float) -> tuple[Array, Array]:
    """The same at equal times within the duration."""
    times = np.linspace(0.0, duration, 33)[1:]
    flown = np.empty((len(times), *start.shape))
    for row in range(start.shape[1]):
        solution, _ = integrator.solve(_gravity, 0.0, start[:, row], duration)
        flown[:, :, row] = np.array([solution(time).reshape(2, 3) for time in times])
    return times, flown


def _by_collocation(start: Array, length: float, duration: float) -> tuple[Array, Array]:
    """The same at the ends of long steps; not a number from where the iteration does not converge."""
    count = max(1, math.ceil(duration / length - 1e-9))
    motion, flown = start, np.empty((count, *start.shape))
    for index in range(count):
        rates, _ = accelerations(
            motion, length, lambda _nodes, position, velocity, _rows: _gravity(0.0, (position, velocity))[1]
        )
        motion = motion + change((1.0,), length, motion[1], rates)[0]
        flown[index] = motion
    return length * np.arange(1.0, count + 1.0), flown


def _difference(start: Array, times: Array, flown: Array) -> IntegrationError:
    errors = []
    for row in range(start.shape[1]):
        truth = two_body(start[0, row], start[1, row], times)
        if truth is None:
            return IntegrationError(math.inf, math.inf)
        errors.append(flown[:, 0, row] - truth[0])
    if not np.isfinite(errors).all():
        return IntegrationError(math.inf, math.inf)
    inertial = max(float(np.max(np.linalg.norm(error, axis=-1))) for error in errors)
    return IntegrationError(inertial, float(np.max(np.linalg.norm(errors[1] - errors[0], axis=-1))))
