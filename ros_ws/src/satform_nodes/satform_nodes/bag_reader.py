"""From a bag back to the flight: arrays, scenario and what was noted down about the run."""

import struct
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Message, Metadata
from mcap.stream_reader import StreamReader
from numpy.typing import NDArray

from satform.record import FlightRecord
from satform.scenario import Scenario, ScenarioError, parse_scenario
from satform_nodes import topics
from satform_nodes.bag_writer import RUN_METADATA, SCENARIO_ATTACHMENT
from satform_nodes.wire import layout

_READ_FAILURES = (
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


class BagError(ValueError):
    """A bag that cannot be read; the message says which, where and why."""


@dataclass(frozen=True)
class Bag:
    """What a bag holds.

    Attributes:
        path: the MCAP file.
        scenario: what was flown.
        versions: what flew it: name and version of each part.
        record: the flight, up to the last step of which everything is there.
        messages: number of messages of each topic.
        complete: whether the file was closed properly and holds the whole flight.
    """

    path: Path
    scenario: Scenario
    versions: dict[str, str]
    record: FlightRecord
    messages: dict[str, int]
    complete: bool


def read_bag(path: Path) -> Bag:
    """Read a flight from a bag folder or from its MCAP file.

    A file that was cut short by a kill is read up to its last complete chunk.

    Args:
        path: folder in rosbag2's form, or the `.mcap` file in it.

    Returns:
        The flight; its record is shorter than the scenario when the bag is.

    Raises:
        BagError: there is no such bag, or it holds no flight.
    """
    file = _find(path)
    contents = _scan(file)
    scenario = contents.scenario
    if scenario is None:
        raise BagError(
            f"{file}: holds no scenario; it was not recorded by satform, or ends before its first chunk"
        )
    record = _record(contents, scenario, file)
    whole = contents.closed and record.steps == scenario.timing.steps
    counts = {topic: len(messages) for topic, messages in contents.messages.items()}
    return Bag(file, scenario, contents.versions, record, counts, whole)


@dataclass
class _Contents:
    scenario: Scenario | None
    versions: dict[str, str]
    messages: dict[str, list[bytes]]
    closed: bool


def _find(path: Path) -> Path:
    if path.is_file():
        return path
    if not path.is_dir():
        raise BagError(f"{path}: there is no such bag")
    files = sorted(path.glob("*.mcap"))
    if len(files) != 1:
        raise BagError(f"{path}: a bag's folder holds one .mcap file; found {len(files)}")
    return files[0]


def _scan(file: Path) -> _Contents:
    contents = _Contents(None, {}, defaultdict(list), closed=False)
    names: dict[int, str] = {}
    try:
        with file.open("rb") as stream:
            for record in StreamReader(stream, validate_crcs=True).records:
                if isinstance(record, Message):
                    contents.messages[names[record.channel_id]].append(record.data)
                elif isinstance(record, Channel):
                    names[record.id] = record.topic
                else:
                    _note(contents, record, file)
        contents.closed = True
    except OSError as error:
        raise BagError(f"{file}: cannot be read: {error.strerror}") from None
    except BagError:
        raise
    except _READ_FAILURES as error:
        if contents.scenario is None and not contents.messages:
            reason = str(error) or "it ends too early"
            raise BagError(f"{file}: is not an MCAP file that can be read: {reason}") from None
    return contents


def _note(contents: _Contents, record: Any, file: Path) -> None:
    if isinstance(record, Attachment) and record.name == SCENARIO_ATTACHMENT:
        try:
            contents.scenario = parse_scenario(record.data.decode(), f"{file}:{SCENARIO_ATTACHMENT}")
        except (ScenarioError, UnicodeDecodeError) as error:
            raise BagError(f"{file}: the scenario in it cannot be read: {error}") from None
    elif isinstance(record, Metadata) and record.name == RUN_METADATA:
        contents.versions = dict(record.metadata)


def _record(contents: _Contents, scenario: Scenario, file: Path) -> FlightRecord:
    names = tuple(satellite.name for satellite in scenario.satellites)
    tables = {
        kind: [_table(contents, kind, getattr(topics, kind)(name), file) for name in names]
        for kind in ("state", "arc_length", "command", "tracking")
    }
    states = min(len(table) for kind in ("state", "arc_length") for table in tables[kind])
    decided = min(len(table) for kind in ("command", "tracking") for table in tables[kind])
    steps = min(decided, max(states - 1, 0))
    if states == 0:
        raise BagError(f"{file}: holds no complete step")

    def series(kind: str, fields: tuple[str, ...], rows: int) -> NDArray[np.float64]:
        columns = [np.stack([table[field][:rows] for field in fields], axis=-1) for table in tables[kind]]
        return np.stack(columns, axis=1)

    def vectors(kind: str, field: str, rows: int) -> NDArray[np.float64]:
        return series(kind, tuple(f"{field}.{axis}" for axis in "xyz"), rows)

    return FlightRecord(
        satellites=names,
        step=scenario.timing.step,
        position=vectors("state", "position", steps + 1),
        velocity=vectors("state", "velocity", steps + 1),
        acceleration=vectors("command", "acceleration", steps),
        arc_length=series("arc_length", ("arc_length",), steps + 1)[..., 0],
        rate=series("arc_length", ("rate",), steps + 1)[..., 0],
        reference_position=vectors("tracking", "reference_position", steps),
        reference_velocity=vectors("tracking", "reference_velocity", steps),
        reference_acceleration=vectors("tracking", "reference_acceleration", steps),
        sliding_variable=vectors("tracking", "sliding_variable", steps),
    )


def _table(contents: _Contents, kind: str, topic: str, file: Path) -> NDArray[Any]:
    """All messages of a topic as one structured array, with steps 0, 1, 2, ... without a gap."""
    form = layout(topics.TYPES[kind], topics.FRAME)
    messages = contents.messages.get(topic, [])
    if any(len(message) != form.size for message in messages):
        raise BagError(f"{file}: {topic} has messages of another form than satform's {kind} message")
    table = np.frombuffer(b"".join(messages), dtype=form.dtype)
    gaps = np.flatnonzero(table["step"] != np.arange(len(table), dtype=np.uint64))
    if gaps.size:
        found = int(table["step"][gaps[0]])
        raise BagError(f"{file}: {topic} has step {found} where step {int(gaps[0])} was to follow")
    return table
