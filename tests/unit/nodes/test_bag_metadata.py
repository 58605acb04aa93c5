# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What `ros2 bag` reads of a bag: `metadata.yaml` of version 9, field by field, and the types' hashes."""

import copy
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import rosbag2_format
from flights import shortened
from satform_nodes.bag.metadata import offered
from satform_nodes.bag.writer import BagWriter
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.message_definitions import described

PROFILES = {"status": qos.LATCHED, "state": qos.LOCKSTEP, "diagnostics": qos.OBSERVER}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag with a topic of each type, and some messages."""
    folder: Path = tmp_path_factory.mktemp("run") / "bag"
    writer = BagWriter(folder, shortened("triangle", 2), {})
    for number, (kind, message_type) in enumerate(topic_types.TYPES.items()):
        profile = PROFILES.get(kind, qos.MARKERS)
        channel = writer.add_topic(f"/sat1/{kind}", described(message_type), [offered(profile)])
        for step in range(number % 3):
            writer.write(channel, 10**9 * (step + 1), b"\0\1\0\0", step)
    writer.close()
    return folder


def test_rosbag2_can_decode_every_field(folder: Path) -> None:
    found = rosbag2_format.read(folder)
    assert found["starting_time"] == {"nanoseconds_since_epoch": 10**9}
    assert found["duration"] == {"nanoseconds": 10**9}
    told = {entry["topic_metadata"]["name"]: entry for entry in found["topics_with_message_count"]}
    assert set(told) == {f"/sat1/{kind}" for kind in topic_types.TYPES}
    (status,) = told["/sat1/status"]["topic_metadata"]["offered_qos_profiles"]
    assert status["durability"] == "transient_local"
    assert status["reliability"] == "reliable"
    assert status["history"] == "keep_last"
    assert status["depth"] == 64


@pytest.mark.parametrize(
    "change",
    [
        {"offered_qos_profiles": "- history: keep_last\n"},
        {"type_description_hash": None},
        {"offered_qos_profiles": [{"history": 1}]},
    ],
)
def test_these_rules_refuse_what_jazzy_cannot_decode(folder: Path, change: dict[str, Any]) -> None:
    broken = copy.deepcopy(rosbag2_format.read(folder))
    broken["topics_with_message_count"][0]["topic_metadata"].update(change)
    with pytest.raises(AssertionError):
        rosbag2_format.bag(broken)


@pytest.mark.parametrize("kind", sorted(topic_types.TYPES))
def test_a_types_hash_is_what_rosbags_computes_from_its_definition(kind: str) -> None:
    message_type = described(topic_types.TYPES[kind])
    store = get_typestore(Stores.EMPTY)
    own, *others = message_type.definition.split("=" * 80 + "\n")
    texts = {message_type.name: own}
    for text in others:
        name, _, body = text.removeprefix("MSG: ").partition("\n")
        texts["/msg/".join(name.split("/"))] = body
    found: dict[str, Any] = {}
    for name, text in texts.items():
        found.update(get_types_from_msg(text, name))
    store.register(found)
    assert rosbag2_format.HASH.fullmatch(message_type.type_hash)
    assert message_type.type_hash == store.hash_rihs01(message_type.name)


def test_rosbags_reads_qualities_of_service_and_hashes(folder: Path) -> None:
    with Reader(folder) as reader:
        connections = {connection.topic: connection for connection in reader.connections}
    for kind, message_type in topic_types.TYPES.items():
        connection = connections[f"/sat1/{kind}"]
        assert connection.digest == described(message_type).type_hash
        (profile,) = connection.ext.offered_qos_profiles
        wanted = PROFILES.get(kind, qos.MARKERS)
        assert profile.depth == wanted.depth
        assert profile.durability.name.lower() == wanted.durability.short_key
