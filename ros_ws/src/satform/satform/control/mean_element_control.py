# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Continuous low-thrust control of mean relative orbital elements by a Lyapunov function.

Equations: docs/controllers/mean_elements.md.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import Number, Positive
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.control.relative_elements import elements_from_motion
from satform.numeric.elementwise import Array
from satform.orbits.inertial_motion import elements_between, nodal_elements
from satform.orbits.path_reference import Reference
from satform.orbits.predicted_chief import ChiefAtTime, PredictedChief

Elements = tuple[Number, Number, Number, Number, Number, Number]


@lru_cache(maxsize=8)
def _chief_at(chief: PredictedChief, time: float) -> ChiefAtTime:
    """The prediction, made once for all satellites that are flown as one."""
    return chief.at(time)


@dataclass(frozen=True)
class MeanElementControl(Memoryless):
    """Drives mean relative elements to wanted ones by thrust along the track and along the normal.

    Attributes:
        gain: 1/s, shape (...).
        exponent: of the cosine that concentrates thrust where it is effective, shape (...).
        longitude_rate: at which an error of the mean longitude is drifted away, 1/s, shape (...).
        wanted: relative elements, m, shape (..., 6); NaN for those of the reference.
        mean_motion: of the chief, rad/s, shape (...).
        chief: None where its plane is not known; elements are then those of free motion.
    """

    gain: Array
    exponent: Array
    longitude_rate: Array
    wanted: Array
    mean_motion: Array
    chief: PredictedChief | None

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        """Command of one step.

        Args:
            motion: measured position and velocity, LVLH.
            reference: desired position and velocity, LVLH; unused where wanted elements are given.
            memory: unused.
            step: whose time says where the chief is.

        Returns:
            Commanded acceleration; the sliding variable is zero.

        Source: Steindorf, D'Amico et al. 2017, reduced to near-circular chiefs.
        """
        now = None if self.chief is None else _chief_at(self.chief, step.time)
        acceleration = np.zeros(motion.position.shape)
        # One satellite after the other, so that each has the bits that it has alone.
        for row in np.ndindex(motion.position.shape[:-1]):
            own = Motion(motion.position[row], motion.velocity[row])
            desired = Motion(reference.position[row], reference.velocity[row])
            acceleration[row] = self._command(row, own, desired, now, step)
        return Action(acceleration, np.zeros_like(acceleration))

    def _command(
        self, row: tuple[int, ...], own: Motion, desired: Motion, now: ChiefAtTime | None, step: ControlStep
    ) -> tuple[float, float, float]:
        rate = float(self.mean_motion[row])
        argument = rate * step.time if now is None else float(now.mean.mean_argument)
        axis, ex, ey, ix, iy = self._errors(row, own, desired, now, argument)
        cosine, sine = math.cos(argument), math.sin(argument)
        in_plane, normal = axis + cosine * ex + sine * ey, cosine * ix + sine * iy
        exponent, gain = int(self.exponent[row]), float(self.gain[row])
        most = abs(axis) + math.hypot(ex, ey)
        along = -0.25 * rate * gain * _effect(in_plane, most, exponent) * in_plane
        across = -rate * gain * _effect(normal, math.hypot(ix, iy), exponent) * normal
        return 0.0, along, across

    def _errors(
        self,
        row: tuple[int, ...],
        own: Motion,
        desired: Motion,
        now: ChiefAtTime | None,
        argument: float,
    ) -> tuple[float, float, float, float, float]:
        """Errors of semi-major axis, with the drift that is wanted, e-vector and i-vector, m."""
        rate, wanted = float(self.mean_motion[row]), self.wanted[row]
        if math.isnan(wanted[0]):
            wanted = elements_from_motion(desired, np.asarray(rate), np.asarray(argument)).as_array()
        axis, longitude, ex, ey, ix, iy = (self._elements(own, rate, argument, now) - wanted).tolist()
        axis -= longitude * float(self.longitude_rate[row]) / (1.5 * rate)
        return axis, ex, ey, ix, iy

    def lyapunov(self, motion: Motion, reference: Reference, step: ControlStep) -> float:
        """Lyapunov function of one satellite: half the square of its errors.

        Args:
            motion: measured position and velocity, LVLH, shape (3,).
            reference: desired position and velocity, LVLH, shape (3,).
            step: whose time says where the chief is.

        Returns:
            m^2.
        """
        now = None if self.chief is None else _chief_at(self.chief, step.time)
        argument = float(self.mean_motion) * step.time if now is None else float(now.mean.mean_argument)
        desired = Motion(reference.position, reference.velocity)
        return 0.5 * sum(error * error for error in self._errors((), motion, desired, now, argument))

    def _elements(self, own: Motion, rate: float, argument: float, now: ChiefAtTime | None) -> Array:
        """Mean relative elements, m, shape (6,)."""
        if now is None or self.chief is None:
            return elements_from_motion(own, np.asarray(rate), np.asarray(argument)).as_array()
        state = np.concatenate(now.frame.to_inertial(own.position, own.velocity))
        return elements_between(now.mean, self.chief.mean_beside(now, nodal_elements(state)))


def _effect(projection: float, largest: float, exponent: int) -> float:
    """Even power of what thrust does here, as a share of what it does at the best argument of latitude."""
    if largest == 0.0:
        return 1.0
    effect, factor = 1.0, (projection / largest) ** 2
    for _ in range(exponent // 2):
        effect *= factor
    return effect


class MeanElementControlSpec(ControllerSpec):
    """Lyapunov control of mean relative orbital elements by low thrust along the track and the normal.

    The short-period effect of J2 is taken out of the elements, so that no thrust is spent against it.
    """

    kind: Literal["mean_relative_elements"] = "mean_relative_elements"
    gain: Positive = 1.0
    """Gain as a multiple of the chief's mean motion; with the default exponent, an error of semi-major axis,
    eccentricity vector or inclination vector alone decays at 0.5, 0.16 or 0.31 times this rate."""
    exponent: Annotated[int, Field(ge=0, le=20, multiple_of=2)] = 4
    """Even power of the cosine by which thrust is concentrated where it is effective; 0 for none."""
    longitude_orbits: Positive = 4.0
    """Time constant with which an error of the mean longitude decays, orbits."""
    elements: Elements | None = None
    """Wanted relative elements times the chief's semi-major axis, (da, dlambda, dex, dey, dix, diy), m; those
    of the reference, by the Clohessy-Wiltshire equations, when left out."""
    oblateness: bool = True
    """Whether J2 acts. Without it mean elements are the osculating ones."""

    def assumes_circular_chief(self) -> bool:
        """The effect of thrust on the elements is that about a circle."""
        return True

    def linearisation(self, setting: FlightSetting) -> str:
        """The gain turns with the error."""
        return "whose gain depends on the direction of the error and on the argument of latitude"

    def build(self, setting: FlightSetting) -> MeanElementControl:
        """The law.

        Raises:
            ValueError: with this gain a step overshoots, or the chief's orbit has no node.
        """
        motion = setting.mean_motion
        if self.gain * motion * setting.step > 1.0:
            raise ValueError(
                f"mean_relative_elements: gain {self.gain:g} with steps of {setting.step:g} s corrects more "
                f"than the error in one step; at most {1.0 / (motion * setting.step):.4g} is allowed"
            )
        chief = setting.chief
        if chief is not None and math.sin(chief.inclination) < _LEAST_SINE:
            raise ValueError(
                f"mean_relative_elements: the chief's inclination {chief.inclination:g} rad leaves its orbit "
                f"without a node; at least {_LEAST_SINE:g} rad from 0 and pi is allowed"
            )
        return MeanElementControl(
            gain=np.asarray(self.gain * motion),
            exponent=np.asarray(self.exponent),
            longitude_rate=np.asarray(motion / (math.tau * self.longitude_orbits)),
            wanted=np.full(6, np.nan) if self.elements is None else np.array(self.elements),
            mean_motion=np.asarray(motion, dtype=np.float64),
            chief=None if chief is None else PredictedChief.of(chief, oblate=self.oblateness),
        )


_LEAST_SINE = 1e-3
"""Of an inclination at which elements are computed."""
