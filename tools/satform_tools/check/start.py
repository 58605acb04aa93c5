# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about the start: coincident positions, phase differences, distances and limits."""

from collections.abc import Iterator

import numpy as np

from satform.consensus.graph import Graph
from satform.control.artificial_potential import ArtificialPotentialSpec
from satform.flight.compile import limit_plan, plant_plan
from satform.flight.compile_satellite import flight_plan, motion_at_start
from satform.flight.limits import LimitCheck
from satform.flight.plant import Plant
from satform.numeric.elementwise import Array
from satform.scenario import Scenario

_MOST_PAIRS = 20_000
"""Largest number of pairs of satellites that are checked: all pairs of two hundred."""

_MOST_SENTENCES = 5
"""Largest number of sentences of one kind; more are counted."""

_SAME_POSITION = 1e-9
"""Largest distance of coincident satellites relative to the distance from the chief."""


def start_warnings(scenario: Scenario) -> list[str]:
    """Sentences about a start that the scenario probably does not intend."""
    return [
        *_beyond_limits(scenario),
        *_few(list(_coincident(scenario))),
        *_few(list(_far_phases(scenario))),
        *_few(list(_too_close(scenario))),
        *_few(list(_full_wheels(scenario))),
    ]


def _beyond_limits(scenario: Scenario) -> list[str]:
    """A sentence about the first satellite whose start ends the flight at once."""
    with np.errstate(all="ignore"):
        end = LimitCheck(limit_plan(scenario)).of_plant(Plant(plant_plan(scenario)))
    return [] if end is None else [f"limits: {end.sentence}; the flight ends before its first command"]


def _few(found: list[str]) -> list[str]:
    more = len(found) - _MOST_SENTENCES
    if more <= 0:
        return found
    return [*found[:_MOST_SENTENCES], f"satellites: and {more} more like the last one"]


def _linked_pairs(scenario: Scenario) -> Iterator[tuple[int, int]]:
    """Pairs of satellites that the graph connects, directly or over others; the first of very many."""
    part = _parts(scenario.possible_graph())
    left = _MOST_PAIRS
    for first in range(len(part)):
        for second in range(first + 1, len(part)):
            if part[first] != part[second]:
                continue
            left -= 1
            if left < 0:
                return
            yield first, second


def _parts(graph: Graph) -> list[int]:
    """Number of the weakly connected component of each satellite."""
    part = list(range(len(graph)))

    def root(node: int) -> int:
        while part[node] != node:
            part[node] = part[part[node]]
            node = part[node]
        return node

    for sender, receiver in graph.edges:
        part[root(sender)] = root(receiver)
    return [root(node) for node in range(len(part))]


def _coincident(scenario: Scenario) -> Iterator[str]:
    position = motion_at_start(scenario).position
    names = [satellite.name for satellite in scenario.satellites]
    # Satellites that exchange no messages are compared with each other, and may coincide.
    for first, second in _linked_pairs(scenario):
        apart = float(np.linalg.norm(position[first] - position[second]))
        if apart <= _SAME_POSITION * max(1.0, float(np.linalg.norm(position[first]))):
            yield (
                f"satellites: {names[first]} and {names[second]} start at the same position, "
                f"{_vector(position[first])} m"
            )


def _far_phases(scenario: Scenario) -> Iterator[str]:
    if scenario.consensus.announces != "arc_length":
        return
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    phase = [float(plan.arc_length) - float(plan.phase_offset) for plan in plans]
    periods = [float(plan.path.period) for plan in plans]
    names = [satellite.name for satellite in scenario.satellites]
    for first, second in _linked_pairs(scenario):
        period = min(periods[first], periods[second])
        apart = abs(phase[second] - phase[first])
        if period <= 0.0 or apart <= 0.5 * period * (1.0 + _SAME_POSITION):
            continue
        turns = round((phase[second] - phase[first]) / period)
        nearer = float(plans[second].arc_length) - turns * period
        yield (
            f"satellites: the phases of {names[first]} and {names[second]} differ by {apart:g} m, "
            f"{apart / period:.4g} of a period of {period:g} m, all of which the consensus has to remove; at "
            f"an arc_length of {nearer:.10g} m {names[second]} has the same position on its orbit, and a "
            f"phase that differs by {abs(phase[second] - turns * period - phase[first]):g} m"
        )


def _too_close(scenario: Scenario) -> Iterator[str]:
    position = motion_at_start(scenario).position
    names = [satellite.name for satellite in scenario.satellites]
    for index, name in enumerate(names):
        law = scenario.satellite(index).controller
        if not isinstance(law, ArtificialPotentialSpec):
            continue
        for other in range(len(names)):
            apart = float(np.linalg.norm(position[index] - position[other]))
            follows = other in scenario.communication_graph().neighbours(index)
            if other == index or apart > law.safe_distance or not (follows or other > index):
                continue
            law_text = "at which its potential is infinite" if follows else "which its law does not use"
            yield (
                f"satellites: {name} starts {apart:.6g} m from {names[other]}, within the safe_distance of "
                f"{law.safe_distance:g} m, {law_text}"
            )


def _full_wheels(scenario: Scenario) -> Iterator[str]:
    for index, own in enumerate(scenario.satellites):
        attitude, flown = scenario.satellite(index).attitude, flight_plan(scenario, index).orientation
        if attitude is None or flown is None or attitude.wheel_momentum_limit is None:
            continue
        largest = float(np.max(np.abs(flown.start.wheel_momentum)))
        if largest > attitude.wheel_momentum_limit:
            yield (
                f"satellites: a wheel of {own.name} starts with {largest:.4g} N m s, beyond its "
                f"wheel_momentum_limit of {attitude.wheel_momentum_limit:g} N m s"
            )


def _vector(values: Array) -> str:
    return f"({', '.join(f'{0.0 if abs(value) < 1e-9 else float(value):.6g}' for value in values)})"
