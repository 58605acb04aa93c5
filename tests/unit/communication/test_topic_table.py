# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who says what to whom: one table for the nodes, the recorder, the permissions and the pages."""

import re
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest

from flights import SCENARIOS, shipped
from satform.communication.topic_table import (
    KINDS_OF_A_SATELLITE,
    PLANT,
    RECORDER,
    Channel,
    channels,
    published_by,
    satellite_channels,
    subscribed_by,
)
from satform.flight.compile import topic_plan
from satform.scenario import Scenario
from satform_nodes.transport import topic_types

README = Path(__file__).resolve().parents[3] / "ros_ws" / "src" / "satform_nodes" / "README.md"

RING = "graph={kind: matrix, rows: [[0,1,0],[0,0,1],[1,0,0]]}"
"""Each of the three hears the next one and is not heard back."""


NAVIGATION = (
    "satellite_defaults.navigation={kind: extended, acceleration_density: 1.0e-6, "
    "initial_position_error: 1.0, initial_velocity_error: 0.1}"
)


def by_topic(scenario: Scenario) -> dict[str, Channel]:
    return {channel.topic: channel for channel in channels(topic_plan(scenario))}


def test_who_listens_to_whom_is_the_adjacency_matrix() -> None:
    scenario = shipped("triangle", RING)
    table, names = by_topic(scenario), [satellite.name for satellite in scenario.satellites]
    heard = [[hearer in table[f"/{speaker}/arc_length"].subscribers for speaker in names] for hearer in names]
    assert np.array_equal(heard, [[0, 1, 0], [0, 0, 1], [1, 0, 0]])


def test_whoever_is_to_be_heard_later_is_listened_to_from_the_start() -> None:
    later = shipped("triangle", RING, "graph_schedule=[{at: 100.0, graph: {kind: complete}}]")
    assert by_topic(later)["/sat1/arc_length"].subscribers == ("sat2", "sat3", RECORDER)


def test_sensors_thrusters_and_attitudes_add_topics_of_the_plant() -> None:
    plain = set(by_topic(shipped("triangle")))
    thruster = {f"/sat{number}/propulsion" for number in (1, 2, 3)}
    assert (
        set(by_topic(shipped("triangle", "satellite_defaults.thruster={dry_mass: 12.0}"))) - plain == thruster
    )
    noisy = by_topic(shipped("noisy_navigation"))
    assert noisy["/raw/truth"].publishers == (PLANT,)
    assert noisy["/raw/truth"].subscribers == (RECORDER,)
    turning = by_topic(shipped("formation_pointing"))
    attitude = [channel for channel in turning.values() if channel.kind == "attitude"]
    assert [channel.subscribers for channel in attitude] == [
        (channel.topic.split("/")[1], RECORDER) for channel in attitude
    ]
    assert attitude


@pytest.mark.parametrize("name", ["triangle", "noisy_navigation", "formation_pointing"])
def test_the_recorder_hears_all_but_what_is_for_the_plant_to_begin(name: str) -> None:
    table = channels(topic_plan(shipped(name)))
    unheard = {channel.topic for channel in table} - {
        channel.topic for channel in subscribed_by(RECORDER, table)
    }
    assert unheard == {"/formation/node_ready", "/formation/recorder_progress"}
    assert all(RECORDER not in channel.subscribers_in(recorded=False) for channel in table)


@pytest.mark.unmeasured
def test_the_kinds_of_a_satellites_topics_are_all_that_shipped_scenarios_have() -> None:
    with_thruster = shipped("triangle", "satellite_defaults.thruster={dry_mass: 12.0}")
    with_orbits = shipped("truth_j2", "publish_orbits=true")
    by_sensors = shipped("triangle", "satellite_defaults.sensors=[{kind: gnss}]", NAVIGATION)
    scenarios = [
        with_thruster,
        with_orbits,
        by_sensors,
        *(shipped(path.stem) for path in SCENARIOS.glob("*.yaml")),
    ]
    found = {
        channel.kind
        for scenario in scenarios
        for index in range(len(scenario.satellites))
        for channel in satellite_channels(topic_plan(scenario), index)
    }
    assert found == set(KINDS_OF_A_SATELLITE)


def test_nobody_speaks_in_another_satellites_name() -> None:
    table = channels(topic_plan(shipped("noisy_navigation")))
    for name in ("raw", "late"):
        own = [channel.topic for channel in published_by(name, table)]
        assert {topic.split("/")[1] for topic in own} == {name, "formation", "diagnostics"}


@pytest.mark.parametrize("name", ["triangle", "noisy_navigation", "formation_pointing"])
def test_every_topic_has_a_type_and_its_name_ends_with_its_kind(name: str) -> None:
    for channel in channels(topic_plan(shipped(name))):
        assert channel.kind in topic_types.TYPES
        assert channel.topic.endswith(f"/{channel.kind}")


def described() -> dict[str, tuple[str, str]]:
    """Publisher and subscribers of each topic, as the README of the nodes has them."""
    part = README.read_text(encoding="utf-8").partition("\n## Topics\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([^`]+)` \| [^|]+ \| [^|]+ \| ([^|]+) \| ([^|]+) \|$", part, flags=re.MULTILINE)
    return {topic: (speaker, listener) for topic, speaker, listener in rows}


@pytest.mark.parametrize("name", ["formation_pointing", "noisy_navigation"])
def test_the_readme_names_publisher_and_subscribers_of_each_topic(name: str) -> None:
    scenario = shipped(name, "satellite_defaults.thruster={dry_mass: 12.0}")
    names = {satellite.name for satellite in scenario.satellites}
    for topic, channel in by_topic(scenario).items():
        own = topic.split("/")[1]
        speakers, listeners = described()[
            topic.replace(f"/{own}/", "/<satellite>/") if own in names else topic
        ]
        meant = {"plant": {PLANT}, "satellite": {own}, "satellites": names, RECORDER: {RECORDER}}
        who = takewhile(meant.__contains__, speakers.split(", "))
        assert set().union(*(meant[word] for word in who)) == set(channel.publishers), topic
        hearers = {"plant": {PLANT}, "that satellite": {own}, "all satellites": names, "observers": set()}
        if listeners in hearers:
            assert hearers[listeners] == set(channel.subscribers_in(recorded=False)), topic
        else:
            assert listeners == "its out-neighbours in the graph", topic
