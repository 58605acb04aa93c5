"""The in-process run: one loop, no ROS, the oracle that every other way to run is held against."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from satform.consensus.arc_length import Heard
from satform.consensus.graph import Graph
from satform.control.protocol import Motion
from satform.plant import Plant
from satform.record import FlightRecord, no_propulsion
from satform.satellite import Decision, Satellite
from satform.scenario.model import Scenario

Index = NDArray[np.int64]


@dataclass(frozen=True)
class _Group:
    """Satellites that are flown by one object.

    Attributes:
        satellite: the flight software, of one satellite or of several stacked.
        members: place of each in the formation, shape (); or (n,) when stacked.
        neighbours: places of those heard, ascending, padded with the own place, shape (..., K).
        weight: 1 for those heard, 0 for padding, shape (..., K).
    """

    satellite: Satellite
    members: Index
    neighbours: Index
    weight: NDArray[np.float64]


def simulate(
    scenario: Scenario, *, together: bool = True, progress: Callable[[int], None] | None = None
) -> FlightRecord:
    """Fly a scenario in this process.

    Args:
        scenario: what to fly.
        together: whether satellites of the same kind share one step over arrays; the numbers have
            the same bits either way.
        progress: called with the number of finished steps after each.

    Returns:
        The whole flight.
    """
    plant = Plant(scenario)
    groups = _groups(scenario, together=together)
    log = _Log(scenario)
    for step in range(scenario.timing.steps):
        motion, measured_steps = plant.measured(), plant.measured_steps()
        log.announced(groups)
        log.moved(plant)
        for group in groups:
            own = Motion(motion.position[group.members], motion.velocity[group.members])
            # Satellites whose filters are told at different times do not fly as one.
            measured_step = int(measured_steps[group.members].flat[0])
            log.decided(group.members, group.satellite.act(own, log.heard(group), measured_step))
        plant.advance(log.record.acceleration[step])
        log.step = step + 1
        if progress:
            progress(step + 1)
    log.announced(groups)
    log.moved(plant)
    return log.finished()


def _groups(scenario: Scenario, *, together: bool) -> list[_Group]:
    graph = scenario.communication_graph()
    count = len(scenario.satellites)
    if together:
        try:
            return [_group(graph, Satellite.together(scenario, range(count)), np.arange(count))]
        except ValueError:
            # Satellites of different kinds cannot be stacked; each is then flown by itself.
            pass
    return [_group(graph, Satellite.of(scenario, index), np.asarray(index)) for index in range(count)]


def _group(graph: Graph, satellite: Satellite, members: Index) -> _Group:
    heard = [graph.neighbours(int(member)) for member in np.atleast_1d(members)]
    width = max(len(row) for row in heard)
    neighbours = np.empty((len(heard), width), dtype=np.int64)
    weight = np.zeros((len(heard), width))
    for row, (member, own) in enumerate(zip(np.atleast_1d(members), heard, strict=True)):
        neighbours[row] = [*own, *([member] * (width - len(own)))]
        weight[row, : len(own)] = 1.0
    shape = (*members.shape, width)
    return _Group(satellite, members, neighbours.reshape(shape), weight.reshape(shape))


class _Log:
    """The record under way, and what has been announced for the step."""

    def __init__(self, scenario: Scenario) -> None:
        steps, count = scenario.timing.steps, len(scenario.satellites)
        satellites = [scenario.satellite(index) for index in range(count)]
        self.step = 0
        self._time = np.zeros(count)
        self._measures = any(satellite.sensor is not None for satellite in satellites)
        self._filters = any(satellite.filter is not None for satellite in satellites)
        position, velocity = np.empty((steps + 1, count, 3)), np.empty((steps + 1, count, 3))
        acceleration = np.empty((steps, count, 3))
        thrusts = any(satellite.thruster is not None for satellite in satellites)
        self.record = FlightRecord(
            satellites=tuple(satellite.name for satellite in scenario.satellites),
            step=scenario.timing.step,
            position=position,
            velocity=velocity,
            measured_position=np.empty_like(position) if self._measures else position,
            measured_velocity=np.empty_like(velocity) if self._measures else velocity,
            acceleration=acceleration,
            given_acceleration=np.empty_like(acceleration) if thrusts else acceleration,
            arc_length=np.empty((steps + 1, count)),
            rate=np.empty((steps + 1, count)),
            reference_position=np.empty((steps, count, 3)),
            reference_velocity=np.empty((steps, count, 3)),
            reference_acceleration=np.empty((steps, count, 3)),
            sliding_variable=np.empty((steps, count, 3)),
            believed_position_error=np.empty((steps if self._filters else 0, count, 3)),
            believed_velocity_error=np.empty((steps if self._filters else 0, count, 3)),
            **no_propulsion(steps + 1, count),
        )

    def announced(self, groups: list[_Group]) -> None:
        for group in groups:
            said = group.satellite.announce()
            self._time[group.members] = said.time
            self.record.arc_length[self.step, group.members] = said.arc_length
            self.record.rate[self.step, group.members] = said.rate

    def moved(self, plant: Plant) -> None:
        record, step, motion, measured = self.record, self.step, plant.motion(), plant.measured()
        record.position[step] = motion.position
        record.velocity[step] = motion.velocity
        if self._measures:
            record.measured_position[step] = measured.position
            record.measured_velocity[step] = measured.velocity
        if plant.thrusters is None:
            return
        members, propulsion = plant.thrusters.members, plant.thrusters.propulsion
        record.propellant[step, members] = propulsion.propellant
        record.delta_v[step, members] = propulsion.delta_v
        record.clipped[step, members] = propulsion.clipped
        record.withheld[step, members] = propulsion.withheld
        record.starved[step, members] = propulsion.starved
        if step > 0:
            record.given_acceleration[step - 1] = plant.given

    def heard(self, group: _Group) -> Heard:
        arc_length, rate = self.record.arc_length[self.step], self.record.rate[self.step]
        return Heard(
            arc_length[group.neighbours],
            rate[group.neighbours],
            self._time[group.neighbours],
            group.weight,
        )

    def decided(self, members: Index, decision: Decision) -> None:
        record, step = self.record, self.step
        record.acceleration[step, members] = decision.acceleration
        record.reference_position[step, members] = decision.reference.position
        record.reference_velocity[step, members] = decision.reference.velocity
        record.reference_acceleration[step, members] = decision.reference.acceleration
        record.sliding_variable[step, members] = decision.sliding_variable
        if self._filters:
            reference, believed = decision.reference, decision.motion
            record.believed_position_error[step, members] = believed.position - reference.position
            record.believed_velocity_error[step, members] = believed.velocity - reference.velocity

    def finished(self) -> FlightRecord:
        record = self.record
        if self._filters:
            return record
        # Without filters satellites believe what they are told.
        return replace(
            record,
            believed_position_error=record.measured_position[:-1] - record.reference_position,
            believed_velocity_error=record.measured_velocity[:-1] - record.reference_velocity,
        )
