# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about motions that navigation cannot observe with the readings that reach each satellite."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from satform.consensus.graph import Graph
from satform.equipment.sensors.protocol import Scene, SensorChannel
from satform.flight.compile_satellite import flight_plan
from satform.flight.plans import FlightPlan
from satform.membership.formation import topology_changes
from satform.navigation.observability import PlannedFlight, Sight, observability, sources
from satform.navigation.satellite_navigation import SatelliteNavigation
from satform.scenario import Scenario

_SAMPLES = 120
"""Times of the planned flight at which readings are looked at, at most."""

_LONG = 0.25
"""Part of a flight for which a graph has to hold to be judged by itself."""


def observability_warnings(scenario: Scenario) -> list[str]:
    """A sentence for each group of satellites whose navigation leaves a motion unobservable."""
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    navigations = {index: plan.navigation for index, plan in enumerate(plans) if plan.navigation is not None}
    if not navigations:
        return []
    last, steps = scenario.timing.steps, planned_steps(scenario)
    flight = planned_flight(scenario, plans, next(iter(navigations.values())), steps)
    sights = {
        index: [sight(scenario, flight, channel, [*steps, last]) for channel in own.channels if channel.model]
        for index, own in navigations.items()
    }
    asked = {index: _not_known(scenario, index, own.members) for index, own in navigations.items()}
    found: dict[str, str] = {}
    for when, graph in _graphs(scenario):
        for sentence in _of_graph(flight, navigations, asked, sights, graph):
            found.setdefault(sentence, when)
    return [f"navigation: {when}{sentence}" for sentence, when in found.items()]


def planned_steps(scenario: Scenario) -> list[int]:
    """Numbers of the steps at which a planned flight is looked at, ascending from 0."""
    last = scenario.timing.steps
    steps: list[int] = np.unique(np.linspace(0, last, _SAMPLES, endpoint=False).astype(np.int64)).tolist()
    return steps


def planned_flight(
    scenario: Scenario, plans: Sequence[FlightPlan], navigation: SatelliteNavigation, steps: Sequence[int]
) -> PlannedFlight:
    """Desired motion of all satellites at some steps: on their paths, or free from their `start`.

    Args:
        scenario: what is flown.
        plans: of its satellites.
        navigation: whose model of the motion is used.
        steps: numbers of steps, ascending from 0.
    """
    transitions, reached = [np.eye(6)], 0
    for step in steps[1:]:
        transition = transitions[-1]
        for number in range(reached, step):
            transition = navigation.model.commanded.over(number).transition @ transition
        transitions.append(transition)
        reached = step
    over, times = np.array(transitions), scenario.timing.step * np.array(steps, dtype=np.float64)
    states = np.empty((len(steps), len(plans), 6))
    for index, plan in enumerate(plans):
        if scenario.satellites[index].start is not None:
            states[:, index] = over @ np.concatenate((plan.start.position, plan.start.velocity))
            continue
        rate = plan.nominal_rate * np.ones_like(times)
        desired = plan.path.reference(plan.arc_length + rate * times, rate, np.zeros_like(times))
        states[:, index] = np.concatenate((desired.position, desired.velocity), axis=-1)
    return PlannedFlight(states, over, scenario.orbit.rate, tuple(own.name for own in scenario.satellites))


def sight(scenario: Scenario, flight: PlannedFlight, channel: SensorChannel, edges: Sequence[int]) -> Sight:
    """When a channel has readings in a planned flight.

    Field of view, range, and the Earth in between are those of the sample before; the Sun is left out. A
    satellite with attitude is taken to point as it has to.

    Args:
        scenario: what is flown.
        flight: as planned, at K times.
        channel: of a sensor.
        edges: numbers of the steps of these times, and of the end of the flight, K + 1.
    """
    model = channel.model
    assert model is not None  # noqa: S101 - the caller has seen to it
    turns = scenario.satellite(model.observer).attitude is not None
    due = np.array([channel.timing.is_due(step) for step in range(edges[-1])], dtype=np.float64)
    readings = np.add.reduceat(due, edges[:-1])
    if not turns:
        first = next((step for step in range(edges[-1]) if due[step]), 0)
        for row, state in enumerate(flight.states):
            scene = Scene(
                time=0.0,
                position=state[:, :3],
                velocity=state[:, 3:],
                chief_radius=np.asarray(scenario.orbit.radius),
            )
            if np.isnan(channel.reading(scene, first, np.zeros(channel.draws))).any():
                readings[row] = 0.0
    return Sight(model, readings)


def _graphs(scenario: Scenario) -> Iterator[tuple[str, Graph]]:
    """All edges that there are at some time together, then each graph that holds for long, with its begin."""
    yield "", scenario.possible_graph()
    last = scenario.timing.steps
    changes = topology_changes(scenario.membership_plan().events)
    states = [(0, scenario.communication_graph()), *((step, event.graph) for step, event in changes)]
    ends = [step for step, _ in states[1:]] + [last]
    for (begin, graph), end in zip(states, ends, strict=True):
        if end - begin > _LONG * last:
            yield (f"from {begin * scenario.timing.step:g} s on: " if begin else ""), graph


def _not_known(scenario: Scenario, index: int, members: Sequence[int]) -> tuple[int, ...]:
    """The satellites of a navigation whose motion at the start it does not know: all but its references."""
    own = scenario.satellite(index).navigation
    references = own.references if own is not None else ()
    return tuple(member for member in members if scenario.satellites[member].name not in references)


def _of_graph(
    flight: PlannedFlight,
    navigations: Mapping[int, SatelliteNavigation],
    asked: Mapping[int, tuple[int, ...]],
    sights: Mapping[int, Sequence[Sight]],
    graph: Graph,
) -> Iterator[str]:
    """Sentences about one graph, each for all satellites that have the same readings."""
    reach = sources(graph)
    groups: dict[tuple[tuple[int, ...], tuple[int, ...]], list[str]] = {}
    for index, navigation in navigations.items():
        from_whom = {index} if navigation.exchange is None else reach[index] & sights.keys()
        groups.setdefault((tuple(sorted(from_whom)), asked[index]), []).append(flight.names[index])
    for (known, members), names in groups.items():
        if not members:
            continue
        found = observability(flight, [own for index in known for own in sights[index]], members)
        if found.words:
            yield (
                f"{', '.join(names)}: on the planned motion the readings that arrive do not show "
                f"{_listed(found.words)}; of that the estimate knows no more than at the start. What would "
                "help is a sensor that shows it, such as gnss, an edge of the graph from a satellite that "
                "has one, or manoeuvres"
            )


def _listed(words: Sequence[str], most: int = 4) -> str:
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return "; ".join(words[:most]) + more
