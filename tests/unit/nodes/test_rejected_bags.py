# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that are no bag of satform, or of another version, are rejected with the reason."""

from dataclasses import replace
from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer

from bag_writing import PROFILES, VERSIONS, messages_of, write
from flights import shortened
from satform.bag.errors import BagError
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_nodes.bag.writer import BagWriter
from satform_nodes.transport import topic_types
from satform_nodes.transport.message_definitions import MessageType, described


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return shortened("triangle", 10.0)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory, scenario: Scenario) -> bytes:
    """A bag of the whole flight."""
    folder = tmp_path_factory.mktemp("run") / "bag"
    write(folder, scenario, messages_of(simulate(scenario)))
    return (folder / "bag_0.mcap").read_bytes()


def test_a_topic_with_messages_of_another_form_is_named(tmp_path: Path, scenario: Scenario) -> None:
    writer = BagWriter(tmp_path / "bag", scenario, VERSIONS)
    channel = writer.add_topic(
        "/sat1/state", MessageType("satform_msgs/msg/RelativeState", "float64 x\n", ""), PROFILES
    )
    writer.write(channel, 0, b"\0\1\0\0" + b"\0" * 8, 0)
    writer.close()
    with pytest.raises(BagError, match="/sat1/state has messages of another form than satform's state"):
        read_bag(tmp_path / "bag")


@pytest.mark.parametrize(
    ("name", "old", "new", "clause"),
    [
        (
            "status",
            "version",
            "number",
            "in its message satform_msgs/msg/FormationStatus number is now version",
        ),
        (
            "propulsion",
            "saturated_steps",
            "clipped",
            "in its message satform_msgs/msg/Propulsion clipped is now saturated_steps",
        ),
    ],
)
def test_a_bag_of_an_earlier_version_is_rejected_with_the_new_name_of_its_fields(
    tmp_path: Path, scenario: Scenario, name: str, old: str, new: str, clause: str
) -> None:
    writer = BagWriter(tmp_path / "bag", scenario, VERSIONS)
    current = described(topic_types.TYPES[name])
    text = current.definition.replace(f" {old} ", f" {new} ", 1)
    assert text != current.definition
    writer.add_topic("/x", replace(current, definition=text), PROFILES)
    writer.close()
    (file,) = (tmp_path / "bag").glob("*.mcap")
    with pytest.raises(BagError) as caught:
        read_bag(tmp_path / "bag")
    assert str(caught.value) == (
        f"{file}: was recorded by an earlier version of satform: {clause}; "
        "read it with the version that recorded it, or run its scenario again"
    )


def test_a_bag_without_messages_holds_no_step(tmp_path: Path, scenario: Scenario) -> None:
    write(tmp_path / "bag", scenario, iter(()))
    with pytest.raises(BagError, match="holds no complete step"):
        read_bag(tmp_path / "bag")


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_bag_of_something_else_holds_no_scenario(tmp_path: Path, compression: CompressionType) -> None:
    file = tmp_path / "other.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream, compression=compression)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        channel = writer.register_channel("/chatter", "cdr", schema)
        for k in range(3):
            writer.add_message(channel, k, b"\0\1\0\0\2\0\0\0a\0", k)
        writer.finish()
    with pytest.raises(BagError, match=r"other.mcap: holds no scenario; it was not recorded by satform"):
        read_bag(file)


def test_a_scenario_that_cannot_be_read_any_more_is_told_by_its_own_problem(
    tmp_path: Path, data: bytes
) -> None:
    file = tmp_path / "other_version.mcap"
    file.write_bytes(data.replace(b'"duration": 10.0', b'"duration": 10.3', 1))
    with pytest.raises(BagError) as refusal:
        read_bag(file)
    sentence = str(refusal.value)
    assert sentence.startswith(f"{file}: the scenario in it cannot be read, perhaps since another version")
    assert "duration 10.3 s" in sentence
    assert "MCAP" not in sentence


@pytest.mark.parametrize(
    "content",
    [b"", b"\x89MCAP", b"\x89MCAP0\r\n", b"SQLite format 3\0" + b"\0" * 100, b"name: triangle\n" * 50],
)
def test_a_file_that_is_no_bag_is_said_to_be_none(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "file.mcap"
    file.write_bytes(content)
    with pytest.raises(BagError, match=r"file.mcap: is not an MCAP file that can be read: \S+"):
        read_bag(file)


def test_a_folder_without_a_bag_is_said_to_have_none(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"a bag's folder holds one .mcap file; found 0"):
        read_bag(tmp_path)


def test_a_folder_with_two_bags_is_refused(tmp_path: Path, data: bytes) -> None:
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(data)
    with pytest.raises(BagError, match="found 2"):
        read_bag(tmp_path)


def test_a_bag_that_is_not_there_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="nowhere: there is no such bag"):
        read_bag(tmp_path / "nowhere")
