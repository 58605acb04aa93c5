# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The bag of a flight: MCAP with embedded message definitions, as `ros2 bag` and Foxglove read it.

Written with small chunks that are flushed as they fill, so that a killed recorder loses a moment and
not the flight. The scenario and the versions that flew are kept inside the file. Times in the bag are
simulated times.
"""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, IndexType, Writer

from satform.bag.format import (
    FILE_ATTACHMENTS,
    ROLE,
    RUN_METADATA,
    SCENARIO_ATTACHMENT,
    TIME_METADATA,
    WALL_CLOCK,
)
from satform.scenario import Scenario
from satform_nodes.bag import metadata as bag_metadata
from satform_nodes.bag.metadata import Profile, Topic
from satform_nodes.transport.message_definitions import MessageType

CHUNK_BYTES = 64 * 1024


class BagFile:
    """A folder in rosbag2's form with one MCAP file, written message by message.

    Attributes:
        messages: number of messages written.
    """

    def __init__(self, folder: Path) -> None:
        """Create an empty bag.

        Args:
            folder: made here; must not hold a bag already.

        Raises:
            OSError: the folder cannot be written to.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._file = (folder / f"{folder.name}_0.mcap").open("xb")
        self._writer = Writer(
            self._file,
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.NONE,
            index_types=IndexType.ALL,
            enable_data_crcs=True,
        )
        self._writer.start(profile="ros2", library="satform")
        self._schemas: dict[str, int] = {}
        self._topics: dict[int, Topic] = {}
        self._first: int | None = None
        self._last = 0
        self.messages = 0
        # As rosbag2 does: of a file that is never finished this one is all that is known.
        self._keep_description()

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Keep some facts in the file, under a name."""
        self._writer.add_metadata(name, dict(entries))

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Keep a file in the file."""
        self._writer.add_attachment(0, 0, name, media_type, data)

    def add_topic(
        self, topic: str, message_type: MessageType, profiles: Sequence[Profile], role: str = ""
    ) -> int:
        """Register a topic before its first message.

        Args:
            topic: full name.
            message_type: of all its messages.
            profiles: qualities of service that its publishers offer.
            role: name of the topic in the table of a formation in the root namespace, by which it is found
                again whatever it is called; its own name when left out.

        Returns:
            The number under which to write the topic's messages.
        """
        name = message_type.name
        if name not in self._schemas:
            text = message_type.definition.encode()
            self._schemas[name] = self._writer.register_schema(name, "ros2msg", text)
        added = Topic(topic, name, message_type.type_hash, profiles)
        facts = {**bag_metadata.channel_metadata(added), ROLE: role or topic}
        channel = self._writer.register_channel(topic, "cdr", self._schemas[name], facts)
        self._topics[channel] = added
        return channel

    def write(self, channel: int, nanoseconds: int, data: bytes, sequence: int) -> None:
        """Write one serialised message with its simulated time."""
        self._writer.add_message(channel, nanoseconds, data, nanoseconds, sequence)
        self._topics[channel].count += 1
        self._first = nanoseconds if self._first is None else min(self._first, nanoseconds)
        self._last = max(self._last, nanoseconds)
        self.messages += 1

    def flush(self) -> None:
        """Hand all messages to the operating system; they are then in the file whatever ends this process.

        Raises:
            OSError: they cannot be written.
        """
        self._writer.flush()

    def close(self) -> None:
        """Finish the file and write rosbag2's description beside it."""
        self._keep_description()
        self._writer.finish()
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        bag_metadata.write(self._folder, self._description())

    def _keep_description(self) -> None:
        self.add_metadata(bag_metadata.RECORD, {bag_metadata.RECORD_KEY: json.dumps(self._description())})

    def _description(self) -> dict[str, Any]:
        name, topics = Path(self._file.name).name, list(self._topics.values())
        return bag_metadata.description(name, topics, self._first or 0, self._last)


class BagWriter(BagFile):
    """The bag of one flight."""

    def __init__(
        self, folder: Path, scenario: Scenario, versions: Mapping[str, str], *, clocked: bool = False
    ) -> None:
        """Create the bag.

        Args:
            folder: made here; must not hold a bag already.
            scenario: kept in the bag.
            versions: name and version of what flew, kept in the bag.
            clocked: whether the flight is on the wall clock.

        Raises:
            OSError: the folder cannot be written to.
        """
        super().__init__(folder)
        self.add_metadata(RUN_METADATA, {**versions, "scenario": scenario.name, "digest": scenario.digest()})
        self.add_metadata(TIME_METADATA, {"kept_by": WALL_CLOCK if clocked else "steps"})
        for name, content in scenario.files().items():
            self.add_attachment(f"{FILE_ATTACHMENTS}{name}", "application/octet-stream", content)
        self.add_attachment(SCENARIO_ATTACHMENT, "application/json", scenario.to_json().encode())
