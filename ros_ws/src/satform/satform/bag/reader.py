# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads a bag without ROS: arrays, scenario, and the events of the run.

Messages are decoded by the definitions in the bag.
"""

import struct
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Message, Metadata, Schema

from satform.attitude.pointing_accuracy import attitude_figures
from satform.bag.earlier_versions import renamed
from satform.bag.errors import BagError
from satform.bag.events import TYPES, EventError, Events, read_events
from satform.bag.format import (
    FILE_ATTACHMENTS,
    GROUPS_METADATA,
    ROLE,
    RUN_METADATA,
    SCENARIO_ATTACHMENT,
    TIME_METADATA,
    WALL_CLOCK,
)
from satform.bag.group_arrays import group_record
from satform.bag.message_types import TopicMessages, decoded
from satform.bag.record_arrays import (
    attitude_estimates,
    attitudes,
    motion_estimates,
    navigation,
    phases,
    propulsion,
    unsolved_plans,
    vectors,
)
from satform.bag.records import ExpansionError, records
from satform.bag.tables import Gaps, Table, read_table
from satform.common.printable_text import reason
from satform.communication.topic_table import (
    CLOCK,
    OPTIONAL_OF_EXTERNAL,
    STATUS,
    lengths_of,
    topic_name,
)
from satform.files.named_file import FileSource
from satform.flight.command_timeout import held_steps
from satform.flight.compile import compile_scenario, topic_plan
from satform.flight.compile_satellite import orientations
from satform.flight.scenario_record import with_chief
from satform.membership.absence_log import Absences, FormationStatus, happened
from satform.membership.formation import Plan
from satform.record.early_end import EarlyEnd
from satform.record.flight_record import FlightRecord
from satform.record.quantities import without
from satform.scenario import Scenario, ScenarioError, parse_scenario
from satform.scenario.parts import SatelliteSpec

READ_FAILURES = (
    McapError,
    EOFError,
    ValueError,
    IndexError,
    KeyError,
    TypeError,
    OverflowError,
    MemoryError,
    RuntimeError,
    struct.error,
)
"""What reading a file that ends early or is damaged may raise."""


@dataclass(frozen=True)
class Bag:
    """What a bag holds.

    Attributes:
        path: the MCAP file.
        scenario: what was flown.
        versions: what flew it: name and version of each part.
        record: the flight, up to the last step of which everything is there.
        messages: number of messages of each topic, by the name that it had.
        complete: whether the file was closed properly and holds the whole flight, as far as that went.
        events: what happened in the flight beside what the scenario plans, by step, to fly it once more.
        clocked: whether it was flown on the wall clock, so that it cannot be flown again to the same bits.
        history: the recorded messages about losses, the graph and gains.
    """

    path: Path
    scenario: Scenario
    versions: dict[str, str]
    record: FlightRecord
    messages: dict[str, int]
    complete: bool
    events: Plan
    clocked: bool
    history: Events


def read_bag(path: str | Path) -> Bag:
    """Read a flight from a bag folder or from its MCAP file.

    A file that was cut short by a kill is read up to its last complete chunk.

    Args:
        path: folder in rosbag2's form, or the `.mcap` file in it.

    Returns:
        The flight; its record is shorter than the scenario when the bag is.

    Raises:
        BagError: there is no such bag, or it holds no flight.
    """
    file = find_file(Path(path))
    contents = _scan(file)
    scenario = contents.scenario
    if scenario is None:
        raise BagError(
            f"{file}: holds no scenario; it was not recorded by satform, or ends before its first chunk"
        )
    statuses = _messages(contents, STATUS, file)
    record = _record(contents, scenario, statuses, file)
    events = _events(contents, scenario, statuses, file)
    whole = contents.closed and (record.steps == scenario.timing.steps or record.early_end is not None)
    counts = {contents.names[role]: len(messages) for role, messages in contents.messages.items()}
    return Bag(
        path=file,
        scenario=scenario,
        versions=contents.versions,
        record=with_chief(record, scenario, events),
        messages=counts,
        complete=whole,
        events=events,
        clocked=contents.clocked,
        history=_history(contents, file),
    )


@dataclass
class _Contents:
    """What a file holds; messages and definitions by the topics' names in the root namespace."""

    scenario: Scenario | None
    versions: dict[str, str]
    messages: dict[str, list[bytes]]
    definitions: dict[str, Schema]
    closed: bool
    clocked: bool = False
    groups: dict[str, str] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)

    def of(self, topic: str) -> TopicMessages:
        """The messages of a topic, by its name in the root namespace."""
        schema = self.definitions.get(topic)
        messages = tuple(self.messages.get(topic, ()))
        if schema is None:
            return TopicMessages(topic, "", "", messages)
        return TopicMessages(topic, schema.name, schema.data.decode(errors="replace"), messages)


def find_file(path: Path) -> Path:
    """The MCAP file that a path means.

    Args:
        path: folder of a bag, or the file itself.

    Raises:
        BagError: there is none, or more than one.
    """
    if path.is_file():
        return path
    if not path.is_dir():
        raise BagError(f"{path}: there is no such bag")
    files = sorted(path.glob("*.mcap"))
    if len(files) != 1:
        raise BagError(f"{path}: a bag's folder holds one .mcap file; found {len(files)}")
    return files[0]


def _scan(file: Path) -> _Contents:
    contents = _Contents(None, {}, defaultdict(list), {}, closed=False)
    names: dict[int, str] = {}
    schemas: dict[int, Schema] = {}
    try:
        for record in records(file):
            if isinstance(record, Message):
                contents.messages[names[record.channel_id]].append(record.data)
            elif isinstance(record, Channel):
                role = names[record.id] = record.metadata.get(ROLE, record.topic)
                contents.names[role] = record.topic
                contents.definitions[role] = schemas[record.schema_id]
            elif isinstance(record, Schema):
                schemas[record.id] = _current(record, file)
            else:
                _note(contents, record, file)
        contents.closed = True
    except OSError as error:
        raise BagError(f"{file}: cannot be read: {error.strerror}") from None
    except BagError:
        raise
    except ExpansionError as error:
        raise BagError(f"{file}: {error}") from None
    except READ_FAILURES as error:
        if contents.scenario is None and not contents.messages:
            why = reason(error) if str(error) else "it ends too early"
            raise BagError(f"{file}: is not an MCAP file that can be read: {why}") from None
    return contents


def _current(schema: Schema, file: Path) -> Schema:
    """A message definition; BagError if an earlier version wrote it, with other names."""
    clause = renamed(schema.name, schema.data.decode(errors="replace"))
    if clause:
        raise BagError(
            f"{file}: was recorded by an earlier version of satform: {clause}; "
            "read it with the version that recorded it, or run its scenario again"
        )
    return schema


def _note(contents: _Contents, record: Any, file: Path) -> None:
    if isinstance(record, Attachment) and record.name.startswith(FILE_ATTACHMENTS):
        contents.files[record.name.removeprefix(FILE_ATTACHMENTS)] = record.data
    elif isinstance(record, Attachment) and record.name == SCENARIO_ATTACHMENT:
        try:
            contents.scenario = parse_scenario(
                record.data.decode(),
                f"{file}:{SCENARIO_ATTACHMENT}",
                files=FileSource(file.parent, contents.files, recorded=True),
            )
        except UnicodeDecodeError as error:
            raise BagError(f"{file}: the scenario in it is not UTF-8 text: {error}") from None
        except ScenarioError as error:
            raise BagError(
                f"{file}: the scenario in it cannot be read, perhaps since another version recorded it: "
                f"{error.first}"
            ) from None
    elif isinstance(record, Metadata) and record.name == RUN_METADATA:
        contents.versions = dict(record.metadata)
    elif isinstance(record, Metadata) and record.name == TIME_METADATA:
        contents.clocked = record.metadata.get("kept_by") == WALL_CLOCK
    elif isinstance(record, Metadata) and record.name == GROUPS_METADATA:
        contents.groups = dict(record.metadata)


def _messages(contents: _Contents, topic: str, file: Path) -> list[Any]:
    """The messages of a topic as objects."""
    if not contents.messages.get(topic):
        return []
    try:
        return decoded(contents.of(topic))[0]
    except Exception as error:  # the decoder is made from the bag's text, which may be any
        raise BagError(f"{file}: {topic} has messages of another form: {reason(error)}") from None


def _events(contents: _Contents, scenario: Scenario, statuses: list[FormationStatus], file: Path) -> Plan:
    """What happened in the flight, unforeseen."""
    changes = [
        (satellite.name, change)
        for satellite in scenario.satellites
        for change in _messages(contents, topic_name("parameter_changes", satellite.name), file)
    ]
    try:
        return happened(statuses, changes, scenario.membership_plan())
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise BagError(f"{file}: what happened in the flight cannot be read: {reason(error)}") from None


def _history(contents: _Contents, file: Path) -> Events:
    topics = [
        contents.of(topic)
        for topic, schema in contents.definitions.items()
        if schema.name in TYPES and topic in contents.messages
    ]
    try:
        return read_events(topics)
    except EventError as error:
        raise BagError(f"{file}: {error}") from None


def _gaps(
    contents: _Contents, scenario: Scenario, statuses: list[FormationStatus], file: Path
) -> tuple[Gaps, EarlyEnd | None]:
    """What steps without a message are filled from, and why the flight ended before its last step."""
    absences = Absences([satellite.name for satellite in scenario.satellites])
    final_commands: dict[tuple[str, int], Any] = {}
    early_end: EarlyEnd | None = None
    try:
        for status in statuses:
            absences.take(status)
            early_end = EarlyEnd.of_message(status, scenario.timing.step) or early_end
            for name, command in zip(status.lost, status.final_commands, strict=False):
                if command.header.frame_id and command.step + 1 == status.step:
                    final_commands[name, status.step] = command
    except (AttributeError, TypeError, ValueError) as error:
        raise BagError(f"{file}: {STATUS} has messages of another form: {reason(error)}") from None
    held = held_steps(scenario.command_timeout, scenario.timing.step) if contents.clocked else None
    return Gaps(absences, final_commands, len(contents.messages.get(CLOCK, [])), held), early_end


def _record(
    contents: _Contents, scenario: Scenario, statuses: list[FormationStatus], file: Path
) -> FlightRecord:
    if contents.groups:
        _, early_end = _gaps(contents, scenario, statuses, file)
        return group_record(contents.of, compile_scenario(scenario), contents.groups, early_end, str(file))
    names = tuple(satellite.name for satellite in scenario.satellites)
    satellites = [scenario.satellite(index) for index in range(len(names))]
    gaps, early_end = _gaps(contents, scenario, statuses, file)
    topics = topic_plan(scenario)

    def tables(kind: str, instead: str = "", wanted: Callable[[SatelliteSpec], Any] = bool) -> list[Table]:
        """Each satellite's table of one kind of message, or of another kind where it has none of these."""
        chosen = [kind if wanted(satellite) else instead for satellite in satellites]
        found = [
            read_table(
                contents.of(topic_name(kind, names[index])),
                index,
                gaps,
                str(file),
                lengths_of(kind, topics, index),
            )
            for index, kind in enumerate(chosen)
        ]
        # The node of an external satellite may do without a topic for observers.
        return [
            table.blank(gaps.states - 1)
            if own.external and kind in OPTIONAL_OF_EXTERNAL and not len(table)
            else table
            for table, own, kind in zip(found, satellites, chosen, strict=True)
        ]

    state, tracking = tables("state"), tables("tracking")
    announced = tables(scenario.consensus.announces)
    truth = tables("truth", "state", lambda satellite: satellite.measures_motion)
    command = tables("command")
    applied = tables("propulsion", "command", lambda satellite: satellite.thruster)
    attitude = tables("attitude", "state", lambda satellite: satellite.attitude)
    estimate = tables("estimate", "tracking", lambda satellite: satellite.estimates_motion)
    turned = tables("attitude_estimate", "tracking", lambda satellite: satellite.estimates_attitude)
    readings = tables("measurements", "state", lambda satellite: satellite.sensors)
    estimates = {
        index: read_table(
            contents.of(topic_name("navigation_estimate", names[index])),
            index,
            gaps,
            str(file),
            lengths_of("navigation_estimate", topics, index),
        )
        for index, own in enumerate(topics.satellites)
        if own.estimated
    }
    states = min(
        len(table) for table in (*state, *truth, *announced, *attitude, *readings, *estimates.values())
    )
    if states == 0:
        why = "" if early_end is None else f": {early_end.sentence}"
        raise BagError(f"{file}: holds no complete step{why}")
    steps = min(states - 1, *(len(table) for table in (*command, *applied, *tracking, *estimate, *turned)))
    record = FlightRecord(
        satellites=names,
        step=scenario.timing.step,
        position=vectors(truth, "position", steps + 1),
        velocity=vectors(truth, "velocity", steps + 1),
        measured_position=vectors(state, "position", steps + 1),
        measured_velocity=vectors(state, "velocity", steps + 1),
        acceleration=vectors(command, "acceleration", steps),
        applied_acceleration=vectors(state, "applied_acceleration", steps + 1)[1:],
        **phases(announced, scenario.consensus.announces, steps + 1),
        reference_position=vectors(tracking, "reference_position", steps),
        reference_velocity=vectors(tracking, "reference_velocity", steps),
        reference_acceleration=vectors(tracking, "reference_acceleration", steps),
        sliding_variable=vectors(tracking, "sliding_variable", steps),
        estimated_position_error=vectors(tracking, "position_error", steps),
        estimated_velocity_error=vectors(tracking, "velocity_error", steps),
        **propulsion(applied, satellites, steps),
        **attitudes(attitude, command, satellites, steps),
        **motion_estimates(estimate, satellites, steps),
        **unsolved_plans(tracking, satellites, steps),
        **attitude_estimates(turned, satellites, steps),
        **without("pointing", len(names), None),
        early_end=early_end,
        clocked=contents.clocked,
        navigation=navigation(readings, estimates, topics, (steps, scenario.timing.step)),
        chief_source=None,
        link_source=None,
        central_source=None,
    )
    if not any(satellite.attitude for satellite in satellites):
        return record
    known = record.quantities()
    figures: dict[str, Any] = attitude_figures(orientations(scenario), scenario.timing.step, known)
    return replace(record, **figures)
