# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Relative orbital elements, and a low-gain control law on them.

The elements are those of a satellite near a chief on a circular orbit, multiplied by the chief's
semi-major axis and therefore in m: offset of the semi-major axis, of the mean longitude, and the vectors
of relative eccentricity and relative inclination.

The control law uses osculating elements, from position and velocity by the Clohessy-Wiltshire
equations; it neither averages nor models J2, so that it also works against the periodic effect.

Equations: docs/controllers/relative_elements.md.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.common.spec import Positive
from satform.control.lqr import holding_acceleration
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.control.sampled_stability import require_stable_hold
from satform.dynamics import cw
from satform.numeric.elementwise import Array, joined
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class RelativeElements:
    """Relative orbit elements times the chief's semi-major axis.

    Attributes:
        semi_major_axis: offset of the deputy's from the chief's, m, shape (...).
        mean_longitude: offset, m, shape (...).
        eccentricity: vector difference, m, shape (..., 2).
        inclination: vector difference, m, shape (..., 2).
    """

    semi_major_axis: Array
    mean_longitude: Array
    eccentricity: Array
    inclination: Array

    def as_array(self) -> Array:
        """All six in order, m, shape (..., 6)."""
        scalars = (self.semi_major_axis[..., None], self.mean_longitude[..., None])
        return np.concatenate((*scalars, self.eccentricity, self.inclination), axis=-1)

    @classmethod
    def from_array(cls, elements: Array) -> "RelativeElements":
        """The elements from six values in order, m, shape (..., 6)."""
        return cls(elements[..., 0], elements[..., 1], elements[..., 2:4], elements[..., 4:6])


def elements_from_motion(motion: Motion, mean_motion: Array, argument: Array) -> RelativeElements:
    """Relative elements of a motion in LVLH.

    Args:
        motion: position (m) and velocity (m/s), LVLH, each (..., 3).
        mean_motion: of the chief, rad/s, shape (...).
        argument: of the chief's latitude, rad, shape (...).

    Returns:
        The elements, to first order in the distance.

    Source: D'Amico & Montenbruck 2006: relative eccentricity and inclination vectors.
    """
    x, y, z = motion.position[..., 0], motion.position[..., 1], motion.position[..., 2]
    scaled_velocity = motion.velocity / np.asarray(mean_motion)[..., None]
    cosine, sine = np.cos(argument), np.sin(argument)
    ahead = 3.0 * x + 2.0 * scaled_velocity[..., 1]
    return RelativeElements(
        semi_major_axis=x + ahead,
        mean_longitude=y - 2.0 * scaled_velocity[..., 0],
        eccentricity=joined(
            ahead * cosine + scaled_velocity[..., 0] * sine, ahead * sine - scaled_velocity[..., 0] * cosine
        ),
        inclination=joined(
            z * sine + scaled_velocity[..., 2] * cosine, scaled_velocity[..., 2] * sine - z * cosine
        ),
    )


def motion_from_elements(elements: RelativeElements, mean_motion: Array, argument: Array) -> Motion:
    """Motion in LVLH from relative elements: the inverse of `elements_from_motion`.

    Args:
        elements: m.
        mean_motion: of the chief, rad/s, shape (...).
        argument: of the chief's latitude, rad, shape (...).

    Returns:
        Position (m) and velocity (m/s), LVLH, each (..., 3).

    Source: D'Amico & Montenbruck 2006.
    """
    cosine, sine = np.cos(argument), np.sin(argument)
    ex, ey = elements.eccentricity[..., 0], elements.eccentricity[..., 1]
    ix, iy = elements.inclination[..., 0], elements.inclination[..., 1]
    ahead, outward = ex * cosine + ey * sine, ex * sine - ey * cosine
    axis = elements.semi_major_axis
    position = (axis - ahead, elements.mean_longitude + 2.0 * outward, ix * sine - iy * cosine)
    scaled_velocity = (outward, 2.0 * ahead - 1.5 * axis, ix * cosine + iy * sine)
    return Motion(joined(*position), joined(*scaled_velocity) * np.asarray(mean_motion)[..., None])


@dataclass(frozen=True)
class ElementControl(Memoryless):
    """Drives the relative elements of the error to zero along their own gradients.

    Linear in position and velocity as they are, the law is a linear feedback of both.

    Attributes:
        gain: 1/s, shape (...).
        mean_motion: of the chief, rad/s, shape (...).
        longitude_rate: at which an error of the mean longitude is drifted away, 1/s, shape (...).
        natural: acceleration of free relative motion.
        feedforward: whether the command that holds the reference is added.
    """

    gain: Array
    mean_motion: Array
    longitude_rate: Array
    natural: cw.NaturalAcceleration
    feedforward: bool

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        """Command of one step.

        Args:
            motion: measured position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: unused.
            step: unused.

        Returns:
            Commanded acceleration; the sliding variable is zero.

        Source: Gauss's equations for a near-circular orbit, D'Amico & Montenbruck 2006; the longitude is
        led home by an offset of the semi-major axis as in Steindorf, D'Amico et al. 2017. The argument
        of latitude cancels between elements and equations.
        """
        position = motion.position - reference.position
        velocity = motion.velocity - reference.velocity
        scaled_velocity = velocity / self.mean_motion[..., None]
        ahead = 3.0 * position[..., 0] + 2.0 * scaled_velocity[..., 1]
        longitude = position[..., 1] - 2.0 * scaled_velocity[..., 0]
        wanted_axis = longitude * (self.longitude_rate / (1.5 * self.mean_motion))
        axis_error = position[..., 0] + ahead - wanted_axis
        along = 2.0 * self.mean_motion * (axis_error + ahead)
        feedback = joined(velocity[..., 0], along, velocity[..., 2])
        acceleration = -self.gain[..., None] * feedback
        if self.feedforward:
            acceleration = acceleration + holding_acceleration(reference, self.natural)
        return Action(acceleration, np.zeros_like(acceleration))


class ElementControlSpec(ControllerSpec):
    """Low-gain feedback of relative orbital elements; natural relative motion is left uncontrolled.

    The elements are osculating, by the Clohessy-Wiltshire equations, not mean elements.
    """

    kind: Literal["relative_elements"] = "relative_elements"
    gain: Positive = 0.3
    """Gain as a multiple of the chief's mean motion: for small gains the errors of semi-major axis,
    eccentricity vector and inclination vector decay at 4, 2.5 and 0.5 times this rate."""
    longitude_orbits: Positive = 1.0
    """Time constant with which an error of the mean longitude decays, orbits."""
    feedforward: bool = False
    """Whether the command that holds the reference is added; needed where it is not free motion."""

    def assumes_circular_chief(self) -> bool:
        """Its model is that of Clohessy and Wiltshire."""
        return True

    def build(self, setting: FlightSetting) -> ElementControl:
        """The law.

        Raises:
            ValueError: with these gains the loop does not decay.
        """
        motion = setting.mean_motion
        law = ElementControl(
            gain=np.asarray(self.gain * motion),
            mean_motion=np.asarray(motion, dtype=np.float64),
            longitude_rate=np.asarray(motion / (2.0 * math.pi * self.longitude_orbits)),
            natural=cw.natural_acceleration(motion),
            feedforward=self.feedforward,
        )
        nowhere = Reference(np.zeros(3), np.zeros(3), np.zeros(3))
        units = np.eye(6)
        step = ControlStep(0, setting.step)
        commands = law.act(Motion(units[:, :3], units[:, 3:]), nowhere, None, step).acceleration
        transition = cw.transition_matrix(motion, setting.step)
        held = cw.input_matrix(motion, setting.step)
        require_stable_hold(transition + held @ commands.T, "relative_elements", setting.step)
        return law
