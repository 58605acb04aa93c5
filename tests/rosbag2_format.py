# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2's own rules for `metadata.yaml` of version 9, field by field, as ROS 2 Jazzy decodes it.

Written from the decoders of rosbag2, branch jazzy: `rosbag2_storage/include/rosbag2_storage/yaml.hpp` for the
bag, its files and topics, and `rosbag2_storage/src/rosbag2_storage/qos.cpp` for qualities of service. Where
they would throw, or take a default in silence, an assertion fails here.
"""

import re
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from ruamel.yaml import YAML

POLICIES = {
    # As rmw_qos_*_policy_from_str knows them.
    "history": {"system_default", "keep_last", "keep_all"},
    "reliability": {"system_default", "reliable", "best_effort"},
    "durability": {"system_default", "transient_local", "volatile"},
    "liveliness": {"system_default", "automatic", "manual_by_topic"},
}
TIMES = ("deadline", "lifespan", "liveliness_lease_duration")
HASH = re.compile(r"RIHS01_[0-9a-f]{64}")


def fields(node: Any, **kinds: type) -> dict[str, Any]:
    """A map with exactly these fields, each of its type."""
    assert isinstance(node, dict)
    assert set(node) == set(kinds)
    for name, kind in kinds.items():
        # A bool is no number in YAML.
        assert type(node[name]) is kind, f"{name} is {node[name]!r}"
        if kind is int:
            assert node[name] >= 0, f"{name} is decoded as an unsigned number"
    return node


def profile(node: Any) -> dict[str, Any]:
    """A quality of service, its policies by name."""
    found = fields(
        node,
        **dict.fromkeys(POLICIES, str),
        **dict.fromkeys(TIMES, dict),
        depth=int,
        avoid_ros_namespace_conventions=bool,
    )
    for name, allowed in POLICIES.items():
        assert found[name] in allowed
    for name in TIMES:
        fields(found[name], sec=int, nsec=int)
    return found


def topic(node: Any) -> dict[str, Any]:
    """A topic with the count of its messages."""
    found = fields(node, topic_metadata=dict, message_count=int)
    metadata = fields(
        found["topic_metadata"],
        name=str,
        type=str,
        serialization_format=str,
        offered_qos_profiles=list,
        type_description_hash=str,
    )
    assert metadata["serialization_format"] == "cdr"
    for offered in metadata["offered_qos_profiles"]:
        profile(offered)
    return found


def bag(node: Any) -> dict[str, Any]:
    """The whole description, and whether its parts agree."""
    span = {"starting_time": dict, "duration": dict, "message_count": int}
    found = fields(
        node,
        version=int,
        storage_identifier=str,
        **span,
        topics_with_message_count=list,
        compression_format=str,
        compression_mode=str,
        relative_file_paths=list,
        files=list,
        custom_data=dict,
        ros_distro=str,
    )
    assert found["version"] == 9
    assert found["storage_identifier"] == "mcap"
    assert found["ros_distro"] == "jazzy"
    assert all(isinstance(text, str) for text in found["custom_data"].values())
    files = [fields(file, path=str, **span) for file in found["files"]]
    for part in (found, *files):
        fields(part["duration"], nanoseconds=int)
        fields(part["starting_time"], nanoseconds_since_epoch=int)
    assert found["relative_file_paths"] == [file["path"] for file in files]
    assert sum(file["message_count"] for file in files) == found["message_count"]
    topics = [topic(entry) for entry in found["topics_with_message_count"]]
    assert sum(entry["message_count"] for entry in topics) == found["message_count"]
    return found


def read(folder: Path) -> dict[str, Any]:
    """A bag's folder as `ros2 bag info` reads it, held against the file that it describes."""
    text = (folder / "metadata.yaml").read_text(encoding="utf-8")
    (root,) = YAML(typ="safe").load(text).items()
    assert root[0] == "rosbag2_bagfile_information"
    found = bag(root[1])
    (name,) = found["relative_file_paths"]
    with (folder / name).open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        statistics, kept = summary.statistics, list(reader.iter_metadata())
    assert found["message_count"] == statistics.message_count
    start, end = statistics.message_start_time, statistics.message_end_time
    assert found["starting_time"]["nanoseconds_since_epoch"] == start
    assert found["duration"]["nanoseconds"] == end - start
    # The storage's own copy, as `rosbag2_storage_mcap/src/mcap_storage.cpp` has it: the last one counts.
    copies = [entry.metadata["serialized_metadata"] for entry in kept if entry.name == "rosbag2"]
    assert bag(YAML(typ="safe").load(copies[-1])) == found
    topics = {entry["topic_metadata"]["name"]: entry for entry in found["topics_with_message_count"]}
    assert {channel.topic for channel in summary.channels.values()} == set(topics)
    for channel in summary.channels.values():
        described = topics[channel.topic]
        metadata = described["topic_metadata"]
        assert channel.message_encoding == metadata["serialization_format"]
        assert summary.schemas[channel.schema_id].name == metadata["type"]
        assert channel.metadata["topic_type_hash"] == metadata["type_description_hash"]
        offered = YAML(typ="safe").load(channel.metadata["offered_qos_profiles"])
        assert (offered or []) == metadata["offered_qos_profiles"]
        assert statistics.channel_message_counts.get(channel.id, 0) == described["message_count"]
    return found
