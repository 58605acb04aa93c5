# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The true states of all satellites: commands in, states out."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from satform.attitude.guidance import Attitude, Orientation
from satform.attitude.wheels import Turning, Wheels
from satform.control.protocol import Motion
from satform.dynamics.inertial import InertialDynamics
from satform.equipment.noise import NAVIGATION_STREAM, THRUSTER_STREAM, SeededNormals
from satform.equipment.sensor import NOISE_PER_STEP, Sensor
from satform.equipment.thruster import ERRORS_PER_STEP, Propulsion, Thruster, ThrusterFault
from satform.flight.plans import PlantPlan
from satform.numeric import stacking
from satform.numeric.elementwise import Array, norm

Steps = NDArray[np.int64]


class Plant:
    """True motion of the satellites of a scenario, and what their sensors measure of it.

    Attributes:
        step: number of the step that comes next.
        applied: acceleration of all satellites in the last step, as applied, LVLH, m/s^2, shape (N, 3);
            zero before the first one.
        thrusters: of the satellites that have one; None when nobody has.
        turning: the true attitudes, in groups of satellites; empty when nobody has one.
    """

    def __init__(self, plan: PlantPlan) -> None:
        self._dynamics = plan.dynamics
        self._state = self._dynamics.start(plan.start.position, plan.start.velocity)
        self.step = 0
        self.applied: Array = np.zeros_like(plan.start.position)
        self._faults = plan.faults
        self._held_readings: dict[int, tuple[Array, Array]] = {}
        self.thrusters = _thrusters_of(plan)
        self.turning = _turning_of(plan)
        self._chief_radius = plan.chief_radius
        self._motion = Motion(*self._dynamics.lvlh(self._state))
        self._sensors = _sensors_of(plan, self._motion)
        self._measured = self._measure()

    def motion(self) -> Motion:
        """True position in m and velocity in m/s of all satellites in LVLH, shapes (N, 3)."""
        return self._motion

    def earth_distance(self) -> Array:
        """Distance of each satellite from the Earth's centre, m, shape (N,)."""
        if isinstance(self._dynamics, InertialDynamics):
            return self._dynamics.earth_distance(self._state)
        return norm(self._motion.position + np.array([self._chief_radius, 0.0, 0.0]))

    def may_be_below(self, radius: float, square: float) -> bool:
        """Whether a satellite may be nearer to the Earth's centre than a radius; True where it may be so.

        Args:
            radius: m.
            square: sum of the squares of all satellites' distances from the chief, m^2.
        """
        if isinstance(self._dynamics, InertialDynamics):
            return not float(self.earth_distance().min()) >= radius
        return self._chief_radius - math.sqrt(square) < radius

    def measured(self) -> Motion:
        """Measured motion of each satellite, shapes (N, 3); the truth where nobody measures."""
        return self._measured

    def measured_steps(self) -> Steps:
        """Number of the step to which each satellite's present measurement belongs, shape (N,)."""
        steps = np.full(len(self._motion.position), self.step)
        for sensors in self._sensors:
            steps[sensors.members] = sensors.memory.delivered.step
        return steps

    def attitude(self) -> Attitude | None:
        """Measured attitude of each satellite, shape (N, 3); None when nobody has one.

        Not a number for satellites without attitude.
        """
        if not self.turning:
            return None
        whole = Attitude(*(np.full_like(self._motion.position, np.nan) for _ in range(3)))
        for group in self.turning:
            measured = group.measured()
            whole.mrp[group.members] = measured.mrp
            whole.angular_velocity[group.members] = measured.angular_velocity
            whole.wheel_momentum[group.members] = measured.wheel_momentum
        return whole

    def wheel_limits(self) -> Array:
        """Steps so far in which torque and momentum limits took something away, shape (N, 2)."""
        counted = np.zeros((len(self._motion.position), 2))
        for group in self.turning:
            counted[group.members, 0] = group.state.torque_saturated_steps
            counted[group.members, 1] = group.state.momentum_saturated_steps
        return counted

    def advance(self, acceleration: Array, wheel_torque: Array | None = None) -> None:
        """Move on by one step.

        Args:
            acceleration: commands of all satellites, held over the step, LVLH, m/s^2, shape (N, 3).
            wheel_torque: likewise of the motors on the wheels, N m, shape (N, 3); those of satellites
                without attitude do not matter.
        """
        if wheel_torque is not None:
            for group in self.turning:
                group.advance(wheel_torque[group.members], self.step)
        # The caller may use the same array for the next commands.
        self.applied = acceleration.copy()
        if self.thrusters is not None:
            fault = self._faults.of_thrusters(self.thrusters.members, self.step)
            self.applied = self.thrusters.fire(acceleration, self.step, fault)
        self._state = self._dynamics.advance(self._state, self.applied, self.step)
        self.step += 1
        self._motion = Motion(*self._dynamics.lvlh(self._state))
        for sensors in self._sensors:
            sensors.sample(self._motion, self.step)
        self._measured = self._measure()

    def _measure(self) -> Motion:
        if not self._sensors:
            return self._motion
        measured = Motion(self._motion.position.copy(), self._motion.velocity.copy())
        for sensors in self._sensors:
            delivered = sensors.memory.delivered
            measured.position[sensors.members] = delivered.position
            measured.velocity[sensors.members] = delivered.velocity
        return Motion(
            *self._faults.reading(measured.position, measured.velocity, self.step, self._held_readings)
        )


class Thrusters:
    """The thrusters of the satellites that have one.

    Attributes:
        members: indices of these satellites in the formation, ascending, shape (M,).
        propulsion: their state, each array of shape (M,).
    """

    def __init__(self, members: Sequence[int], thruster: Thruster, seed: int) -> None:
        self.members = np.asarray(members)
        self.propulsion: Propulsion = thruster.start()
        self._thruster = thruster
        self._errors = SeededNormals(seed, THRUSTER_STREAM, members, ERRORS_PER_STEP)

    def fire(self, acceleration: Array, step: int, fault: ThrusterFault | None = None) -> Array:
        """One step of thrust.

        Args:
            acceleration: commands of all satellites, m/s^2, shape (N, 3).
            step: number of the step.
            fault: what is wrong with the members' thrusters in it; None for nothing.

        Returns:
            What all satellites really get, m/s^2, shape (N, 3).
        """
        applied = acceleration.copy()
        applied[self.members], self.propulsion = self._thruster.fire(
            self.propulsion, acceleration[self.members], self._errors.at(step), fault
        )
        return applied


class _Sensors:
    """Sensors that measure at the same steps and deliver equally late."""

    def __init__(self, members: Sequence[int], sensor: Sensor, seed: int, start: Motion) -> None:
        self.members = np.asarray(members)
        self._sensor = sensor
        self._noise = SeededNormals(seed, NAVIGATION_STREAM, members, NOISE_PER_STEP)
        position, velocity = start.position[self.members], start.velocity[self.members]
        self.memory = sensor.start(position, velocity, self._noise.at(0))

    def sample(self, motion: Motion, step: int) -> None:
        """Take in the true motion of all satellites at a step."""
        position, velocity = motion.position[self.members], motion.velocity[self.members]
        self.memory = self._sensor.measure(self.memory, position, velocity, step, self._noise.at(step))


def _thrusters_of(plan: PlantPlan) -> Thrusters | None:
    members = [index for index, thruster in enumerate(plan.thrusters) if thruster is not None]
    built = [thruster for thruster in plan.thrusters if thruster is not None]
    return Thrusters(members, stacking.stack(built), plan.seed) if built else None


def _sensors_of(plan: PlantPlan, start: Motion) -> list[_Sensors]:
    alike: dict[tuple[int, int], list[tuple[int, Sensor]]] = {}
    for index, sensor in enumerate(plan.sensors):
        if sensor is not None:
            alike.setdefault((sensor.update, sensor.latency), []).append((index, sensor))
    return [
        _Sensors(
            [index for index, _ in group],
            stacking.stack([sensor for _, sensor in group]),
            plan.seed,
            start,
        )
        for group in alike.values()
    ]


def _turning_of(plan: PlantPlan) -> list[Turning]:
    alike: dict[int, list[tuple[int, Orientation, Wheels]]] = {}
    for index, own in enumerate(plan.attitudes):
        if own is not None:
            alike.setdefault(own.parts, []).append((index, own.orientation, own.wheels))
    groups: list[Turning] = []
    for parts, members in alike.items():
        groups += _turning_groups(members, plan.step, parts)
    return groups


def _turning_groups(members: list[tuple[int, Orientation, Wheels]], step: float, parts: int) -> list[Turning]:
    indices = [index for index, _, _ in members]
    wheels = stacking.stack([limits for _, _, limits in members])
    try:
        return [Turning(indices, stacking.stack([own for _, own, _ in members]), wheels, step, parts)]
    except ValueError:
        # Satellites that point at different kinds of things cannot be stacked.
        return [
            Turning([index], stacking.stack([own]), stacking.stack([limits]), step, parts)
            for index, own, limits in members
        ]
