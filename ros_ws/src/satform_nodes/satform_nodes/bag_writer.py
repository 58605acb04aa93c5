"""The bag of a flight: MCAP with embedded message definitions, as `ros2 bag` and Foxglove read it.

Written with small chunks that are flushed as they fill, so that a killed recorder loses a moment and
not the flight. The scenario and the versions that flew are kept inside the file. Times in the bag are
simulated times.
"""

import json
from collections.abc import Mapping
from pathlib import Path

from mcap.writer import CompressionType, IndexType, Writer

from satform.scenario import Scenario

CHUNK_BYTES = 64 * 1024
SCENARIO_ATTACHMENT = "scenario.json"
RUN_METADATA = "satform"

TIME_METADATA = "time"
WALL_CLOCK = "wall clock"
"""Who keeps the time of a flight: the steps, or the wall clock, on which satellites may miss some."""


class BagWriter:
    """A folder in rosbag2's form with one MCAP file.

    Attributes:
        messages: number of messages written.
    """

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
        self._writer.add_metadata(
            RUN_METADATA, {**versions, "scenario": scenario.name, "digest": scenario.digest()}
        )
        self._writer.add_metadata(TIME_METADATA, {"kept_by": WALL_CLOCK if clocked else "steps"})
        self._writer.add_attachment(
            0, 0, SCENARIO_ATTACHMENT, "application/json", scenario.to_json().encode()
        )
        self._schemas: dict[str, int] = {}
        self._topics: list[tuple[str, str, str]] = []
        self._counts: list[int] = []
        self._first: int | None = None
        self._last = 0
        self.messages = 0

    def add_topic(self, topic: str, type_name: str, definition: str, quality_of_service: str) -> int:
        """Register a topic before its first message.

        Args:
            topic: full name.
            type_name: for example `satform_msgs/msg/Command`.
            definition: text of the message with all that it contains, in ros2msg form.
            quality_of_service: the offered profiles as rosbag2's YAML text.

        Returns:
            The number under which to write the topic's messages.
        """
        if type_name not in self._schemas:
            self._schemas[type_name] = self._writer.register_schema(type_name, "ros2msg", definition.encode())
        channel = self._writer.register_channel(
            topic, "cdr", self._schemas[type_name], {"offered_qos_profiles": quality_of_service}
        )
        self._topics.append((topic, type_name, quality_of_service))
        self._counts.append(0)
        return channel

    def write(self, channel: int, nanoseconds: int, data: bytes, sequence: int) -> None:
        """Write one serialised message with its simulated time."""
        self._writer.add_message(channel, nanoseconds, data, nanoseconds, sequence)
        self._counts[channel - 1] += 1
        self._first = nanoseconds if self._first is None else min(self._first, nanoseconds)
        self._last = max(self._last, nanoseconds)
        self.messages += 1

    def flush(self) -> None:
        """Hand everything complete to the operating system."""
        self._file.flush()

    def close(self) -> None:
        """Finish the file and write rosbag2's description beside it."""
        self._writer.finish()
        self._file.close()
        (self._folder / "metadata.yaml").write_text(self._describe())

    def _describe(self) -> str:
        """rosbag2's metadata, as JSON, which is YAML."""
        start, duration = self._first or 0, self._last - (self._first or 0)
        name = Path(self._file.name).name
        described = {
            "version": 9,
            "storage_identifier": "mcap",
            "duration": {"nanoseconds": duration},
            "starting_time": {"nanoseconds_since_epoch": start},
            "message_count": self.messages,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic,
                        "type": type_name,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": quality_of_service,
                        "type_description_hash": "",
                    },
                    "message_count": count,
                }
                for (topic, type_name, quality_of_service), count in zip(
                    self._topics, self._counts, strict=True
                )
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [name],
            "files": [
                {
                    "path": name,
                    "starting_time": {"nanoseconds_since_epoch": start},
                    "duration": {"nanoseconds": duration},
                    "message_count": self.messages,
                }
            ],
            "custom_data": {},
            "ros_distro": "jazzy",
        }
        return json.dumps({"rosbag2_bagfile_information": described}, indent=1) + "\n"
