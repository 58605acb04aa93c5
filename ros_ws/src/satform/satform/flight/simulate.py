# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The in-process run: one loop, no ROS, the oracle that every other way to run is held against."""

from collections.abc import Callable
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
from satform.control.protocol import Motion
from satform.flight.checkpoint import restore, save
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.limits import NO_COMMAND, LimitCheck, Violation
from satform.flight.online_parameters import OnlineParameters
from satform.flight.plant import Plant
from satform.flight.satellite import Decision, Satellite
from satform.flight.scenario_record import with_chief
from satform.membership.formation import (
    Event,
    Formation,
    ParameterChanged,
    Plan,
    SatelliteLost,
    SatelliteRejoined,
    has_individual_events,
    merge_plans,
    possible_graph,
)
from satform.membership.reconfiguration import Target
from satform.numeric.elementwise import Indices
from satform.record.early_end import EarlyEnd
from satform.record.flight_record import FlightRecord
from satform.record.quantities import ATTITUDE_VECTORS, ESTIMATES, PROPULSION, without
from satform.scenario.model import Scenario

Row = int | slice
"""Indices of one satellite in arrays of the whole formation; or all of it."""


@dataclass
class _Group:
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


def simulate(
    scenario: Scenario,
    *,
    stacked: bool = True,
    events: Plan | None = None,
    progress: Callable[[int], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> FlightRecord:
    """Fly a scenario in this process.

    Args:
        scenario: what to fly.
        stacked: whether satellites of the same kind share one step over arrays; the numbers have
            the same bits either way.
        events: what happens beside that which the scenario plans, by step, as in a flight that is flown
            once more.
        progress: called with the number of finished steps after each.
        stop: asked before each step whether to fly no further.

    Returns:
        The whole flight; what was flown of it before it was stopped; or until a quantity was not finite or
        beyond its limit: the record's `early_end` says so. A satellite that is lost commands nothing and says
        nothing: its acceleration is zero, and what else it would have decided is not a number.
    """
    formation = compile_scenario(scenario)
    plan = merge_plans(formation.membership.events, events or {})
    # What is not finite ends the flight with a sentence; a warning would say the same less well.
    with np.errstate(all="ignore"):
        flight = _Flight(formation, plan, stacked=stacked and not has_individual_events(plan))
        for step in range(formation.timing.steps):
            if stop and stop():
                break
            flight.step()
            if flight.early_end:
                break
            if progress:
                progress(step + 1)
        return with_chief(flight.finished(), scenario, events)


class _Flight:
    """A flight under way.

    Attributes:
        early_end: why it goes no further; None while it does.
        flown: steps flown within the limits, once it goes no further.
    """

    def __init__(self, formation: FormationPlan, plan: Plan, *, stacked: bool) -> None:
        self.plans = formation
        self.plan = plan
        self.plant = Plant(formation.plant)
        self.early_end: EarlyEnd | None = None
        self.flown = 0
        self._limits = LimitCheck(formation.limits)
        self.formation = Formation.of(formation.membership)
        self._names = formation.names
        self._possible = possible_graph(formation.membership.graph, plan)
        # Checkpoints that someone will go on from, by satellite and step.
        self._needed = {
            (event.satellite, event.checkpoint)
            for events in plan.values()
            for event in events
            if isinstance(event, SatelliteRejoined) and event.checkpoint is not None
        }
        self._checkpoints: dict[tuple[int, int], bytes] = {}
        self.groups = self._grouped(stacked=stacked)
        self.log = _Log(formation)

    def step(self) -> None:
        """Fly the next step."""
        log, plant = self.log, self.plant
        step = log.step
        if self._beyond_limits():
            return
        events = self.plan.get(step, [])
        # The message that a satellite sent for this step is received although it is lost in it.
        log.announced(self.groups)
        if events:
            self._happen(events, step)
        motion, attitude = plant.measured(), plant.attitude()
        measured_steps = plant.measured_steps() if log.measures else None
        log.moved(plant, attitude)
        conditions = plant.link_conditions()
        violations: dict[int, Violation] = {}
        for group in self.groups:
            row = group.row
            if not group.flies:
                log.without_announcement(row)
                continue
            own = Motion(motion.position[row], motion.velocity[row])
            # Satellites whose sensors measure at different times do not fly as one.
            measured_step = None if measured_steps is None else int(measured_steps[row].flat[0])
            turned = None if attitude is None else _rows(attitude, group)
            received = log.received(group.receiver, self.formation, conditions)
            applied = plant.applied[row]
            try:
                decision = group.satellite.act(own, received, measured_step, turned, applied)
            except ArithmeticError:
                violations[int(np.min(group.members))] = NO_COMMAND
                continue
            found = self._limits.of_decision(decision, encode(group.satellite.announce()))
            if found:
                members = np.atleast_1d(group.members)
                violations.update({int(members[row]): violation for row, violation in found.items()})
            log.decided(row, decision)
            self._save_checkpoint(group)
        self.early_end, self.flown = self._limits.computed_end(violations, step), step
        if self.early_end:
            return
        plant.advance(log.record.acceleration[step], log.wheel_torque())
        log.step = step + 1

    def _beyond_limits(self) -> bool:
        """Whether the flight ends because of the states of the present step."""
        self.early_end = self._limits.of_plant(self.plant)
        # The step that led to states beyond the limits is no part of the flight.
        self.flown = max(0, self.plant.step - 1)
        return self.early_end is not None

    def _happen(self, events: list[Event], step: int) -> None:
        self.formation.apply(events, step, self._names)
        for event in events:
            match event:
                case SatelliteLost():
                    self.groups[event.satellite].flies = False
                case SatelliteRejoined() if not self.groups[event.satellite].flies:
                    self._restart(event, step)
                    if not self.formation.is_used_by_neighbours(event.satellite, step):
                        self.log.rejoined(self.groups[event.satellite])
                case ParameterChanged():
                    self._adjust(event)
                case _:
                    pass
        for satellite in self.formation.targets:
            if self.groups[satellite].flies:
                self._retarget(satellite, self.groups[satellite])

    def _retarget(self, satellite: int, group: _Group) -> None:
        """Have a satellite fly by the target in force, if it is another one."""
        target = self.formation.targets.get(satellite)
        if target is not None and target != group.target:
            self._online_parameters(satellite, group).retarget(group.satellite, target)
            group.target = target

    def _online_parameters(self, satellite: int, group: _Group) -> OnlineParameters:
        if group.online_parameters is None:
            group.online_parameters = OnlineParameters(self.plans.parameters(satellite))
        return group.online_parameters

    def _adjust(self, event: ParameterChanged) -> None:
        group = self.groups[event.satellite]
        self._online_parameters(event.satellite, group).set(group.satellite, event.name, event.value)

    def _save_checkpoint(self, group: _Group) -> None:
        """Keep a checkpoint of a satellite if it is one that will be needed."""
        if self._needed:
            key = (int(group.members), group.satellite.state.step)
            if key in self._needed:
                self._checkpoints[key] = save(group.satellite)

    def _restart(self, event: SatelliteRejoined, step: int) -> None:
        fresh = self._single(event.satellite)
        if event.checkpoint is not None:
            key = (event.satellite, event.checkpoint)
            if key not in self._checkpoints:
                name = self._names[event.satellite]
                raise ValueError(f"{name} has no checkpoint of step {event.checkpoint} to come back from")
            restore(fresh.satellite, self._checkpoints[key])
        self._retarget(event.satellite, fresh)
        fresh.satellite.join(step)
        self.groups[event.satellite] = fresh

    def finished(self) -> FlightRecord:
        """The whole flight, or what was flown of it."""
        log = self.log
        ends_early = self.early_end is not None or self._beyond_limits()
        if not ends_early or log.step == 0:
            log.announced(self.groups)
            log.moved(self.plant, self.plant.attitude())
        if ends_early:
            log.record = replace(log.record.first(self.flown), early_end=self.early_end)
        elif log.step < self.plans.timing.steps:
            log.record = log.record.first(log.step)
        return log.finished(self.plans)

    def _grouped(self, *, stacked: bool) -> list[_Group]:
        count = len(self._names)
        if stacked:
            in_neighbours = [self._possible.neighbours(index) for index in range(count)]
            plans = [self.plans.satellite(index, own) for index, own in enumerate(in_neighbours)]
            try:
                satellite = Satellite.stacked(plans, max(map(len, in_neighbours)))
            except ValueError:
                # Satellites of different kinds cannot be stacked; each is then flown by itself.
                pass
            else:
                return [_Group(satellite, ReceiverModel(self.plans.links, np.arange(count), in_neighbours))]
        return [self._single(index) for index in range(count)]

    def _single(self, index: int) -> _Group:
        in_neighbours = self._possible.neighbours(index)
        receiver = ReceiverModel(self.plans.links, np.asarray(index), [in_neighbours])
        return _Group(Satellite(self.plans.satellite(index, in_neighbours), len(in_neighbours)), receiver)


def _rows(attitude: Attitude, group: _Group) -> Attitude | None:
    """Measured attitudes of the satellites of a group; None when they have none."""
    if group.satellite.plan.orientation is None:
        return None
    row = group.row
    return Attitude(attitude.mrp[row], attitude.angular_velocity[row], attitude.wheel_momentum[row])


class _Log:
    """The record under way, and what has been announced for the step."""

    def __init__(self, formation: FormationPlan) -> None:
        steps, count = formation.timing.steps, len(formation.names)
        satellites = formation.topics.satellites
        self.step = 0
        self._announces = formation.announces
        self._messages = np.zeros((count, WIDTH[self._announces]))
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
        unknown: dict[str, Any] = {
            **without("thruster", count, steps),
            **without("filter", count, steps if self._filters else None),
            **without("plans", count, steps if self._plans else None),
            **without("attitude", count, steps if self._turns else None),
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

    def announced(self, groups: list[_Group]) -> None:
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
            self.record.arc_length[self.step], self.record.rate[self.step] = self._messages.T

    def _announced(self, group: _Group) -> None:
        """Take in what the satellites of a group announce for the coming step."""
        row, message = group.row, group.satellite.announce()
        self._time[row] = message.time
        self._messages[row] = encode(message)
        for byzantine in self._byzantine:
            if byzantine in group.members:
                self._messages[byzantine] = self._faults.corrupt(
                    byzantine, self._messages[byzantine], self.step
                )

    def rejoined(self, group: _Group) -> None:
        """Record what a satellite that rejoins announces for its first step; its neighbours do not use it."""
        row = group.row
        self._announced(group)
        if self._announces == "arc_length":
            self.record.arc_length[self.step, row], self.record.rate[self.step, row] = self._messages[row]
        self._without_announcement.add(row)
        self._fresh[row] = 0.0

    def moved(self, plant: Plant, attitude: Attitude | None) -> None:
        record, step, motion, measured = self.record, self.step, plant.motion(), plant.measured()
        record.position[step] = motion.position
        record.velocity[step] = motion.velocity
        if self.measures:
            record.measured_position[step] = measured.position
            record.measured_velocity[step] = measured.velocity
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
        if self._filters:
            for name in ESTIMATES:
                getattr(record, name)[step, row] = np.nan
            record.estimated_position_error[step, row] = np.nan
            record.estimated_velocity_error[step, row] = np.nan

    def decided(self, row: Row, decision: Decision) -> None:
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
        if self._filters:
            if decision.estimate is not None:
                record.estimate_covariance[step, row] = decision.estimate.covariance
                record.innovation[step, row] = decision.estimate.innovation
                record.rejected_measurements[step, row] = decision.estimate.rejected
            estimated = decision.motion
            record.estimated_position_error[step, row] = estimated.position - reference.position
            record.estimated_velocity_error[step, row] = estimated.velocity - reference.velocity

    def wheel_torque(self) -> NDArray[np.float64] | None:
        """What was commanded to the wheels in this step; None when nobody has any."""
        return self.record.wheel_torque[self.step] if self._turns else None

    def finished(self, formation: FormationPlan) -> FlightRecord:
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
