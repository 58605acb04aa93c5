# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What rosbag2 writes about a bag beside its messages: `metadata.yaml`, version 9, as of ROS 2 Jazzy.

The same description is kept in the MCAP file, in a metadata record called `rosbag2`, and by topic in the
channels' metadata. Source: rosbag2, branch jazzy, `rosbag2_storage/yaml.hpp`, `rosbag2_storage/qos.cpp` and
`rosbag2_storage_mcap/mcap_storage.cpp`.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from rclpy.qos import QoSProfile

from satform.files.bounded_file import read_bounded
from satform.files.durable_file import write_durably

FILE_NAME = "metadata.yaml"
RECORD = "rosbag2"
"""Name of the MCAP metadata record in which rosbag2's storage keeps the description."""

RECORD_KEY = "serialized_metadata"
QOS_KEY = "offered_qos_profiles"
HASH_KEY = "topic_type_hash"

MOST_BYTES = 100_000_000
"""Size of the largest description that is read; that of 10 000 satellites has some 50 megabytes."""

_MOST_LEVELS = 30
"""Of lists and mappings within each other in a description that is read; rosbag2's has 5."""

VERSION = 9
DISTRIBUTION = "jazzy"

Profile = dict[str, Any]
"""A quality of service as rosbag2 describes it."""


@dataclass
class Topic:
    """A topic of a bag.

    Attributes:
        name: its full name.
        type_name: for example `satform_msgs/msg/Command`.
        type_hash: RIHS01 hash of the type; empty where it is not known.
        profiles: offered by its publishers.
        count: of its messages.
    """

    name: str
    type_name: str
    type_hash: str
    profiles: Sequence[Profile]
    count: int = 0


def offered(profile: QoSProfile) -> Profile:
    """A publisher's quality of service, its policies by name as version 9 has them; 0 is unspecified."""
    return {
        "history": profile.history.short_key,
        "depth": profile.depth,
        "reliability": profile.reliability.short_key,
        "durability": profile.durability.short_key,
        "deadline": {"sec": 0, "nsec": 0},
        "lifespan": {"sec": 0, "nsec": 0},
        "liveliness": "automatic",
        "liveliness_lease_duration": {"sec": 0, "nsec": 0},
        "avoid_ros_namespace_conventions": False,
    }


def channel_metadata(topic: Topic) -> dict[str, str]:
    """What rosbag2's MCAP storage keeps with the channel of a topic."""
    text = yaml.safe_dump(list(topic.profiles), sort_keys=False) if topic.profiles else ""
    return {QOS_KEY: text, HASH_KEY: topic.type_hash}


def description(file_name: str, topics: Sequence[Topic], start: int, end: int) -> dict[str, Any]:
    """A bag of one MCAP file.

    Args:
        file_name: of the file, in the bag's folder.
        topics: all of them, with the counts of their messages.
        start: time of the earliest message, ns; 0 where there is none.
        end: time of the latest message, ns; 0 where there is none.

    Returns:
        The fields of rosbag2's `BagMetadata`.
    """
    messages = sum(topic.count for topic in topics)
    span = {
        "starting_time": {"nanoseconds_since_epoch": start},
        "duration": {"nanoseconds": end - start},
        "message_count": messages,
    }
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **span,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": list(topic.profiles),
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.count,
            }
            for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [{"path": file_name, **span}],
        "custom_data": {},
        "ros_distro": DISTRIBUTION,
    }


def fits(folder: Path, messages: int) -> bool:
    """Whether a bag's folder has a `metadata.yaml` that rosbag2 of Jazzy can decode, for this many messages.

    Args:
        folder: of the bag.
        messages: in its file.
    """
    try:
        found = _parsed(read_bounded(folder / FILE_NAME, MOST_BYTES))["rosbag2_bagfile_information"]
        offered_by = [entry["topic_metadata"] for entry in found["topics_with_message_count"]]
        return (
            found["version"] == VERSION
            and found["message_count"] == messages
            and all(isinstance(topic["offered_qos_profiles"], list) for topic in offered_by)
        )
    except (OSError, ValueError, KeyError, TypeError, RecursionError, yaml.YAMLError):
        return False


def _parsed(content: bytes) -> Any:
    try:
        # Ours is JSON, which is read a hundred times faster.
        return json.loads(content)
    except ValueError:
        # Aliases, which rosbag2 does not write, can stand for more than fits into memory.
        if b"&" in content:
            raise
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        _require_shallow(yaml.parse(content, loader))
        return yaml.load(content, loader)  # noqa: S506 - both are safe


def _require_shallow(events: Iterable[yaml.Event]) -> None:
    """Check the nesting of YAML: the loader in C overflows the stack, where the one in Python says so.

    Raises:
        ValueError: lists and mappings are nested too deeply.
    """
    depth = 0
    for event in events:
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > _MOST_LEVELS:
            raise ValueError(f"is nested more than {_MOST_LEVELS} levels deep")


def write(folder: Path, described: dict[str, Any]) -> None:
    """Write `metadata.yaml` into a bag's folder, as JSON, which is YAML.

    Raises:
        OSError: it cannot be written.
    """
    text = json.dumps({"rosbag2_bagfile_information": described}, indent=1)
    write_durably(folder / FILE_NAME, f"{text}\n".encode())
