# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The record of a flight from the arrays that groups of satellites exchanged."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.bag.errors import BagError
from satform.bag.format import EVERY, GROUP_MEMBERS
from satform.bag.message_types import TopicMessages, decoded
from satform.common.printable_text import reason
from satform.communication.messages import encode
from satform.communication.satellite_groups import SatelliteGroups
from satform.communication.topic_table import NUMBERS_OF_A_SATELLITE, topic_name
from satform.flight.compile import FormationPlan
from satform.flight.satellite_step import first_announcement
from satform.numeric.elementwise import Array
from satform.record.early_end import EarlyEnd
from satform.record.flight_record import FlightRecord
from satform.record.quantities import OPTIONAL_EQUIPMENT, without


def group_record(
    messages: Callable[[str], TopicMessages],
    plan: FormationPlan,
    metadata: Mapping[str, str],
    early_end: EarlyEnd | None,
    file: str,
) -> FlightRecord:
    """The record of a flight in which groups of satellites exchanged arrays.

    Args:
        messages: gives those of a topic by its name.
        plan: of the flight's parts.
        metadata: of the groups, as the recorder has written it.
        early_end: why the flight ended before its last step; None if it did not.
        file: for errors.

    Returns:
        The flight up to the last step of which everything is there.

    Raises:
        BagError: steps were left out or are missing, or messages have another form.
    """
    every = metadata.get(EVERY, "")
    if every != "1":
        raise BagError(
            f"{file}: has only the steps that are divisible by {every}, since all would be too many; figures "
            "and reports need all steps: make the flight shorter"
        )
    try:
        groups = SatelliteGroups.of_text(metadata.get(GROUP_MEMBERS, ""), plan.membership.possible_graph)
    except ValueError as error:
        raise BagError(f"{file}: its record of groups {error}") from None
    found = _group_arrays(messages, groups, file)
    position, velocity = found.states["position"], found.states["velocity"]
    if not len(position):
        why = "" if early_end is None else f": {early_end.sentence}"
        raise BagError(f"{file}: holds no complete step{why}")
    count, steps = len(groups.graph), len(position) - 1
    reference_position = found.tracking["reference_position"]
    reference_velocity = found.tracking["reference_velocity"]
    absent: dict[str, Any] = {
        name: values
        for equipment in (*OPTIONAL_EQUIPMENT, "attitude", "pointing")
        for name, values in without(equipment, count, None).items()
    } | without("thruster", count, steps)
    return FlightRecord(
        satellites=plan.names,
        step=plan.timing.step,
        position=position,
        velocity=velocity,
        measured_position=position,
        measured_velocity=velocity,
        acceleration=found.commands["acceleration"],
        applied_acceleration=found.states["applied_acceleration"][1:],
        reference_position=reference_position,
        reference_velocity=reference_velocity,
        reference_acceleration=found.tracking["reference_acceleration"],
        sliding_variable=found.tracking["sliding_variable"],
        estimated_position_error=position[:-1] - reference_position,
        estimated_velocity_error=velocity[:-1] - reference_velocity,
        **_phases(plan, found.commands),
        **absent,
        early_end=early_end,
    )


def _phases(plan: FormationPlan, commands: Mapping[str, Array]) -> dict[str, Any]:
    """Arc lengths and their rates at each state: those of the start, then what went with each command."""
    plans = [plan.satellite(index) for index in range(len(plan.names))]
    first = np.array([encode(first_announcement(own)) for own in plans])
    return {
        name: np.concatenate((first[None, :, column], commands[f"announced_{name}"]))
        for column, name in enumerate(("arc_length", "rate"))
    }


@dataclass(frozen=True)
class _GroupArrays:
    """What groups exchanged, of all satellites in the order of the scenario.

    Attributes:
        states: lists of the states, shape (states, N, 3) each.
        commands: lists of the commands, shape (steps, N) or (steps, N, 3) each.
        tracking: lists of what was followed, shape (steps, N, 3) each.
    """

    states: dict[str, Array]
    commands: dict[str, Array]
    tracking: dict[str, Array]


def _group_arrays(
    messages: Callable[[str], TopicMessages], groups: SatelliteGroups, file: str
) -> _GroupArrays:
    """Read what groups exchanged.

    Args:
        messages: gives those of a topic by its name.
        groups: of the flight.
        file: for errors.

    Returns:
        The arrays up to the last step of which everything is there.

    Raises:
        BagError: messages have another form, or steps are missing.
    """
    of_kinds = {
        kind: [
            _lists(messages(topic_name(kind, name)), kind, len(members), file)
            for name, members in zip(groups.names, groups.members, strict=True)
        ]
        for kind in ("group_state", "group_command", "group_tracking")
    }
    counts = {kind: min(len(next(iter(own.values()))) for own in of_kinds[kind]) for kind in of_kinds}
    steps = max(0, min(counts["group_state"] - 1, counts["group_command"], counts["group_tracking"]))
    states = min(counts["group_state"], steps + 1)
    return _GroupArrays(
        states=_whole(of_kinds["group_state"], groups, states),
        commands=_whole(of_kinds["group_command"], groups, steps),
        tracking=_whole(of_kinds["group_tracking"], groups, steps),
    )


def _lists(messages: TopicMessages, kind: str, count: int, file: str) -> dict[str, Array]:
    """The lists in the messages of a topic, shape (messages, satellites) or (messages, satellites, 3)."""
    numbers = NUMBERS_OF_A_SATELLITE[kind]
    found: dict[str, Array] = {}
    try:
        rows = decoded(messages)[0] if messages.messages else []
        steps = [int(row.step) for row in rows]
        for name, width in numbers.items():
            shape = (len(rows), count, width) if width > 1 else (len(rows), count)
            found[name] = np.array([getattr(row, name) for row in rows], dtype=np.float64).reshape(shape)
    except Exception as error:  # the decoder is made from the bag's text, which may be any
        raise BagError(f"{file}: {messages.topic} has messages of another form: {reason(error)}") from None
    if steps != list(range(len(steps))):
        missing = next(index for index, step in enumerate(steps) if step != index)
        raise BagError(
            f"{file}: {messages.topic} has step {steps[missing]} where step {missing} was to follow"
        )
    return found


def _whole(lists: Sequence[dict[str, Array]], groups: SatelliteGroups, rows: int) -> dict[str, Array]:
    """The lists of all groups as arrays of all satellites."""
    found: dict[str, Array] = {}
    for name, first in lists[0].items():
        whole = np.empty((rows, len(groups.graph), *first.shape[2:]))
        for own, members in zip(lists, groups.rows, strict=True):
            whole[:, members] = own[name][:rows]
        found[name] = whole
    return found
