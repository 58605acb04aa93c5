# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about accelerations of other satellites that a navigation filter neither knows nor allows for."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from satform.flight.compile_satellite import flight_plan
from satform.flight.plans import FlightPlan
from satform.navigation.satellite_navigation import SatelliteNavigation
from satform.numeric.elementwise import Array
from satform.planning.impulsive_guidance import TimedBurnsSpec
from satform.scenario import Scenario
from satform_tools.check.observability import planned_flight, planned_steps


def neighbour_acceleration_warnings(scenario: Scenario) -> list[str]:
    """A sentence for each filter that allows for less acceleration of another satellite than is planned.

    An acceleration that lasts for a control period changes the velocity by the acceleration times the period;
    white noise of density q by the root of q times the period. Planned accelerations that last longer need
    more; what controllers command beside the plan is not known here.
    """
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    navigations = {index: plan.navigation for index, plan in enumerate(plans) if plan.navigation is not None}
    unknown = {
        index: [
            other for other in own.members if other != index and not _sends_its_command(scenario, own, other)
        ]
        for index, own in navigations.items()
    }
    if not any(unknown.values()):
        return []
    planned = _planned_accelerations(scenario, plans, next(iter(navigations.values())))
    return list(_sentences(scenario, unknown, planned))


def _sends_its_command(scenario: Scenario, navigation: SatelliteNavigation, other: int) -> bool:
    """Whether another satellite sends its commanded acceleration."""
    if navigation.exchange is None:
        return False
    return bool(scenario.possible_graph().adjacency[navigation.satellite, other])


def _sentences(scenario: Scenario, unknown: Mapping[int, Sequence[int]], planned: Array) -> Iterator[str]:
    step, names = scenario.timing.step, [satellite.name for satellite in scenario.satellites]
    for index, others in unknown.items():
        spec = scenario.satellite(index).navigation
        assert spec is not None  # noqa: S101 - a navigation is built from it
        density = np.array(spec.neighbour_acceleration_density or spec.acceleration_density)
        needed = np.square(planned[others]) * step
        if not others or not np.any(needed > density):
            continue
        row = int(np.argmax(np.max(needed / density, axis=-1)))
        axis = int(np.argmax(needed[row] / density))
        yield (
            f"navigation of {names[index]}: the plan of {names[others[row]]} has accelerations of "
            f"{planned[others[row], axis]:.3g} m/s^2, of which {names[index]} learns nothing; its filter "
            f"will be overconfident. Give it a neighbour_acceleration_density of {needed[row, axis]:.2g} "
            "m^2/s^3 at least, more if they last longer than a control period, or let the satellites "
            "exchange estimates"
        )


def _planned_accelerations(
    scenario: Scenario, plans: Sequence[FlightPlan], navigation: SatelliteNavigation
) -> Array:
    """Largest planned acceleration of each satellite on each axis beyond free motion, m/s^2, shape (N, 3)."""
    step, sampled = scenario.timing.step, planned_steps(scenario)
    every = sorted({number + next_one for number in sampled for next_one in (0, 1)})
    flight = planned_flight(scenario, plans, navigation, every)
    found = np.zeros((len(plans), 3))
    for number in sampled:
        before, after = flight.states[every.index(number)], flight.states[every.index(number + 1)]
        transition = navigation.model.commanded.over(number).transition
        held = np.abs((after - before @ transition.T)[:, 3:]) / step
        found = np.maximum(found, np.where(held > _rounding(before, step), held, 0.0))
    for index in range(len(plans)):
        law = scenario.satellite(index).controller
        if isinstance(law, TimedBurnsSpec) and law.burns:
            changes = np.abs([burn.velocity_change for burn in law.burns])
            found[index] = np.maximum(found[index], changes.max(axis=0) / step)
    return found


def _rounding(states: Array, step: float) -> float:
    """Acceleration that rounding of the planned motion may seem to need, m/s^2."""
    return 1e-12 * float(np.max(np.abs(states))) / step
