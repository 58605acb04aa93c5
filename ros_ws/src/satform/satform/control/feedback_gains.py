# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Gain and poles of a control law close to its reference, by trying the law.

Equations: docs/stability.md.
"""

from dataclasses import dataclass

import numpy as np

from satform.control.integral_action import IntegralAction
from satform.control.lqi import Lqi
from satform.control.observer import Observed
from satform.control.protocol import Controller, ControlStep, FlightSetting, Motion
from satform.control.sampled_stability import closed_loop
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference

_TRIALS = (1.0, 1e-9)
"""Sizes of a trial in SI units: the first leaves most digits, the second is within any boundary layer."""

_SAME = 1e-6
"""Relative difference between two slopes that are the same but for rounding."""

_VANISHING = 1e-6
"""Magnitude of an eigenvalue below which what belongs to it is gone after a step."""

_NOWHERE = Reference(np.zeros(3), np.zeros(3), np.zeros(3))


@dataclass(frozen=True)
class Feedback:
    """A control law close to its reference.

    Attributes:
        gain: K of u = -K (position error, velocity error, integral of the position error), in 1/s^2, 1/s and
            1/s^3, shape (3, 6), or (3, 9) for a law with the integral as a state.
        poles: of the loop with the command held over a step, 1/s; without those of the observer.
        observer_poles: of the observer that the law flies on, 1/s. Empty without one, and for `integral`
            beside an observer, whose poles are not apart from those of the loop.
    """

    gain: Array
    poles: tuple[complex, ...]
    observer_poles: tuple[complex, ...]


def feedback(law: Controller, setting: FlightSetting) -> Feedback | None:
    """Gain and poles of a law that follows a reference.

    Args:
        law: of one satellite, as it was built.
        setting: in which it was built.

    Returns:
        What was found; None for a law that is not linear close to its reference, as one that switches.

    Source: Franklin, Powell & Workman, Digital Control of Dynamic Systems, ch. 8: an observer and the law
    that flies on it keep their own poles (separation).
    """
    observer_poles: tuple[complex, ...] = ()
    if isinstance(law, Observed):
        observer_poles = sampled_poles(observer_transition(law), setting.step)
        law = law.law
    gain, loop = state_gain(law, setting), closed_loop(law, setting)
    if gain is None or loop is None:
        return None
    return Feedback(gain, sampled_poles(loop, setting.step), observer_poles)


def observer_transition(law: Observed) -> Array:
    """How an observer's estimation error goes from one step to the next.

    Args:
        law: of one satellite; a model that changes along the chief's orbit is taken as it is at the start.

    Returns:
        Transition of the error of (position, velocity), SI units, shape (6, 6).

    Source: Luenberger 1971.
    """
    coast = law.model.coast
    transition = np.block(
        [
            [coast.position_from_position.matrix(), coast.position_from_velocity.matrix()],
            [coast.velocity_from_position.matrix(), coast.velocity_from_velocity.matrix()],
        ]
    )
    if law.motion is not None:
        transition = law.motion.over(0).transition.copy()
    transition[:, :3] -= np.vstack((law.position_gain, law.velocity_gain))
    return transition


def state_gain(law: Controller, setting: FlightSetting) -> Array | None:
    """State feedback of a law close to its reference.

    Args:
        law: of one satellite.
        setting: in which it was built.

    Returns:
        K as in `Feedback`, of a law beside integral action or on an observer that of the law alone; None for
        a law that is not linear there.
    """
    while isinstance(law, Observed | IntegralAction):
        law = law.law
    for trial in _TRIALS:
        slope, twice = _slopes(law, setting, trial), _slopes(law, setting, 2.0 * trial)
        scale = np.max(np.abs(slope), axis=0)
        if np.all(np.abs(twice - slope) <= _SAME * scale):
            gain = -slope
            return np.hstack((gain, law.integral_gain.matrix())) if isinstance(law, Lqi) else gain
    return None


def _slopes(law: Controller, setting: FlightSetting, size: float) -> Array:
    rest = np.zeros(3)
    memory = law.start(Motion(rest, rest))
    step = ControlStep(1, setting.step, rest, rest)

    def command(state: Array) -> Array:
        return law.act(Motion(state[:3], state[3:]), _NOWHERE, memory, step).acceleration

    middle = command(np.zeros(6))
    return np.stack([(command(size * unit) - middle) / size for unit in np.eye(6)], axis=-1)


def sampled_poles(transition: Array, duration: float) -> tuple[complex, ...]:
    """Poles in continuous time that belong to a transition over a step.

    Args:
        transition: shape (m, m).
        duration: over which it goes, s.

    Returns:
        ln(z) / duration for each eigenvalue z, 1/s, the slowest first; without what never changes, and
        without what is gone after a step.

    Source: Franklin, Powell & Workman, Digital Control of Dynamic Systems, ch. 2: z = exp(s T).
    """
    eigenvalues = np.linalg.eigvals(_alive(transition)).astype(complex)
    found = np.log(eigenvalues[np.abs(eigenvalues) > _VANISHING]) / duration
    # Poles whose real parts are equal but for rounding are sorted by their imaginary parts.
    digits = np.where(found.real == 0.0, 0.0, found.real)
    order = np.lexsort((np.round(found.imag, 12), [-float(f"{value:.9g}") for value in digits]))
    return tuple(complex(found[index]) for index in order)


def _alive(transition: Array) -> Array:
    """A transition without what never changes, and without what nothing depends on."""
    while True:
        idle = np.all(transition == np.eye(len(transition)), axis=1) | np.all(transition == 0.0, axis=0)
        if not np.any(idle):
            return transition
        transition = transition[np.ix_(~idle, ~idle)]
