# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The record of an in-process flight while it is flown, and what its satellites announce to each other."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.attitude.guidance import Attitude
from satform.attitude.pointing_accuracy import attitude_figures
from satform.communication.messages import WIDTH, encode
from satform.communication.neighbour_buffer import Received
from satform.communication.physical_links import LinkConditions
from satform.communication.receiver import ReceiverModel
from satform.flight.compile import FormationPlan
from satform.flight.online_parameters import OnlineParameters
from satform.flight.plant import Plant
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.membership.formation import Formation
from satform.membership.reconfiguration import Target
from satform.navigation.satellite_navigation import NavigationMemory, message_width
from satform.numeric.elementwise import Indices
from satform.record.flight_record import FlightRecord
from satform.record.navigation_history import NavigationHistory
from satform.record.quantities import ATTITUDE_ESTIMATES, ATTITUDE_VECTORS, ESTIMATES, PROPULSION, without

Row = int | slice
"""Indices of one satellite in arrays of the whole formation; or all of it."""


@dataclass
class FlightGroup:
    """Satellites that are flown by one object.

    Attributes:
        satellite: the flight software, of one satellite or of several stacked.
        receiver: their indices and possible in-neighbours.
        flies: whether they take part at present.
        online_parameters: what was changed of it in flight; None while nothing was.
        target: by which it flies; None for that of the scenario.
    """

    satellite: Satellite
    receiver: ReceiverModel
    flies: bool = True
    online_parameters: OnlineParameters | None = None
    target: Target | None = None

    @property
    def members(self) -> Indices:
        """Indices of each in the formation, shape (); or (n,) when stacked."""
        return self.receiver.members

    @property
    def row(self) -> Row:
        """The same as an index that makes no copy."""
        return slice(None) if self.members.ndim else int(self.members)


class FlightLog:
    """The record under way, and what has been announced for the step."""

    def __init__(self, formation: FormationPlan) -> None:
        steps, count = formation.timing.steps, len(formation.names)
        satellites = formation.topics.satellites
        self.step = 0
        self._announces = formation.announces
        self._width = WIDTH[self._announces]
        estimates = [message_width(own.estimated) for own in satellites if own.exchanges]
        self._messages = np.zeros((count, self._width + max(estimates, default=0)))
        self._time = np.zeros(count)
        self._fresh = np.ones(count)
        self._without_announcement: set[Row] = set()
        self._faults = formation.faults
        self._byzantine = [index for index in range(count) if self._faults.is_byzantine(index)]
        self.measures = any(satellite.sensor for satellite in satellites)
        self._filters = any(satellite.filter for satellite in satellites)
        self._plans = any(satellite.plans for satellite in satellites)
        position, velocity = np.empty((steps + 1, count, 3)), np.empty((steps + 1, count, 3))
        acceleration = np.empty((steps, count, 3))
        self._turns = any(satellite.attitude for satellite in satellites)
        self._attitude_filters = any(satellite.attitude_filter for satellite in satellites)
        unknown: dict[str, Any] = {
            **without("thruster", count, steps),
            **without("filter", count, steps if self._filters else None),
            **without("plans", count, steps if self._plans else None),
            **without("attitude", count, steps if self._turns else None),
            **without("attitude_filter", count, steps if self._attitude_filters else None),
            **without("pointing", count, None),
        }
        self.record = FlightRecord(
            satellites=formation.names,
            step=formation.timing.step,
            position=position,
            velocity=velocity,
            measured_position=np.empty_like(position) if self.measures else position,
            measured_velocity=np.empty_like(velocity) if self.measures else velocity,
            acceleration=acceleration,
            applied_acceleration=np.empty_like(acceleration),
            arc_length=np.zeros((steps + 1, count)),
            rate=np.zeros((steps + 1, count)),
            reference_position=np.empty((steps, count, 3)),
            reference_velocity=np.empty((steps, count, 3)),
            reference_acceleration=np.empty((steps, count, 3)),
            sliding_variable=np.empty((steps, count, 3)),
            estimated_position_error=np.empty((steps if self._filters else 0, count, 3)),
            estimated_velocity_error=np.empty((steps if self._filters else 0, count, 3)),
            **unknown,
        )
        readings = [satellite.readings for satellite in satellites]
        self._estimating = [index for index, own in enumerate(satellites) if own.estimated]
        if any(readings):
            history = NavigationHistory.empty(steps, count, max(readings))
            self.record = replace(self.record, navigation=history)

    def announced(self, groups: list[FlightGroup]) -> None:
        """Take in the messages of those that fly for the coming step."""
        for group in groups:
            row = group.row
            if not group.flies:
                self._without_announcement.add(row)
                self._fresh[row] = 0.0
                self._messages[row] = np.nan
                continue
            if self._without_announcement:
                self._without_announcement.discard(row)
                self._fresh[row] = 1.0
            self._announced(group)
        if self._announces == "arc_length":
            self.record.arc_length[self.step], self.record.rate[self.step] = self._messages[:, :2].T

    def _announced(self, group: FlightGroup) -> None:
        """Take in what the satellites of a group announce for the coming step."""
        row, message = group.row, group.satellite.announce()
        self._time[row] = message.time
        self._messages[row] = encode(message) if row == slice(None) else group.satellite.announced_numbers()
        for byzantine in self._byzantine:
            if byzantine in group.members:
                phase = self._messages[byzantine, : self._width]
                phase[:] = self._faults.corrupt(byzantine, phase.copy(), self.step)

    def rejoined(self, group: FlightGroup) -> None:
        """Record what a satellite that rejoins announces for its first step; its neighbours do not use it."""
        row = group.row
        self._announced(group)
        if self._announces == "arc_length":
            arc_length, rate = self._messages[row, :2]
            self.record.arc_length[self.step, row], self.record.rate[self.step, row] = arc_length, rate
        self._without_announcement.add(row)
        self._fresh[row] = 0.0

    def moved(self, plant: Plant, attitude: Attitude | None) -> None:
        """Record the true states of the coming step, and what is measured of them."""
        record, step, motion, measured = self.record, self.step, plant.motion(), plant.measured()
        record.position[step] = motion.position
        record.velocity[step] = motion.velocity
        if self.measures:
            record.measured_position[step] = measured.position
            record.measured_velocity[step] = measured.velocity
        if record.navigation is not None:
            for index, readings in plant.readings().items():
                record.navigation.readings[step, index, : len(readings)] = readings
        if attitude is not None:
            for name in ATTITUDE_VECTORS:
                getattr(record, name)[step] = getattr(attitude, name)
            for group in plant.turning:
                limits = plant.wheel_limits()[group.members]
                record.torque_saturated_steps[step, group.members] = limits[:, 0]
                record.momentum_saturated_steps[step, group.members] = limits[:, 1]
        if step > 0:
            record.applied_acceleration[step - 1] = plant.applied
        if plant.thrusters is None:
            return
        members, propulsion = plant.thrusters.members, plant.thrusters.propulsion
        for name in PROPULSION:
            getattr(record, name)[step, members] = getattr(propulsion, name)

    def received(
        self, receiver: ReceiverModel, formation: Formation, conditions: LinkConditions | None
    ) -> Received:
        """What arrives at the satellites of a group."""
        own = receiver.conditions(conditions)
        neighbours = receiver.neighbours
        values, time = self._messages.take(neighbours, axis=0), self._time.take(neighbours)
        if not self._without_announcement:
            return receiver.receive(self.step, values, time, None, formation, own)
        fresh = self._fresh[neighbours]
        values = np.where(fresh[..., None] > 0.0, values, 0.0)
        return receiver.receive(self.step, values, time, fresh, formation, own)

    def without_announcement(self, row: Row) -> None:
        """Note that a satellite does not take part in this step."""
        record, step = self.record, self.step
        record.acceleration[step, row] = 0.0
        record.reference_position[step, row] = np.nan
        record.reference_velocity[step, row] = np.nan
        record.reference_acceleration[step, row] = np.nan
        record.sliding_variable[step, row] = np.nan
        if self._plans:
            record.unsolved_plans[step, row] = np.nan
        if self._turns:
            record.wheel_torque[step, row] = 0.0
        if self._attitude_filters:
            for name in ATTITUDE_ESTIMATES:
                getattr(record, name)[step, row] = np.nan
        if self._filters:
            for name in ESTIMATES:
                getattr(record, name)[step, row] = np.nan
            record.estimated_position_error[step, row] = np.nan
            record.estimated_velocity_error[step, row] = np.nan

    def decided(self, row: Row, decision: Decision) -> None:
        """Record what a satellite, or all of them, decided in this step."""
        record, step, reference = self.record, self.step, decision.reference
        record.acceleration[step, row] = decision.acceleration
        record.reference_position[step, row] = reference.position
        record.reference_velocity[step, row] = reference.velocity
        record.reference_acceleration[step, row] = reference.acceleration
        record.sliding_variable[step, row] = decision.sliding_variable
        if decision.unsolved_plans is not None:
            record.unsolved_plans[step, row] = decision.unsolved_plans
        if decision.wheel_torque is not None:
            record.wheel_torque[step, row] = decision.wheel_torque
        if decision.attitude is not None:
            for name, values in zip(ATTITUDE_ESTIMATES, decision.attitude.parts(), strict=True):
                getattr(record, name)[step, row] = values
        if isinstance(row, int) and row in self._estimating:
            self._estimated(row, decision)
        if self._filters:
            if decision.estimate is not None:
                record.estimate_covariance[step, row] = decision.estimate.covariance
                record.innovation[step, row] = decision.estimate.innovation
                record.rejected_measurements[step, row] = decision.estimate.rejected
            estimated = decision.motion
            record.estimated_position_error[step, row] = estimated.position - reference.position
            record.estimated_velocity_error[step, row] = estimated.velocity - reference.velocity

    def _estimated(self, row: int, decision: Decision) -> None:
        """Record what a satellite estimates of the whole formation."""
        if self.record.navigation is not None and isinstance(decision.estimate, NavigationMemory):
            self.record.navigation.mean[self.step, row] = decision.estimate.mean

    def wheel_torque(self) -> NDArray[np.float64] | None:
        """What was commanded to the wheels in this step; None when nobody has any."""
        return self.record.wheel_torque[self.step] if self._turns else None

    def finished(self, formation: FormationPlan) -> FlightRecord:
        """The record of the flight, with the figures of attitudes."""
        record = self.record
        if self._turns:
            known = record.quantities()
            figures: dict[str, Any] = attitude_figures(formation.orientations(), formation.timing.step, known)
            record = replace(record, **figures)
        if self._filters:
            return record
        # Without filters the measured motion is the estimated one.
        return replace(
            record,
            estimated_position_error=record.measured_position[:-1] - record.reference_position,
            estimated_velocity_error=record.measured_velocity[:-1] - record.reference_velocity,
        )
