# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The flight software of a satellite's attitude: measurement, pointing, commanded torque."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from satform.attitude.attitude_filter import AttitudeMemory
from satform.attitude.attitude_filter_spec import AttitudeFilterSpec
from satform.attitude.ground_pointing import (
    AttitudeReference,
    CircularOrbit,
    GroundPointing,
    GroundPointingSpec,
)
from satform.attitude.gyrostat import AttitudeState, gravity_gradient_torque
from satform.attitude.mrp_tracking import AttitudeTracking, AttitudeTrackingSpec
from satform.attitude.satellite_pointing import SatellitePointing, SatellitePointingSpec
from satform.attitude.yaw_steering import Mask
from satform.common.spec import Positive, Spec, Vector
from satform.communication.messages import NeighbourStates
from satform.consensus.arc_length import NeighbourPhases
from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, Indices, constant, cross
from satform.numeric.modified_rodrigues import direction_cosines
from satform.numeric.recorded_arrays import Recorded
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.path_reference import FeedForward, Path, Reference

_BLOCK = 256
"""Steps whose references are worked out at once, where they depend on time alone."""


@dataclass(frozen=True)
class Attitude:
    """Measured attitude of a satellite.

    Attributes:
        mrp: inertial to body, modified Rodrigues parameters, shape (..., 3).
        angular_velocity: of the body, body components, rad/s, shape (..., 3).
        wheel_momentum: absolute, of each wheel about its spin axis, N m s, shape (..., 3).
    """

    mrp: Array
    angular_velocity: Array
    wheel_momentum: Array


@dataclass(frozen=True)
class EstimatedAttitude:
    """What a satellite knows of its attitude by its filter.

    Attributes:
        memory: of the filter.
        attitude: by which the satellite flies.
    """

    memory: AttitudeMemory
    attitude: Attitude

    def parts(self) -> tuple[Array, ...]:
        """Attitude, angular velocity, gyro bias, covariance, innovation and rejected readings."""
        now = self.memory.now
        rate = self.attitude.angular_velocity
        covariance = now.covariance[..., :6, :6]
        return now.mrp, rate, now.bias, covariance, now.innovation, now.rejected

    def numbers(self) -> Array:
        """The same of one satellite as one vector, the covariance row by row, shape (47,)."""
        return np.concatenate([np.ravel(part) for part in self.parts()])


@dataclass(frozen=True)
class Target:
    """The satellite that is pointed at, as the one that points knows it.

    Attributes:
        path: on which it flies.
        phase_offset: generalised arc length by which it leads the agreement, m, shape (...).
        satellite: index of the target in the scenario, shape (...).
        row: of the target among the in-neighbours, shape (...).
        planned_phase: of the target at time zero by its flight plan, its offset left out, m, shape (...).
        planned_rate: of its generalised arc length at time zero by its flight plan, m/s, shape (...).
    """

    path: Path
    phase_offset: Array
    satellite: Indices
    row: Indices
    planned_phase: Array
    planned_rate: Array

    def among(self, neighbours: Sequence[int]) -> "Target":
        """The same target, of one satellite, in another list of in-neighbours."""
        return replace(self, row=np.asarray(neighbours.index(int(self.satellite)), dtype=np.int64))

    def reference(
        self, neighbour_states: NeighbourPhases, time: float, neighbour_timeout: Array | float
    ) -> tuple[Reference, Mask]:
        """Where the target is to be, from its newest message that counts.

        The phase is extrapolated by its stamp and rate, as the consensus law does. While no message
        counts, the flight plan stands for one that was sent at time zero.

        Args:
            neighbour_states: from the neighbours, with weight zero for those whose newest message is too old.
            time: simulated, s.
            neighbour_timeout: age of a message from which on it no longer counts, s.

        Returns:
            Desired motion of the target, and whether it is known: any finite one where it is not.
        """
        row = self.row[..., None]
        phase, rate, stamp, weight = (
            np.take_along_axis(values, row, axis=-1)[..., 0]
            for values in (
                neighbour_states.arc_length,
                neighbour_states.rate,
                neighbour_states.stamp,
                neighbour_states.weight,
            )
        )
        counts = weight > 0.0
        if not np.all(counts):
            phase = np.where(counts, phase, self.planned_phase)
            rate = np.where(counts, rate, self.planned_rate)
            stamp = np.where(counts, stamp, 0.0)
        phase = phase + (time - stamp) * rate
        known: Mask = counts | (time <= neighbour_timeout)
        return self.path.reference(phase + self.phase_offset, rate, np.zeros_like(rate)), known


@dataclass(frozen=True)
class Orientation:
    """Pointing and the law that keeps to it; arrays carry a leading axis when many fly as one.

    Attributes:
        law: with the body that it flies.
        pointing: at a place on the ground or at another satellite.
        target: the other satellite; None for a place on the ground.
        gravity_gradient: whether the Earth's torque acts and is compensated.
        start: attitude and momenta at the first step.
    """

    law: AttitudeTracking
    pointing: GroundPointing | SatellitePointing
    target: Target | None
    gravity_gradient: bool
    start: AttitudeState

    @property
    def orbit(self) -> CircularOrbit:
        """The orbit from which the Earth pulls."""
        return self.pointing.orbit

    def external(self, mrp: Array, time: Array) -> Array:
        """Torque of gravity on the satellite, taken at the chief.

        Args:
            mrp: attitude, shape (..., 3).
            time: s, shape (...).

        Returns:
            Body components, N m, shape (..., 3).
        """
        if not self.gravity_gradient:
            return np.zeros_like(mrp)
        radius = np.asarray(self.orbit.radius)
        down = multiply(direction_cosines(mrp), -self.orbit.position(time).value / radius[..., None])
        return gravity_gradient_torque(self.law.body.inertia, down, radius, GRAVITATIONAL_PARAMETER)

    def acceleration(self, earlier: Attitude, wheel_momentum: Array, time: Array, step: float) -> Array:
        """Mean angular acceleration of the rigid body over a control period.

        By Euler's equation, with the rate at the middle of the period from that at its start.

        Args:
            earlier: attitude, rate and momentum of the wheels at the start of the period.
            wheel_momentum: measured at its end, N m s, shape (..., 3).
            time: at its start, s, shape (...).
            step: control period, s.

        Returns:
            Body components, rad/s^2, shape (..., 3).
        """
        body, taken = self.law.body, (wheel_momentum - earlier.wheel_momentum) / step
        middle = 0.5 * (earlier.wheel_momentum + wheel_momentum)
        rate, torque = earlier.angular_velocity, self.external(earlier.mrp, time) - taken
        found = np.zeros_like(rate)
        for _ in range(2):
            turning = rate + 0.5 * step * found
            momentum = multiply(body.platform_inertia, turning) + middle
            found = multiply(body.inverse_platform_inertia, cross(momentum, turning) + torque)
        return found

    def estimated(
        self, memory: AttitudeMemory, wheel_momentum: Array, earlier_momentum: Array, time: Array, step: float
    ) -> Attitude:
        """Attitude and rate at a step by the satellite's filter.

        The gyro measures a mean over its period. The present rate is that mean with the angular acceleration
        since its middle, which follows from the momentum that the wheels took up over the last control
        period. A filter that holds a rate gives that of the step itself.

        Args:
            memory: of the filter.
            wheel_momentum: measured, N m s, shape (..., 3).
            earlier_momentum: the same at the step before, shape (..., 3).
            time: s, shape (...).
            step: control period, s.
        """
        body, now = self.law.body, memory.now
        mean = memory.angular_velocity
        momentum = multiply(body.platform_inertia, mean) + wheel_momentum
        torque = (
            cross(momentum, mean) + self.external(now.mrp, time) - (wheel_momentum - earlier_momentum) / step
        )
        rate = mean + memory.rate_age[..., None] * multiply(body.inverse_platform_inertia, torque)
        return Attitude(now.mrp, rate, wheel_momentum)

    def wheel_torque(
        self, measured: Attitude, reference: AttitudeReference, time: Array, ahead: float = 0.0
    ) -> Array:
        """Torque that the motors on the wheels are to give.

        Args:
            measured: the own attitude.
            reference: desired attitude, with the angular acceleration `ahead` s later.
            time: s, shape (...).
            ahead: as in `AttitudeTracking.wheel_torque`, s.

        Returns:
            N m, shape (..., 3).
        """
        momentum = (
            multiply(self.law.body.platform_inertia, measured.angular_velocity) + measured.wheel_momentum
        )
        state = AttitudeState(measured.mrp, momentum, measured.wheel_momentum)
        return self.law.wheel_torque(state, reference, self.external(measured.mrp, time), ahead)


def reference_at_start(orientation: Orientation, own: Reference) -> AttitudeReference:
    """The desired attitude of one satellite at time zero, by its flight plan.

    Args:
        orientation: where it points.
        own: its desired motion at the start, LVLH, shape (3,).
    """
    begin, pointing, target = np.zeros(()), orientation.pointing, orientation.target
    if isinstance(pointing, GroundPointing):
        return pointing.reference(begin)
    assert target is not None  # noqa: S101 - built together
    phase = target.planned_phase + target.phase_offset
    aimed_at = target.path.reference(phase, target.planned_rate, np.zeros_like(phase))
    return pointing.reference(own, aimed_at, begin)


class PointingReference:
    """The desired attitude of each step, worked out ahead where it depends on time alone.

    Attributes:
        ahead: time from the start of a step to where its angular acceleration is taken, s.
    """

    def __init__(
        self,
        orientation: Orientation,
        step: float,
        neighbour_timeout: Array | float,
        feedforward_sample: FeedForward = "midpoint",
    ) -> None:
        """A guidance before its first step.

        Args:
            orientation: where to point, and the other satellite that is pointed at.
            step: control period, s.
            neighbour_timeout: age of a neighbour's message from which on it no longer counts, s.
            feedforward_sample: where in the control period the angular acceleration is taken; as `Path` has
                it for the acceleration.
        """
        self._orientation = orientation
        self._step = step
        self._neighbour_timeout = neighbour_timeout
        self.ahead = 0.5 * step if feedforward_sample == "midpoint" else 0.0
        self._axes: tuple[int, ...] = ()
        self._number = -1
        self._block: AttitudeReference | None = None

    def at(self, step: int, own: Reference, neighbour_states: NeighbourStates) -> AttitudeReference:
        """The desired attitude at a step, with the angular acceleration to hold over it.

        Args:
            step: number of the step.
            own: desired motion of the satellite at the step, LVLH; its acceleration is that to hold.
            neighbour_states: from its neighbours.
        """
        pointing, target = self._orientation.pointing, self._orientation.target
        if isinstance(pointing, SatellitePointing):
            assert target is not None  # noqa: S101 - built together
            assert isinstance(neighbour_states, NeighbourPhases)  # noqa: S101 - the scenario's validator has seen to it
            moment = step * self._step
            wanted, known = target.reference(neighbour_states, moment, self._neighbour_timeout)
            aimed = pointing.reference(own, wanted, constant(own.position.shape[:-1], moment))
            if self.ahead:
                middle, _ = target.reference(neighbour_states, moment + self.ahead, self._neighbour_timeout)
                time = constant(own.position.shape[:-1], moment + self.ahead)
                later = pointing.reference(_after(own, self.ahead), middle, time)
                aimed = replace(aimed, angular_acceleration=later.angular_acceleration)
            return aimed if np.all(known) else _either(known, aimed, pointing.safe_reference())
        self._axes = (1,) * (own.position.ndim - 1)
        if not isinstance(step, Recorded):
            return self._along_orbit(step)
        numbers = step.called(self._numbers_along_orbit)
        parts = (numbers[..., begin : begin + 3] for begin in (0, 3, 6))
        return AttitudeReference(*parts, numbers[..., 9] > 0.0)

    def _along_orbit(self, step: int) -> AttitudeReference:
        """The reference of a step that depends on time alone."""
        pointing = self._orientation.pointing
        assert not isinstance(pointing, SatellitePointing)  # noqa: S101 - that depends on the satellites
        number, row = divmod(step, _BLOCK)
        if self._block is None or number != self._number:
            times: Array = (number * _BLOCK + np.arange(_BLOCK, dtype=np.float64)) * self._step
            self._block = pointing.reference(times.reshape(_BLOCK, *self._axes))
            if self.ahead:
                later = pointing.reference((times + self.ahead).reshape(_BLOCK, *self._axes))
                self._block = replace(self._block, angular_acceleration=later.angular_acceleration)
            self._number = number
        block = self._block
        return AttitudeReference(
            block.mrp[row], block.angular_velocity[row], block.angular_acceleration[row], block.feasible[row]
        )

    def _numbers_along_orbit(self, step: int) -> Array:
        """The same as numbers, shape (..., 10)."""
        found = self._along_orbit(step)
        vectors = (found.mrp, found.angular_velocity, found.angular_acceleration)
        return np.concatenate((*vectors, found.feasible[..., None].astype(np.float64)), axis=-1)


def _after(motion: Reference, time: float) -> Reference:
    """A desired motion some time (s) later, under the acceleration that it has."""
    velocity = motion.velocity + time * motion.acceleration
    position = motion.position + time * motion.velocity + (0.5 * time * time) * motion.acceleration
    return Reference(position, velocity, motion.acceleration)


def _either(known: Mask, first: AttitudeReference, second: AttitudeReference) -> AttitudeReference:
    """The first attitude where the target is known, else the second."""
    axes = known[..., None]
    return AttitudeReference(
        np.where(axes, first.mrp, second.mrp),
        np.where(axes, first.angular_velocity, second.angular_velocity),
        np.where(axes, first.angular_acceleration, second.angular_acceleration),
        np.where(known, first.feasible, second.feasible),
    )


class AttitudeSpec(Spec):
    """A satellite's attitude: its body and wheels, where it points, and the law that keeps it there."""

    controller: AttitudeTrackingSpec = AttitudeTrackingSpec()
    """The control law, with the inertias of the satellite and of its wheels."""
    pointing: Annotated[GroundPointingSpec | SatellitePointingSpec, Field(discriminator="kind")]
    """What the sensor points at."""
    wheel_torque_limit: Positive | None = None
    """Largest torque of each wheel's motor, N m; none when left out."""
    wheel_momentum_limit: Positive | None = None
    """Largest momentum of each wheel, N m s; none when left out."""
    gravity_gradient: bool = True
    """Whether the Earth's gravity turns the satellite."""
    filter: AttitudeFilterSpec | None = None
    """What estimates the attitude, from the gyro and the star trackers among the satellite's `sensors`;
    without it the satellite knows its true attitude."""
    mrp: Vector | None = None
    """Attitude at the start, inertial to body; that of the pointing at its initial target when left out."""
    angular_velocity: Vector | None = None
    """Of the body at the start, body components, rad/s; that of the pointing at its initial target when left
    out."""
    wheel_speed: Vector = (0.0, 0.0, 0.0)
    """Of the wheels at the start, relative to the body, rad/s."""
    maximum_step: Positive = 0.05
    """Longest sub-step of the integration of the true attitude, s."""

    @model_validator(mode="after")
    def _one_start(self) -> "AttitudeSpec":
        if self.mrp is not None and self.pointing.has_initial_target:
            raise ValueError("mrp and an initial target of the pointing both give the attitude at the start")
        return self

    def complaints(self, mean_motion: float) -> list[str]:
        """What of this cannot be flown about a chief of a mean motion in rad/s."""
        try:
            self.controller.build()
            if isinstance(self.pointing, GroundPointingSpec):
                own = float(self.pointing.build().orbit.mean_motion)
                if not math.isclose(own, mean_motion, rel_tol=1e-6):
                    return [
                        f"an orbit at the altitude of the pointing has a mean motion of {own:.9g} rad/s, "
                        f"the chief's is {mean_motion:.9g} rad/s"
                    ]
            else:
                self.pointing.build(mean_motion, 1.0)
        except ValueError as error:
            return [str(error)]
        return []


def orientation(
    spec: AttitudeSpec,
    orbit: tuple[float, float],
    own: Reference,
    target: tuple[Target, Reference] | None,
) -> Orientation:
    """Pointing and law of one satellite, with its attitude at the start.

    Args:
        spec: from the scenario.
        orbit: mean motion (rad/s) and radius (m) of the chief.
        own: desired motion at the start, LVLH, shape (3,).
        target: the other satellite, and the desired motion at the start of the one that is pointed at then;
            None for a place on the ground.

    Returns:
        What flies.

    Raises:
        ValueError: it cannot be flown.
    """
    law = spec.controller.build()
    pointing: GroundPointing | SatellitePointing
    if isinstance(spec.pointing, GroundPointingSpec):
        pointing = spec.pointing.build()
        wanted = spec.pointing.build_initial().reference(np.zeros(()))
    else:
        assert target is not None  # noqa: S101 - the scenario's validator has seen to it
        pointing = spec.pointing.build(*orbit)
        wanted = pointing.reference(own, target[1], np.zeros(()))
    mrp = wanted.mrp if spec.mrp is None else np.array(spec.mrp)
    rate = wanted.angular_velocity if spec.angular_velocity is None else np.array(spec.angular_velocity)
    start = law.body.at_rate(mrp, rate, np.array(spec.wheel_speed))
    return Orientation(law, pointing, None if target is None else target[0], spec.gravity_gradient, start)
