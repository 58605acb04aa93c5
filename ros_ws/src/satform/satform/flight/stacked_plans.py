# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Which runs can be flown as one formation, and why others cannot."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from satform.dynamics.cw_model import CwDynamics
from satform.dynamics.stacked_models import stacked_kind
from satform.equipment.sensor import Sensor
from satform.flight.compile import FormationPlan
from satform.membership.formation import has_individual_events
from satform.numeric import stacking


@dataclass(frozen=True)
class Grouping:
    """Runs by how they can be flown.

    Attributes:
        groups: runs that can be flown as one, by their indices, ascending.
        alone: why a run cannot be flown with any other, by its index.
    """

    groups: tuple[tuple[int, ...], ...]
    alone: dict[int, str]


def group_runs(plans: Sequence[FormationPlan]) -> Grouping:
    """Runs that can be flown as one formation.

    They may differ in every number of a part: starts, gains, seeds, noise, curves, graphs, the orbit's rate
    with CW dynamics. They may not differ in what parts there are, in satellites, control period or duration.

    Args:
        plans: of the runs.
    """
    kinds: dict[tuple[Any, ...], list[int]] = {}
    alone: dict[int, str] = {}
    for index, plan in enumerate(plans):
        reason = _never(plan)
        if reason:
            alone[index] = reason
        else:
            kinds.setdefault(tuple(_kind(plan).values()), []).append(index)
    groups = [tuple(members) for members in kinds.values() if len(members) > 1]
    single = [members[0] for members in kinds.values() if len(members) == 1]
    largest = max(groups, key=len, default=None)
    for index in single:
        if largest is None:
            alone[index] = "there is no other run of its kind"
        else:
            alone[index] = _difference(plans[index], plans[largest[0]])
    return Grouping(tuple(groups), alone)


def _never(plan: FormationPlan) -> str:
    """Why a run cannot be flown with any other; empty if it can."""
    if has_individual_events(plan.membership.events):
        return "satellites are lost in it"
    if not plan.faults.empty:
        return "equipment or messages are faulty in it"
    kind = stacked_kind(plan.plant.dynamics)
    return kind if isinstance(kind, str) else ""


def _kind(plan: FormationPlan) -> dict[str, Any]:
    """What has to be the same in runs that are flown as one, by what it is."""
    graph, plant = plan.membership.possible_graph, plan.plant
    neighbours = [graph.neighbours(index) for index in range(len(plan.names))]
    model = () if isinstance(plant.dynamics, CwDynamics) else plan.dynamics_text
    return {
        "the satellites' names": plan.names,
        "the control period": plan.timing.step,
        "the duration": plan.timing.steps,
        "what satellites exchange": plan.announces,
        "the dynamics": (stacked_kind(plant.dynamics), model),
        "the number of neighbours": tuple(len(own) for own in neighbours),
        "the steps at which the graph changes": tuple(sorted(plan.membership.events)),
        "whether links lose or delay messages": plan.links.links is None,
        "the limits": plan.limits.limits.model_dump_json(),
        "the kinds of control law, curve, filter or pointing": tuple(
            stacking.kind(plan.satellite(index, own)) for index, own in enumerate(neighbours)
        ),
        "the thrusters": tuple(thruster is None for thruster in plant.thrusters),
        "the sensors' update and latency": tuple(_sensor_kind(sensor) for sensor in plant.sensors),
        "the sub-steps of the attitude": tuple(own and own.parts for own in plant.attitudes),
    }


def _sensor_kind(sensor: Sensor | None) -> tuple[int, int] | None:
    return None if sensor is None else (sensor.update, sensor.latency)


def _difference(plan: FormationPlan, other: FormationPlan) -> str:
    own, common = _kind(plan), _kind(other)
    unlike = [name for name in own if own[name] != common[name]]
    return f"it differs from the other runs in {' and in '.join(unlike)}"
