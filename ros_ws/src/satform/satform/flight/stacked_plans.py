# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which runs can be flown as one formation."""

from collections.abc import Sequence
from typing import Any

from satform.dynamics.cw_model import CwDynamics
from satform.dynamics.stacked_models import stacked_kind
from satform.equipment.sensors.relative_motion import Sensor
from satform.flight.compile import FormationPlan
from satform.membership.formation import has_individual_events
from satform.numeric import stacking


def group_runs(plans: Sequence[FormationPlan]) -> list[tuple[int, ...]]:
    """Runs that can be flown as one formation.

    They may differ in every number of a part: starts, gains, seeds, noise, curves, graphs, the orbit's rate
    with CW dynamics. They may not differ in what parts there are, in satellites, control period or duration.

    Args:
        plans: of the runs.

    Returns:
        Groups of two runs or more by their indices, ascending. A run that cannot be flown with any other is
        in none of them.
    """
    kinds: dict[tuple[Any, ...], list[int]] = {}
    for index, plan in enumerate(plans):
        if not _flies_alone(plan):
            kinds.setdefault(_kind(plan), []).append(index)
    return [tuple(members) for members in kinds.values() if len(members) > 1]


def _flies_alone(plan: FormationPlan) -> bool:
    """Whether a run has losses, faults, physical links, sensors, or a model of one run's satellites only."""
    return (
        plan.plant.links is not None
        or has_individual_events(plan.membership.events)
        or not plan.faults.empty
        or any(plan.plant.channels)
        or stacked_kind(plan.plant.dynamics) is None
    )


def _kind(plan: FormationPlan) -> tuple[Any, ...]:
    """What has to be the same in runs that are flown as one."""
    graph, plant = plan.membership.possible_graph, plan.plant
    neighbours = [graph.neighbours(index) for index in range(len(plan.names))]
    model = () if isinstance(plant.dynamics, CwDynamics) else plan.dynamics_text
    return (
        plan.names,
        plan.timing.step,
        plan.timing.steps,
        plan.announces,
        (stacked_kind(plant.dynamics), model),
        tuple(len(own) for own in neighbours),
        # Steps at which the graph changes.
        tuple(sorted(plan.membership.events)),
        plan.links.links is None,
        plan.limits.limits.model_dump_json(),
        # Control law, curve, filter and pointing.
        tuple(stacking.kind(plan.satellite(index, own)) for index, own in enumerate(neighbours)),
        tuple(thruster is None for thruster in plant.thrusters),
        tuple(_sensor_kind(sensor) for sensor in plant.sensors),
        tuple(own and own.parts for own in plant.attitudes),
    )


def _sensor_kind(sensor: Sensor | None) -> tuple[int, int] | None:
    return None if sensor is None else (sensor.update, sensor.latency)
