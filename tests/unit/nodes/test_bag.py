# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight in a bag: written and read back to the last bit, read by others, and read after damage."""

import dataclasses
import io
import json
import random
import struct
from collections.abc import Iterator
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Vector3
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from satform_msgs.msg import Command, FormationStatus

from bag_writing import VERSIONS, Messages, first_steps, messages_of, write
from flights import shortened
from satform.bag.errors import BagError
from satform.bag.reader import read_bag
from satform.communication import topic_table
from satform.communication.sim_time import NANOSECONDS
from satform.consensus.graph import Graph
from satform.flight.simulate import simulate
from satform.membership.formation import Plan, SatelliteLost, TopologyChanged
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_nodes.bag.writer import BagWriter
from satform_tools.run.replay import compare

STEPS = 400


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return shortened("triangle", 0.5 * STEPS)


@pytest.fixture(scope="module")
def record(scenario: Scenario) -> FlightRecord:
    return simulate(scenario)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, scenario: Scenario, record: FlightRecord) -> Path:
    """A bag of the whole flight."""
    folder = tmp_path_factory.mktemp("run") / "bag"
    write(folder, scenario, messages_of(record))
    return folder


@pytest.fixture(scope="module")
def data(folder: Path) -> bytes:
    return (folder / "bag_0.mcap").read_bytes()


def test_a_flight_comes_back_from_its_bag_with_the_same_bits(
    folder: Path, scenario: Scenario, record: FlightRecord
) -> None:
    bag = read_bag(folder)
    assert bag.record.differences(record) == []
    assert bag.complete
    assert bag.scenario == scenario
    assert bag.path == folder / "bag_0.mcap"
    assert bag.versions == {**VERSIONS, "scenario": "triangle", "digest": scenario.digest()}


def test_the_mcap_file_alone_is_as_good_as_its_folder(folder: Path) -> None:
    assert read_bag(folder / "bag_0.mcap").record.differences(read_bag(folder).record) == []


def test_every_message_is_counted(folder: Path) -> None:
    counts = {
        f"/{name}/{kind}": STEPS + (kind in ("state", "arc_length"))
        for name in ("sat1", "sat2", "sat3")
        for kind in ("state", "arc_length", "command", "tracking")
    }
    assert read_bag(folder).messages == counts
    described = json.loads((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert described["message_count"] == sum(counts.values())
    assert described["starting_time"] == {"nanoseconds_since_epoch": 0}
    assert described["duration"] == {"nanoseconds": STEPS * 500_000_000}
    told = {
        entry["topic_metadata"]["name"]: entry["message_count"]
        for entry in described["topics_with_message_count"]
    }
    assert told == counts


def test_rosbags_reads_the_same_numbers_with_nothing_but_the_bag(folder: Path, record: FlightRecord) -> None:
    expected = messages_of(record)
    with AnyReader([folder]) as reader:
        assert reader.message_count == sum(read_bag(folder).messages.values())
        for connection, nanoseconds, raw in reader.messages():
            kind, name, step, numbers = next(expected)
            assert connection.topic == f"/{name}/{kind}"
            message: Any = reader.deserialize(raw, connection.msgtype)
            assert message.step == step
            assert message.header.frame_id == "lvlh"
            assert message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec == nanoseconds
            assert nanoseconds == step * 500_000_000
            found = {field: reduce(getattr, field.split("."), message) for field in numbers}
            assert found == numbers
    assert next(expected, None) is None


def test_mcap_ros2_reads_the_same_numbers(folder: Path, record: FlightRecord) -> None:
    with (folder / "bag_0.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        found = [
            (decoded.step, decoded.acceleration.y, message.sequence, message.log_time)
            for _, _, message, decoded in reader.iter_decoded_messages(topics=["/sat2/command"])
        ]
    expected = [(k, y, k, k * 500_000_000) for k, y in enumerate(record.acceleration[:, 1, 1].tolist())]
    assert found == expected


def test_the_definitions_in_the_bag_bear_their_units(folder: Path) -> None:
    with (folder / "bag_0.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    texts = {schema.name: schema.data.decode() for schema in summary.schemas.values()}
    assert "m/s^2, lvlh" in texts["satform_msgs/msg/Command"]
    assert len(texts) == 4


def test_a_bag_that_exists_is_not_written_over(folder: Path, scenario: Scenario, data: bytes) -> None:
    with pytest.raises(FileExistsError):
        BagWriter(folder, scenario, VERSIONS)
    assert (folder / "bag_0.mcap").read_bytes() == data


def test_what_is_flushed_can_be_read_while_the_flight_goes_on(
    tmp_path: Path, scenario: Scenario, record: FlightRecord
) -> None:
    writer = write(tmp_path / "bag", scenario, messages_of(record), close=False)
    writer.flush()
    bag = read_bag(tmp_path / "bag")
    assert bag.record.steps == STEPS
    assert not bag.complete
    assert bag.record.differences(first_steps(record, bag.record.steps)) == []
    writer.close()
    assert read_bag(tmp_path / "bag").complete


def test_a_bag_that_was_closed_before_the_flights_end_is_not_complete(
    tmp_path: Path, scenario: Scenario, record: FlightRecord
) -> None:
    write(tmp_path / "bag", scenario, messages_of(first_steps(record, 17)))
    bag = read_bag(tmp_path / "bag")
    assert (bag.record.steps, bag.complete) == (17, False)
    assert bag.record.differences(first_steps(record, 17)) == []


def test_a_bag_of_the_first_state_only_is_a_flight_of_no_steps(
    tmp_path: Path, scenario: Scenario, record: FlightRecord
) -> None:
    write(tmp_path / "bag", scenario, messages_of(first_steps(record, 0)))
    assert read_bag(tmp_path / "bag").record.steps == 0


def test_a_flight_ends_where_the_first_satellite_falls_silent(
    tmp_path: Path, scenario: Scenario, record: FlightRecord
) -> None:
    silent = (
        message
        for message in messages_of(record)
        if not (message[:2] == ("command", "sat2") and message[2] >= 30)
    )
    write(tmp_path / "bag", scenario, silent)
    bag = read_bag(tmp_path / "bag")
    assert (bag.record.steps, bag.complete) == (30, False)


def chunks(data: bytes) -> Iterator[tuple[int, dict[str, int]]]:
    """Where each chunk of a whole file ends, and how many messages of each topic there are up to there."""
    place, counts, names = 8, dict[str, int](), dict[int, str]()
    stream = StreamReader(io.BytesIO(data), emit_chunks=True)
    for record in stream.records:
        (length,) = struct.unpack_from("<Q", data, place + 1)
        place += 9 + length
        if not isinstance(record, Chunk):
            continue
        for entry in breakup_chunk(record):
            if isinstance(entry, Channel):
                names[entry.id] = entry.topic
            elif isinstance(entry, Message):
                topic = names[entry.channel_id]
                counts[topic] = counts.get(topic, 0) + 1
        yield place, dict(counts)


def complete_steps(ends: list[tuple[int, dict[str, int]]], length: int) -> int | None:
    """Steps of which everything is in the chunks before a length; None when not even a state is."""
    held: dict[str, int] = {}
    for end, counts in ends:
        if end <= length:
            held = counts
    least = {
        kind: min(held.get(f"/{name}/{kind}", 0) for name in ("sat1", "sat2", "sat3"))
        for kind in ("state", "arc_length", "command", "tracking")
    }
    states = min(least["state"], least["arc_length"])
    return None if states == 0 else min(states - 1, least["command"], least["tracking"])


def lengths(data: bytes) -> list[int]:
    """Fifty lengths anywhere in the file, and those at which the file's own frame is cut."""
    anywhere = random.Random(1).sample(range(len(data)), 50)
    return sorted({*range(24), *anywhere, len(data) - 1, len(data) - 8, len(data) - 9, len(data) - 20})


@pytest.mark.unmeasured
def test_a_bag_cut_at_any_length_opens_up_to_its_last_complete_chunk_or_says_why_not(
    tmp_path: Path, data: bytes, record: FlightRecord
) -> None:
    opened, ends = 0, list(chunks(data))
    for length in lengths(data):
        file = tmp_path / f"cut_{length}.mcap"
        file.write_bytes(data[:length])
        expected = complete_steps(ends, length)
        if expected is None:
            with pytest.raises(BagError) as refusal:
                read_bag(file)
            path, _, sentence = str(refusal.value).partition(": ")
            assert path == str(file)
            assert len(sentence.strip(": ")) > 10
            assert not sentence.rstrip().endswith(":")
            continue
        bag = read_bag(file)
        opened += 1
        assert not bag.complete
        assert bag.record.steps == expected
        assert bag.record.differences(first_steps(record, expected)) == []
    assert opened > 20


def test_a_damaged_bag_gives_right_numbers_up_to_the_damage_or_says_why_not(
    tmp_path: Path, data: bytes, record: FlightRecord
) -> None:
    generator = random.Random(2)
    file = tmp_path / "damaged.mcap"
    (end,) = struct.unpack("<Q", data[-28:-20])  # of the part that a reader in order relies on
    scenario_end = data.index(b"satform_msgs/msg/RelativeState")
    opened, rejections = 0, []
    places = generator.sample(range(scenario_end), 15), generator.sample(range(scenario_end, end - 13), 25)
    for place in (*places[0], *places[1]):
        damaged = bytearray(data)
        damaged[place] ^= 1 << generator.randrange(8)
        file.write_bytes(damaged)
        try:
            bag = read_bag(file)
        except BagError as refusal:
            rejections.append(str(refusal))
            continue
        opened += 1
        assert not bag.complete, f"byte {place}"
        read = dataclasses.replace(bag.record, step=record.step, satellites=record.satellites)
        assert read.differences(first_steps(record, bag.record.steps)) == [], f"byte {place}"
    assert opened > 0
    assert rejections
    assert all(refusal.startswith(f"{file}: ") for refusal in rejections)


def test_a_gap_in_the_steps_is_named(tmp_path: Path, scenario: Scenario, record: FlightRecord) -> None:
    gap = (message for message in messages_of(record) if message[:3] != ("tracking", "sat3", 41))
    write(tmp_path / "bag", scenario, gap)
    with pytest.raises(BagError, match=r"/sat3/tracking has step 42 where step 41 was to follow"):
        read_bag(tmp_path / "bag")


def test_what_a_killed_satellite_said_and_nobody_recorded_is_not_a_number(
    tmp_path: Path, scenario: Scenario
) -> None:
    events: Plan = {200: [SatelliteLost(1, "killed")]}
    flown = simulate(scenario, events=events)
    own = {"arc_length", "command", "tracking"}
    heard = (
        message
        for message in messages_of(flown)
        if not (message[0] in own and message[1] == "sat2" and message[2] >= 150)
    )
    last_word = Command(
        step=199,
        acceleration=Vector3(**dict(zip("xyz", flown.acceleration[199, 1].tolist(), strict=True))),
        announced_arc_length=float(flown.arc_length[200, 1]),
        announced_rate=float(flown.rate[200, 1]),
    )
    last_word.header.frame_id = topic_table.FRAME
    everyone = [satellite.name for satellite in scenario.satellites]
    status = FormationStatus(
        step=200,
        version=1,
        satellites=everyone,
        alive=[True, False, True],
        edge_receivers=[listener for _, listener in scenario.communication_graph().edges],
        edge_senders=[speaker for speaker, _ in scenario.communication_graph().edges],
        lost=["sat2"],
        final_commands=[last_word],
        reason="killed",
    )
    write(tmp_path / "bag", scenario, heard, statuses=[status])
    bag = read_bag(tmp_path / "bag")
    assert np.isnan(bag.record.acceleration[150:199, 1]).all()
    np.testing.assert_array_equal(bag.record.acceleration[199, 1], flown.acceleration[199, 1])
    assert (bag.record.acceleration[200:, 1] == 0.0).all()
    assert np.isnan(bag.record.sliding_variable[150:, 1]).all()
    assert np.isnan(bag.record.arc_length[150:200, 1]).all()
    assert bag.record.arc_length[200, 1] == flown.arc_length[200, 1]
    assert compare(bag.scenario, bag.record, bag.events).differences == ()


def test_the_links_of_a_bag_follow_a_graph_that_was_set_in_flight(tmp_path: Path, scenario: Scenario) -> None:
    flown = simulate(scenario, events={100: [TopologyChanged(Graph(np.zeros((3, 3))), "told to")]})
    status = FormationStatus(
        step=100,
        version=1,
        satellites=[satellite.name for satellite in scenario.satellites],
        alive=[True, True, True],
        reason="told to",
    )
    write(tmp_path / "bag", scenario, messages_of(flown), statuses=[status])
    links = read_bag(tmp_path / "bag").record.links
    assert links is not None
    assert links.delivered[:100].all()
    assert not links.delivered[100:].any()


def test_a_message_that_is_there_twice_is_named(
    tmp_path: Path, scenario: Scenario, record: FlightRecord
) -> None:
    def twice() -> Messages:
        for message in messages_of(record):
            yield message
            if message[:3] == ("state", "sat1", 7):
                yield message

    write(tmp_path / "bag", scenario, twice())
    with pytest.raises(BagError, match=r"/sat1/state has step 7 where step 8 was to follow"):
        read_bag(tmp_path / "bag")
