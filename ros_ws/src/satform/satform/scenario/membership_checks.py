# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks of changes of the communication graph and of faults against the rest of a scenario."""

from collections.abc import Mapping, Sequence

from satform.common.spec import Complaint
from satform.consensus.arc_length import Announces
from satform.consensus.graph import Graph
from satform.membership.faults import MOST_STEPS, FaultSpec, SatelliteLostSpec, step_at
from satform.membership.formation import GraphChangeSpec
from satform.scenario.parts import SatelliteSpec, Timing


def schedule_complaints(
    changes: Sequence[GraphChangeSpec],
    graph: Graph,
    names: Sequence[str],
    timing: Timing,
    announces: Announces,
) -> list[Complaint]:
    """What is wrong with changes of the communication graph.

    Args:
        changes: in their order in the scenario.
        graph: at the start of the flight.
        names: of the satellites, in the order of the graph's rows.
        timing: of the flight.
        announces: what satellites send each other.
    """
    if changes and announces == "motion":
        sentence = "a satellite that follows a neighbour needs it as an in-neighbour all the time"
        return [(("graph_schedule",), sentence)]
    complaints: list[Complaint] = []
    for index, change in enumerate(changes):
        if change.at >= timing.duration:
            sentence = f"at {change.at:g} s is not earlier than the flight's end at {timing.duration:g} s"
            complaints.append((("graph_schedule", index, "at"), sentence))
        try:
            graph = change.applied(graph, names)
        except ValueError as error:
            complaints.append((("graph_schedule", index), str(error)))
    return complaints


def fault_complaints(
    faults: Sequence[FaultSpec],
    satellites: Mapping[str, SatelliteSpec],
    timing: Timing,
    announces: Announces,
    checkpoint_period: float | None,
) -> list[Complaint]:
    """What is wrong with faults.

    Args:
        faults: in their order in the scenario.
        satellites: by their names, each with what it has from the defaults.
        timing: of the flight.
        announces: what satellites send each other.
        checkpoint_period: time between two checkpoints, s; None where none are stored.
    """
    complaints: list[Complaint] = []
    back: dict[str, int] = {}
    for index, fault in enumerate(faults):
        path = ("faults", index)
        if fault.satellite not in satellites:
            sentence = f"there is no satellite {fault.satellite}; there are {', '.join(sorted(satellites))}"
            complaints.append(((*path, "satellite"), sentence))
        complaints += [((*path, field), text) for field, text in fault.complaints(timing.duration)]
        satellite = satellites.get(fault.satellite)
        if fault.needs and satellite is not None and getattr(satellite, fault.needs) is None:
            sentence = f"{fault.satellite} has no {fault.needs} that could fail in this way: give it one"
            complaints.append((path, sentence))
        if fault.corrupts_phase and announces != "arc_length":
            sentence = "satellites that send each other their motion send no phase to falsify"
            complaints.append((path, sentence))
        if not isinstance(fault, SatelliteLostSpec):
            continue
        if fault.rejoin_at is not None and fault.memory == "checkpoint" and checkpoint_period is None:
            sentence = (
                f"{fault.satellite} rejoins from its checkpoint, but none are stored: give the scenario "
                "a checkpoint_period, or the fault memory: plan"
            )
            complaints.append((path, sentence))
        if back.get(fault.satellite, -1) >= step_at(fault.at, timing.step):
            sentence = (
                f"{fault.satellite} does not fly at {fault.at:g} s, so that it cannot be lost then; list "
                "its losses in their order, each later than its return from the one before"
            )
            complaints.append((path, sentence))
        back[fault.satellite] = (
            MOST_STEPS if fault.rejoin_at is None else step_at(fault.rejoin_at, timing.step)
        )
    return complaints
