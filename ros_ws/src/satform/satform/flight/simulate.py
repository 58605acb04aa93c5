# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The in-process run: one loop, no ROS, the oracle that every other way to run is held against."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from satform.attitude.guidance import Attitude
from satform.communication.messages import encode
from satform.communication.neighbour_buffer import Received
from satform.communication.receiver import ReceiverModel
from satform.control.protocol import Motion
from satform.flight.checkpoint import restore, save
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.flight_log import FlightGroup, FlightLog
from satform.flight.float_steps import FloatSteps
from satform.flight.limits import LimitCheck, Violation, violation_of
from satform.flight.online_parameters import OnlineParameters
from satform.flight.plant import Plant
from satform.flight.satellite import Satellite
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
from satform.navigation.satellite_navigation import NavigationInput
from satform.numeric.recording import NotRecordableError
from satform.record.early_end import EarlyEnd
from satform.record.flight_record import FlightRecord
from satform.scenario.model import Scenario


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
        step, steps = 0, formation.timing.steps
        while step < steps and not (stop and stop()):
            step = flight.fly(step, step + 1 if progress or stop else steps)
            if flight.early_end:
                break
            if progress:
                progress(step)
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
        self.log = FlightLog(formation)
        eventful = {*plan, *(step - 1 for _, step in self._needed)}
        self._float_steps = FloatSteps(self, formation.timing.steps, eventful)

    def fly(self, step: int, end: int) -> int:
        """Fly the next step, or all up to another one.

        Args:
            step: the next one.
            end: the step after the last one to be flown.

        Returns:
            The step that comes next; before the end where the flight ends early, or flies on by other means.
        """
        flown = self._float_steps.fly(step, end)
        if flown == step:
            self._float_steps.settle()
            self.step()
            flown += 1
        return flown

    def step(self) -> None:
        """Fly the next step over arrays."""
        if self._beyond_limits():
            return
        step = self.log.step
        events = self.plan.get(step, [])
        # The message that a satellite sent for this step is received although it is lost in it.
        self.log.announced(self.groups)
        if events:
            self._happen(events, step)
        self._decide_and_move(step)
        for group in self.groups:
            if group.flies:
                self._save_checkpoint(group)

    def fly_step(self, step: Any) -> None:
        """The same for a step in which nothing happens and no limit is met, as it is recorded."""
        if self._beyond_limits():
            raise NotRecordableError("the flight ends in this step")
        self.log.announced(self.groups)
        self._decide_and_move(step)

    def _decide_and_move(self, step: int) -> None:
        """What all satellites compute in a step, and the plant's motion over it."""
        log, plant = self.log, self.plant
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
            sensed = self._sensed(group, received)
            try:
                decision = group.satellite.act(own, received, measured_step, turned, applied, sensed)
            except ArithmeticError as error:
                violations[int(np.min(group.members))] = violation_of(error)
                continue
            found = self._limits.of_decision(decision, encode(group.satellite.announce()))
            if found:
                members = np.atleast_1d(group.members)
                violations.update({int(members[row]): violation for row, violation in found.items()})
            log.decided(row, decision)
        self.early_end, self.flown = self._limits.computed_end(violations, step), step
        if self.early_end:
            return
        plant.advance(log.record.acceleration[step], log.wheel_torque())
        log.step = step + 1

    def _sensed(self, group: FlightGroup, received: Received) -> NavigationInput | None:
        """What arrives at a satellite from its sensors; None for one without, and for many as one."""
        readings = None if group.members.ndim else self.plant.readings().get(int(group.members))
        if readings is None:
            return None
        return NavigationInput(readings, group.receiver.estimates(received), self.formation.graph)

    def _beyond_limits(self) -> bool:
        """Whether the flight ends because of the states of the present step."""
        self.early_end = self._limits.of_plant(self.plant)
        if self.early_end is None:
            return False
        # The step that led to states beyond the limits is no part of the flight.
        self.flown = max(0, self.plant.step - 1)
        return True

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

    def _retarget(self, satellite: int, group: FlightGroup) -> None:
        """Have a satellite fly by the target in force, if it is another one."""
        target = self.formation.targets.get(satellite)
        if target is not None and target != group.target:
            self._online_parameters(satellite, group).retarget(group.satellite, target)
            group.target = target

    def _online_parameters(self, satellite: int, group: FlightGroup) -> OnlineParameters:
        if group.online_parameters is None:
            group.online_parameters = OnlineParameters(self.plans.parameters(satellite))
        return group.online_parameters

    def _adjust(self, event: ParameterChanged) -> None:
        group = self.groups[event.satellite]
        self._online_parameters(event.satellite, group).set(group.satellite, event.name, event.value)

    def _save_checkpoint(self, group: FlightGroup) -> None:
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
        self._float_steps.settle()
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

    def _grouped(self, *, stacked: bool) -> list[FlightGroup]:
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
                return [
                    FlightGroup(satellite, ReceiverModel(self.plans.links, np.arange(count), in_neighbours))
                ]
        return [self._single(index) for index in range(count)]

    def _single(self, index: int) -> FlightGroup:
        in_neighbours = self._possible.neighbours(index)
        receiver = ReceiverModel(self.plans.links, np.asarray(index), [in_neighbours])
        return FlightGroup(
            Satellite(self.plans.satellite(index, in_neighbours), len(in_neighbours)), receiver
        )


def _rows(attitude: Attitude, group: FlightGroup) -> Attitude | None:
    """Measured attitudes of the satellites of a group; None when they have none."""
    if group.satellite.plan.orientation is None:
        return None
    row = group.row
    return Attitude(attitude.mrp[row], attitude.angular_velocity[row], attitude.wheel_momentum[row])
