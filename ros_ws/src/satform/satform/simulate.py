"""The in-process run: one loop, no ROS, the oracle that every other way to run is held against."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.announcements import WIDTH, AnyHeard, heard, numbers
from satform.attitude_figures import FIGURES, attitude_figures
from satform.consensus.graph import Graph
from satform.control.protocol import Motion
from satform.orientation import Attitude
from satform.plant import Plant
from satform.record import ATTITUDE_VECTORS, QUANTITIES, FlightRecord, no_attitude, no_propulsion
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
        motion, measured_steps, attitude = plant.measured(), plant.measured_steps(), plant.attitude()
        log.announced(groups)
        log.moved(plant, attitude)
        for group in groups:
            own = Motion(motion.position[group.members], motion.velocity[group.members])
            # Satellites whose filters are told at different times do not fly as one.
            measured_step = int(measured_steps[group.members].flat[0])
            turned = None if attitude is None else _rows(attitude, group)
            decision = group.satellite.act(own, log.heard(group), measured_step, turned)
            log.decided(group.members, decision)
        plant.advance(log.record.acceleration[step], log.wheel_torque())
        log.step = step + 1
        if progress:
            progress(step + 1)
    log.announced(groups)
    log.moved(plant, plant.attitude())
    return log.finished(scenario)


def _rows(attitude: Attitude, group: _Group) -> Attitude | None:
    """What the satellites of a group are told of their attitudes; None when they have none."""
    if group.satellite.plan.orientation is None:
        return None
    places = group.members
    return Attitude(attitude.mrp[places], attitude.angular_velocity[places], attitude.wheel_momentum[places])


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
        self._announces = scenario.consensus.announces
        self._said = np.zeros((count, WIDTH[self._announces]))
        self._time = np.zeros(count)
        self._measures = any(satellite.sensor is not None for satellite in satellites)
        self._filters = any(satellite.filter is not None for satellite in satellites)
        position, velocity = np.empty((steps + 1, count, 3)), np.empty((steps + 1, count, 3))
        acceleration = np.empty((steps, count, 3))
        self._turns = any(satellite.attitude is not None for satellite in satellites)
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
            arc_length=np.zeros((steps + 1, count)),
            rate=np.zeros((steps + 1, count)),
            reference_position=np.empty((steps, count, 3)),
            reference_velocity=np.empty((steps, count, 3)),
            reference_acceleration=np.empty((steps, count, 3)),
            sliding_variable=np.empty((steps, count, 3)),
            believed_position_error=np.empty((steps if self._filters else 0, count, 3)),
            believed_velocity_error=np.empty((steps if self._filters else 0, count, 3)),
            **no_propulsion(steps + 1, count),
            **no_attitude(steps if self._turns else -1, count),
            **{name: np.empty((0, count)) for name in FIGURES},
        )

    def announced(self, groups: list[_Group]) -> None:
        for group in groups:
            said = group.satellite.announce()
            self._time[group.members] = said.time
            self._said[group.members] = numbers(said)
        if self._announces == "arc_length":
            self.record.arc_length[self.step], self.record.rate[self.step] = self._said.T

    def moved(self, plant: Plant, attitude: Attitude | None) -> None:
        record, step, motion, measured = self.record, self.step, plant.motion(), plant.measured()
        record.position[step] = motion.position
        record.velocity[step] = motion.velocity
        if self._measures:
            record.measured_position[step] = measured.position
            record.measured_velocity[step] = measured.velocity
        if attitude is not None:
            for name in ATTITUDE_VECTORS:
                getattr(record, name)[step] = getattr(attitude, name)
            for group in plant.turning:
                limits = plant.wheel_limits()[group.members]
                record.torque_limited[step, group.members] = limits[:, 0]
                record.momentum_limited[step, group.members] = limits[:, 1]
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

    def heard(self, group: _Group) -> AnyHeard:
        told = self._said[group.neighbours]
        return heard(self._announces, told, self._time[group.neighbours], group.weight)

    def decided(self, members: Index, decision: Decision) -> None:
        record, step = self.record, self.step
        record.acceleration[step, members] = decision.acceleration
        record.reference_position[step, members] = decision.reference.position
        record.reference_velocity[step, members] = decision.reference.velocity
        record.reference_acceleration[step, members] = decision.reference.acceleration
        record.sliding_variable[step, members] = decision.sliding_variable
        if decision.wheel_torque is not None:
            record.wheel_torque[step, members] = decision.wheel_torque
        if self._filters:
            reference, believed = decision.reference, decision.motion
            record.believed_position_error[step, members] = believed.position - reference.position
            record.believed_velocity_error[step, members] = believed.velocity - reference.velocity

    def wheel_torque(self) -> NDArray[np.float64] | None:
        """What was commanded to the wheels in this step; None when nobody has any."""
        return self.record.wheel_torque[self.step] if self._turns else None

    def finished(self, scenario: Scenario) -> FlightRecord:
        record = self.record
        if self._turns:
            known = {name: getattr(record, name) for name in QUANTITIES}
            figures: dict[str, Any] = attitude_figures(scenario, known)
            record = replace(record, **figures)
        if self._filters:
            return record
        # Without filters satellites believe what they are told.
        return replace(
            record,
            believed_position_error=record.measured_position[:-1] - record.reference_position,
            believed_velocity_error=record.measured_velocity[:-1] - record.reference_velocity,
        )
