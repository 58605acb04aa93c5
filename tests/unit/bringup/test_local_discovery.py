# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Processes find each other on this machine, however many they are, as far as it can be."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from satform_bringup.deployment import local_discovery, middleware
from satform_nodes import LEAN


@pytest.fixture(autouse=True)
def untold(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (local_discovery.RANGE, "ROS_STATIC_PEERS", *middleware.VARIABLES):
        monkeypatch.delenv(name, raising=False)


def texts(file: str, element: str) -> list[str | None]:
    tree = ElementTree.parse(file)  # noqa: S314 - written by the code under test
    return [found.text for found in tree.iter() if found.tag.endswith("}" + element)]


def test_a_run_talks_on_the_loopback_interface_alone(tmp_path: Path) -> None:
    for processes in (5, 66):
        told = local_discovery.variables(processes, processes - 2, tmp_path)
        assert told[local_discovery.RANGE] == "SYSTEM_DEFAULT"
        # Where it is 1 the range is not looked at.
        assert told["ROS_LOCALHOST_ONLY"] == ""
        profile = told[middleware.VARIABLES[0]]
        assert texts(profile, "type") == ["UDPv4"]
        assert texts(profile, "useBuiltinTransports") == ["false"]
        assert set(texts(profile, "address")) == {"127.0.0.1"}


def test_nodes_are_lean_where_there_are_many(tmp_path: Path) -> None:
    assert LEAN not in local_discovery.variables(34, 32, tmp_path)
    assert local_discovery.variables(35, 33, tmp_path)[LEAN]


def test_everyone_calls_at_every_port_that_a_process_can_have(tmp_path: Path) -> None:
    profile = local_discovery.variables(5, 3, tmp_path)[middleware.VARIABLES[0]]
    assert texts(profile, "maxInitialPeersRange") == ["100"]
    assert local_discovery.MOST < 100


def test_what_is_lost_on_its_way_is_noticed_the_later_the_more_have_to_tell(tmp_path: Path) -> None:
    profile = local_discovery.variables(5, 3, tmp_path)[middleware.VARIABLES[0]]
    # Heartbeats of writers, then the delay of readers' acknowledgements.
    assert texts(profile, "sec") == ["0", "0"]
    assert texts(profile, "nanosec") == ["30000000", "50000000"]
    assert middleware.heartbeat(1000) == middleware.SLOWEST_HEARTBEAT


def test_what_a_network_loses_is_asked_for_sooner(tmp_path: Path) -> None:
    profile = middleware.write_profile(tmp_path, 0.03, middleware.PATIENT_ANNOUNCEMENTS)
    responses = texts(profile[middleware.VARIABLES[0]], "nanosec")[-1:]
    assert responses == ["5000000"]


@pytest.mark.parametrize(
    ("name", "value"), [(local_discovery.RANGE, "SUBNET"), ("ROS_STATIC_PEERS", "192.0.2.7")]
)
def test_another_range_and_peers_are_left_as_they_are(
    name: str, value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    told = local_discovery.variables(66, 64, tmp_path)
    assert set(told) == {LEAN, *middleware.VARIABLES}
    assert texts(told[middleware.VARIABLES[0]], "useBuiltinTransports") == []


@pytest.mark.parametrize("name", middleware.VARIABLES)
def test_settings_of_the_users_own_are_left_as_they_are(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, "/etc/own_profile.xml")
    assert local_discovery.variables(5, 3, tmp_path) == {}
    assert local_discovery.variables(66, 64, tmp_path) == {LEAN: "1"}
    assert list(tmp_path.iterdir()) == []


def test_too_many_processes_are_refused_with_a_group_size_that_fits(tmp_path: Path) -> None:
    with pytest.raises(local_discovery.DiscoveryError, match="--satellites-per-process 11"):
        local_discovery.variables(1002, 1000, tmp_path)
