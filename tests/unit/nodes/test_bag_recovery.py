# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag that was cut anywhere becomes a whole one with its description, and the cut one stays as it is."""

import json
import random
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.highlevel import AnyReader
from satform_msgs.msg import Command, FormationStatus
from test_bag import chunks

import rosbag2_format
from bag_writing import messages_of, write
from flights import shortened
from satform.bag.errors import BagError
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_nodes.bag.recovery import is_whole, recover, type_hash_of
from satform_nodes.transport.message_definitions import described
from satform_tools.cli import main as cli

STEPS = 300


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return shortened("triangle", STEPS * 0.5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, scenario: Scenario) -> Path:
    """A whole bag."""
    folder: Path = tmp_path_factory.mktemp("run") / "bag"
    write(folder, scenario, messages_of(simulate(scenario)))
    return folder


@pytest.fixture(scope="module")
def data(folder: Path) -> bytes:
    return (folder / "bag_0.mcap").read_bytes()


def cut(tmp_path: Path, data: bytes, length: int) -> Path:
    """A run whose recorder was killed: a file that ends anywhere, and no description."""
    bag = tmp_path / f"run{length}" / "bag"
    bag.mkdir(parents=True)
    (bag / "bag_0.mcap").write_bytes(data[:length])
    return bag


def lengths(data: bytes) -> Iterator[int]:
    draw = random.Random(20)
    yield from (draw.randrange(100_000, len(data)) for _ in range(4))
    # In the file's own frame, where all messages are there.
    yield from (len(data) - 1, len(data) - 20)


@pytest.mark.unmeasured
def test_a_bag_that_is_cut_anywhere_becomes_a_whole_one(tmp_path: Path, data: bytes) -> None:
    ends = list(chunks(data))
    for length in lengths(data):
        bag = cut(tmp_path, data, length)
        new = bag.parent / "recovered"
        found = recover(bag, new)
        held = [counts for end, counts in ends if end <= length][-1]
        assert found.messages == sum(held.values())
        # What there is, rosbag2 can decode, and every reader opens it with its index.
        metadata = rosbag2_format.read(new)
        assert metadata["message_count"] == found.messages
        with AnyReader([new]) as reader:
            assert reader.message_count == found.messages
        with (new / "recovered_0.mcap").open("rb") as stream:
            summary = make_reader(stream).get_summary()
            assert summary is not None
            assert summary.chunk_indexes
            assert {entry.name for entry in summary.attachment_indexes} == {"scenario.json"}
        damaged, whole = read_bag(bag), read_bag(new)
        assert whole.record.differences(damaged.record) == []
        assert (whole.scenario, whole.versions) == (damaged.scenario, damaged.versions)
        assert is_whole(new)
        # The cut one is as it was.
        assert (bag / "bag_0.mcap").read_bytes() == data[:length]
        assert [file.name for file in bag.iterdir()] == ["bag_0.mcap"]


def test_messages_keep_their_bytes_their_times_and_their_order(
    tmp_path: Path, folder: Path, data: bytes
) -> None:
    recover(cut(tmp_path, data, len(data) - 30), tmp_path / "new")

    def all_of(bag: Path) -> list[tuple[str, int, int, bytes]]:
        with next(bag.glob("*.mcap")).open("rb") as stream:
            return [
                (channel.topic, message.log_time, message.sequence, message.data)
                for _, channel, message in make_reader(stream).iter_messages(log_time_order=False)
            ]

    assert all_of(tmp_path / "new") == all_of(folder)


def test_a_bag_without_its_description_or_with_that_of_version_0_1_is_not_whole(
    tmp_path: Path, folder: Path, data: bytes
) -> None:
    assert is_whole(folder)
    bag = cut(tmp_path, data, len(data))
    assert not is_whole(bag)
    text = json.loads((folder / "metadata.yaml").read_text())
    for entry in text["rosbag2_bagfile_information"]["topics_with_message_count"]:
        # As text, which rosbag2 of Jazzy cannot decode.
        entry["topic_metadata"]["offered_qos_profiles"] = "- history: keep_last\n"
    (bag / "metadata.yaml").write_text(json.dumps(text))
    assert not is_whole(bag)
    recover(bag, tmp_path / "new")
    assert is_whole(tmp_path / "new")


def test_a_type_whose_hash_is_not_in_the_bag_gets_it_from_its_definition() -> None:
    for message_type in (Command, FormationStatus):
        wanted = described(message_type)
        assert type_hash_of(wanted.name, wanted.definition) == wanted.type_hash
    assert type_hash_of("satform_msgs/msg/Command", "float64 [") == ""


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"name: triangle\n" * 50])
def test_what_is_no_bag_is_refused_and_leaves_nothing(tmp_path: Path, content: bytes) -> None:
    bag = cut(tmp_path, content, len(content))
    with pytest.raises(BagError, match="holds no message that can be read"):
        recover(bag, tmp_path / "new")
    assert not (tmp_path / "new").exists()


ALIASES = "- &a [{}]\n" + "".join(
    f"- &{name} [{', '.join(['*' + of] * 9)}]\n" for of, name in pairwise("abcdefghijk")
)
"""Less than a kilobyte that stands for 9 ** 10 lists."""


def stranger(folder: Path, profiles: str, *, schema: bytes | None = b"int8 x\n", channel: int = 1) -> None:
    """A bag of someone else: two messages, the second one on any channel."""
    folder.mkdir()
    with (folder / "bag_0.mcap").open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start("ros2", "stranger")
        number = 0 if schema is None else writer.register_schema("a_msgs/msg/B", "ros2msg", schema)
        own = writer.register_channel("/a", "cdr", number, {"offered_qos_profiles": profiles})
        assert own == 1
        for place in (own, channel):
            writer.add_message(place, 0, b"\0\1\0\0\1", 0)
        writer.finish()


@pytest.mark.parametrize("profiles", [ALIASES, "5", "{ [ :", "- 2026-01-01", "- {1: 2}", "[" * 3000])
def test_a_bag_with_any_text_for_quality_of_service_is_recovered_without_it(
    tmp_path: Path, profiles: str
) -> None:
    stranger(tmp_path / "bag", profiles)
    assert recover(tmp_path / "bag", tmp_path / "new").messages == 2
    (entry,) = rosbag2_format.read(tmp_path / "new")["topics_with_message_count"]
    assert entry["topic_metadata"]["offered_qos_profiles"] == []


def test_a_bag_is_recovered_up_to_a_message_on_a_channel_that_is_not_described(tmp_path: Path) -> None:
    stranger(tmp_path / "bag", "", channel=99)
    found = recover(tmp_path / "bag", tmp_path / "new")
    assert (found.messages, found.damage) == (1, "a message is on channel 99, which is not described")


def test_a_bag_whose_types_are_not_described_or_no_text_holds_nothing_or_keeps_them(tmp_path: Path) -> None:
    stranger(tmp_path / "bag", "", schema=None)
    with pytest.raises(BagError, match="the type of the messages on /a is not described"):
        recover(tmp_path / "bag", tmp_path / "new")
    stranger(tmp_path / "other", "", schema=b"\xff\xfe")
    assert recover(tmp_path / "other", tmp_path / "new").messages == 2


def test_the_command_says_what_there_is_and_from_which_step_on_it_is_missing(
    tmp_path: Path, data: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = cut(tmp_path, data, len(data) // 2)
    steps = read_bag(bag).record.steps
    assert 0 < steps < STEPS
    assert cli.main(["recover", str(bag.parent)]) == 0
    out = capsys.readouterr().out.replace("\n", " ")
    assert (
        f"{steps} of {STEPS} steps are complete; the steps from {steps} on ({steps * 0.5:g} s) are missing"
        in out
    )
    rosbag2_format.read(bag.parent / "bag_recovered")
    # Neither the old nor the new bag is ever written over.
    assert cli.main(["recover", str(bag.parent)]) == 2
    assert "already exists" in capsys.readouterr().err.replace("\n", " ")
    assert cli.main(["recover", str(bag.parent / "bag_recovered"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["whole"] is True
