# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The true states of all satellites: commands in, states out."""

import math
from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np

from satform.attitude.guidance import Attitude, Orientation
from satform.attitude.wheels import Turning, Wheels
from satform.communication.physical_links import Geometry, LinkConditions
from satform.control.protocol import Motion
from satform.dynamics.protocol import Dynamics
from satform.equipment.random_streams import NAVIGATION_STREAM, THRUSTER_STREAM
from satform.equipment.sensors.protocol import Scene
from satform.equipment.sensors.relative_motion import NOISE_PER_STEP, Sensor
from satform.equipment.thruster import ERRORS_PER_STEP, Propulsion, Thruster, ThrusterFault
from satform.flight.link_geometry import body_axes
from satform.flight.plans import PlantPlan
from satform.flight.sensing import Sensing
from satform.numeric import stacking
from satform.numeric.elementwise import Array, Indices, blank, joined, norm
from satform.numeric.seeded_numbers import SeededNormals
from satform.orbits.frames import LvlhFrame


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
        self._links, self._attitude_orbits, self._period = plan.links, plan.attitude_orbits, plan.step
        self._motion = Motion(*self._dynamics.lvlh(self._state))
        self._sensors = _sensors_of(plan, self._motion)
        self._sun = plan.sun
        self._navigating = np.flatnonzero(plan.navigates)
        self._sensing = Sensing(plan.channels, plan.seed)
        self._measured = self._measure()
        self._sense()

    def motion(self) -> Motion:
        """True position in m and velocity in m/s of all satellites in LVLH, shapes (N, 3)."""
        return self._motion

    @property
    def dynamics(self) -> Dynamics:
        """The truth model."""
        return self._dynamics

    def earth_distance(self) -> Array:
        """Distance of each satellite from the Earth's centre, m, shape (N,)."""
        distance = self.modelled_earth_distance()
        if distance is not None:
            return distance
        radius = np.asarray(self._chief_radius)
        return norm(self._motion.position + joined(radius, *2 * (np.zeros_like(radius),)))

    def modelled_earth_distance(self) -> Array | None:
        """The same from the truth model; None for one in which the chief is on the circle of `orbit`."""
        return self._dynamics.earth_distance(self._state)

    def chief_frame(self) -> LvlhFrame | None:
        """The chief's LVLH frame at the present step; None for a model that does not know its chief."""
        return self._dynamics.chief_frame(self._state, self.step)

    def may_be_below(self, radius: float, square: float) -> bool:
        """Whether a satellite may be nearer to the Earth's centre than a radius; True where it may be so.

        Args:
            radius: m.
            square: sum of the squares of all satellites' distances from the chief, m^2.
        """
        distance = self.modelled_earth_distance()
        if distance is not None:
            return not distance.min() >= radius
        return bool(self._chief_radius - np.sqrt(square) < radius)

    def measured(self) -> Motion:
        """Measured motion of each satellite, shapes (N, 3); the truth where nobody measures.

        Not a number for a satellite that knows its motion by the readings of its sensors alone.
        """
        return self._measured

    @property
    def measures(self) -> bool:
        """Whether a satellite measures its motion by a sensor of relative motion."""
        return bool(self._sensors)

    def readings(self) -> dict[int, Array]:
        """Readings of sensors that arrive at this step, shape (W,), by the satellite's index."""
        return self._sensing.arrived

    def measured_steps(self) -> Indices:
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

    def link_conditions(self) -> LinkConditions | None:
        """Loss and light time of all links by the true geometry; None where no link is physical."""
        if self._links is None:
            return None
        body = self._body_axes(self.attitude())
        geometry = Geometry(self._motion.position, self._present_chief_radius(), body)
        return self._links.conditions(self._links.states(geometry))

    def _body_axes(self, attitude: Attitude | None) -> Array | None:
        """Body axes of each satellite in LVLH, shape (N, 3, 3); None where nobody has an attitude."""
        time = np.asarray(self.step * self._period)
        return body_axes(None if attitude is None else attitude.mrp, self._attitude_orbits, time)

    def _sense(self) -> None:
        """Take the readings of the present step."""
        if not self._sensing:
            return
        attitude, time = self.attitude(), self.step * self._period
        sun = None if self._sun is None else self._sun.at(time, self.chief_frame())
        scene = Scene(
            time=time,
            position=self._motion.position,
            velocity=self._motion.velocity,
            chief_radius=self._present_chief_radius(),
            body=self._body_axes(attitude),
            mrp=None if attitude is None else attitude.mrp,
            angular_velocity=None if attitude is None else attitude.angular_velocity,
            sun=sun,
        )
        self._sensing.sample(scene, self.step)

    def _present_chief_radius(self) -> Array:
        """Distance of the chief from the Earth's centre, m."""
        distance = self.modelled_earth_distance()
        if distance is None:
            return np.asarray(self._chief_radius)
        x, y, z = self._motion.position[0]
        return np.asarray(math.sqrt(distance[0] * distance[0] - y * y - z * z) - x)

    def wheel_limits(self) -> Array:
        """Steps so far in which torque and momentum limits took something away, shape (N, 2)."""
        count = len(self._motion.position)
        counted = blank((count, 2), *(group.state.torque_saturated_steps for group in self.turning))
        counted[...] = 0.0
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
        self.applied = acceleration.copy(order="K")
        if self.thrusters is not None:
            fault = self._faults.of_thrusters(self.thrusters.members, self.step)
            self.applied = self.thrusters.fire(acceleration, self.step, fault)
        self._state = self._dynamics.advance(self._state, self.applied, self.step)
        self.step += 1
        self._motion = Motion(*self._dynamics.lvlh(self._state))
        for sensors in self._sensors:
            sensors.sample(self._motion, self.step)
        self._measured = self._measure()
        self._sense()

    def keep(self, rows: Indices) -> None:
        """Go on with some of the satellites alone, as where a run among many has ended.

        Args:
            rows: indices of these satellites, ascending; their dynamics have to be of many runs.
        """
        stacked: Any = self._dynamics
        self._dynamics, self._state = stacked.keep(self._state, rows)
        self.applied = stacking.take(self.applied, rows)
        self.thrusters = None if self.thrusters is None else self.thrusters.keep(rows)
        self.turning = [group.keep(rows) for group in self.turning]
        self._sensors = [group.keep(rows) for group in self._sensors]
        if isinstance(self._chief_radius, np.ndarray):
            self._chief_radius = self._chief_radius[rows]
        self._motion = Motion(*self._dynamics.lvlh(self._state))
        self._measured = self._measure()

    def _measure(self) -> Motion:
        measured = self._measured_by_sensors()
        if not len(self._navigating):
            return measured
        unknown = Motion(measured.position.copy("K"), measured.velocity.copy("K"))
        unknown.position[self._navigating] = np.nan
        unknown.velocity[self._navigating] = np.nan
        return unknown

    def _measured_by_sensors(self) -> Motion:
        if not self._sensors:
            return self._motion
        if len(self._sensors) == 1 and self._sensors[0].everyone:
            delivered = self._sensors[0].memory.delivered
            measured = Motion(delivered.position, delivered.velocity)
        else:
            measured = Motion(self._motion.position.copy("K"), self._motion.velocity.copy("K"))
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

    def __init__(
        self, members: Sequence[int], thruster: Thruster, errors: SeededNormals, *, everyone: bool = False
    ) -> None:
        """Thrusters before the first step.

        Args:
            members: indices of their satellites, ascending.
            thruster: of all of them.
            errors: random numbers of the same satellites.
            everyone: whether there is no other satellite.
        """
        self.members = np.asarray(members)
        self.propulsion: Propulsion = thruster.start()
        self._everyone = everyone
        self._thruster = thruster
        self._errors = errors

    def fire(self, acceleration: Array, step: int, fault: ThrusterFault | None = None) -> Array:
        """One step of thrust.

        Args:
            acceleration: commands of all satellites, m/s^2, shape (N, 3).
            step: number of the step.
            fault: what is wrong with the members' thrusters in it; None for nothing.

        Returns:
            What all satellites really get, m/s^2, shape (N, 3).
        """
        commands = acceleration if self._everyone else acceleration[self.members]
        fired, self.propulsion = self._thruster.fire(self.propulsion, commands, self._errors.at(step), fault)
        if self._everyone:
            return fired
        applied = acceleration.copy("K")
        applied[self.members] = fired
        return applied

    def keep(self, rows: Indices) -> "Thrusters":
        """The thrusters of some of the satellites, by their indices; this object is not to be used on."""
        kept = copy(self)
        own, kept.members = _remaining(self.members, rows)
        kept.propulsion = stacking.take(self.propulsion, own)
        kept._thruster = stacking.take(self._thruster, own)
        kept._errors = self._errors.keep(own)
        return kept


class _Sensors:
    """Sensors that measure at the same steps and deliver equally late."""

    def __init__(self, members: Sequence[int], sensor: Sensor, plan: PlantPlan, start: Motion) -> None:
        self.members = np.asarray(members)
        self.everyone = len(members) == len(plan.sensors)
        self._sensor = sensor
        self._noise = SeededNormals(*_identities(plan, NAVIGATION_STREAM, members), NOISE_PER_STEP)
        self.memory = sensor.start(*self._own(start), self._noise.at(0))

    def _own(self, motion: Motion) -> tuple[Array, Array]:
        if self.everyone:
            return motion.position, motion.velocity
        return motion.position[self.members], motion.velocity[self.members]

    def keep(self, rows: Indices) -> "_Sensors":
        """The sensors of some of the satellites, by their indices; this object is not to be used on."""
        kept = copy(self)
        own, kept.members = _remaining(self.members, rows)
        kept._sensor = stacking.take(self._sensor, own)
        kept._noise = self._noise.keep(own)
        kept.memory = stacking.take(self.memory, own)
        return kept

    def sample(self, motion: Motion, step: int) -> None:
        """Take in the true motion of all satellites at a step."""
        position, velocity = self._own(motion)
        self.memory = self._sensor.measure(self.memory, position, velocity, step, self._noise.at(step))


def _identities(plan: PlantPlan, stream: int, members: Sequence[int]) -> tuple[list[int], int, list[int]]:
    """Seeds, stream and indices, in their own runs, of some satellites' random numbers."""
    if plan.identities is None:
        return [plan.seed] * len(members), stream, list(members)
    own = [plan.identities[member] for member in members]
    return [seed for seed, _ in own], stream, [index for _, index in own]


def _remaining(members: Indices, rows: Indices) -> tuple[Indices, Indices]:
    """Positions among some members of those that remain, and their indices among all that remain."""
    found = np.searchsorted(members, rows)
    held = found < len(members)
    held[held] = members[found[held]] == rows[held]
    return found[held], np.flatnonzero(held)


def _thrusters_of(plan: PlantPlan) -> Thrusters | None:
    members = [index for index, thruster in enumerate(plan.thrusters) if thruster is not None]
    built = [thruster for thruster in plan.thrusters if thruster is not None]
    if not built:
        return None
    errors = SeededNormals(*_identities(plan, THRUSTER_STREAM, members), ERRORS_PER_STEP)
    return Thrusters(members, stacking.stack(built), errors, everyone=len(built) == len(plan.thrusters))


def _sensors_of(plan: PlantPlan, start: Motion) -> list[_Sensors]:
    alike: dict[tuple[int, int], list[tuple[int, Sensor]]] = {}
    for index, sensor in enumerate(plan.sensors):
        if sensor is not None:
            alike.setdefault((sensor.update, sensor.latency), []).append((index, sensor))
    return [
        _Sensors(
            [index for index, _ in group],
            stacking.component_major(stacking.stack([sensor for _, sensor in group])),
            plan,
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
