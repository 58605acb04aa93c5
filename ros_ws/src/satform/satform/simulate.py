"""The in-process run: one loop, no ROS, the oracle that every other way to run is held against."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.consensus.arc_length import Heard
from satform.consensus.graph import Graph
from satform.control.protocol import Motion
from satform.plant import Plant
from satform.record import FlightRecord
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
        motion = plant.motion()
        log.announced(groups)
        log.moved(motion)
        for group in groups:
            own = Motion(motion.position[group.members], motion.velocity[group.members])
            log.decided(group.members, group.satellite.act(own, log.heard(group)))
        plant.advance(log.record.acceleration[step])
        log.step = step + 1
        if progress:
            progress(step + 1)
    log.announced(groups)
    log.moved(plant.motion())
    return log.record


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
        self.step = 0
        self._time = np.zeros(count)
        self.record = FlightRecord(
            satellites=tuple(satellite.name for satellite in scenario.satellites),
            step=scenario.timing.step,
            position=np.empty((steps + 1, count, 3)),
            velocity=np.empty((steps + 1, count, 3)),
            acceleration=np.empty((steps, count, 3)),
            arc_length=np.empty((steps + 1, count)),
            rate=np.empty((steps + 1, count)),
            reference_position=np.empty((steps, count, 3)),
            reference_velocity=np.empty((steps, count, 3)),
            reference_acceleration=np.empty((steps, count, 3)),
            sliding_variable=np.empty((steps, count, 3)),
        )

    def announced(self, groups: list[_Group]) -> None:
        for group in groups:
            said = group.satellite.announce()
            self._time[group.members] = said.time
            self.record.arc_length[self.step, group.members] = said.arc_length
            self.record.rate[self.step, group.members] = said.rate

    def moved(self, motion: Motion) -> None:
        self.record.position[self.step] = motion.position
        self.record.velocity[self.step] = motion.velocity

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
