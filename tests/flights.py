# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The shipped scenarios, for the tests that fly them."""

import functools
from collections.abc import Sequence
from pathlib import Path

from satform.flight.compile_satellite import flight_plan
from satform.flight.satellite import Satellite
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, load_scenario

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@functools.cache
def shipped(name: str, *changes: str) -> Scenario:
    """A shipped scenario, with changes such as `timing.step=1.0`; read once, as nothing can change it."""
    return load_scenario(SCENARIOS / f"{name}.yaml", changes)


def shortened(name: str, duration: float, *changes: str) -> Scenario:
    """A shipped scenario flown for a while only, and not judged."""
    return shipped(name, f"timing.duration={duration}", "expect=[]", *changes)


@functools.cache
def begun(name: str, interval: int) -> tuple[Scenario, FlightRecord]:
    """A shipped scenario over three intervals of checkpoints of a number of steps each, and its flight."""
    step = shipped(name).timing.step
    scenario = shortened(name, 3 * interval * step, f"checkpoint_period={interval * step}")
    return scenario, simulate(scenario)


def satellite_of(scenario: Scenario, index: int) -> Satellite:
    """The flight software of one satellite of a scenario, before its first step."""
    neighbours = scenario.possible_graph().neighbours(index)
    return Satellite(flight_plan(scenario, index, neighbours), len(neighbours))


def satellites_together(scenario: Scenario, indices: Sequence[int]) -> Satellite:
    """Several satellites of a scenario flown as one.

    Raises:
        ValueError: they differ in kind, so that they cannot be stacked.
    """
    neighbours = [scenario.possible_graph().neighbours(index) for index in indices]
    plans = [flight_plan(scenario, index, own) for index, own in zip(indices, neighbours, strict=True)]
    return Satellite.stacked(plans, max(map(len, neighbours)))
