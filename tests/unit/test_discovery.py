"""Processes find each other on this machine, however many they are, as far as it can be."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from satform_bringup import discovery, middleware


@pytest.fixture(autouse=True)
def untold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(discovery.RANGE, raising=False)
    for name in middleware.VARIABLES:
        monkeypatch.delenv(name, raising=False)


def texts(file: str, element: str) -> list[str | None]:
    tree = ElementTree.parse(file)  # noqa: S314 - written by the code under test
    return [found.text for found in tree.iter() if found.tag.endswith("}" + element)]


def test_a_small_run_is_found_by_whoever_looks_in_without_being_told_how(tmp_path: Path) -> None:
    told = discovery.variables(5, 3, tmp_path)
    assert set(told) == set(middleware.VARIABLES)
    assert texts(told[middleware.VARIABLES[0]], "useBuiltinTransports") == []


def test_a_large_run_has_no_transport_that_leaves_the_machine(tmp_path: Path) -> None:
    profile = discovery.variables(66, 64, tmp_path)[middleware.VARIABLES[0]]
    assert texts(profile, "type") == ["SHM"]
    assert texts(profile, "useBuiltinTransports") == ["false"]


def test_what_is_lost_on_its_way_is_noticed_the_later_the_more_have_to_tell(tmp_path: Path) -> None:
    profile = discovery.variables(5, 3, tmp_path)[middleware.VARIABLES[0]]
    assert texts(profile, "sec") == ["0"]
    assert texts(profile, "nanosec") == ["30000000"]
    assert middleware.heartbeat(1000) == middleware.SLOWEST_HEARTBEAT


def test_another_range_is_left_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(discovery.RANGE, "SUBNET")
    told = discovery.variables(66, 64, tmp_path)
    assert set(told) == set(middleware.VARIABLES)
    assert texts(told[middleware.VARIABLES[0]], "useBuiltinTransports") == []


@pytest.mark.parametrize("name", middleware.VARIABLES)
def test_settings_of_the_users_own_are_left_as_they_are(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, "/etc/own_profile.xml")
    assert discovery.variables(66, 64, tmp_path) == {}
    assert list(tmp_path.iterdir()) == []


def test_too_many_processes_are_refused_with_a_group_size_that_fits(tmp_path: Path) -> None:
    with pytest.raises(discovery.DiscoveryError, match="--group 11"):
        discovery.variables(1002, 1000, tmp_path)
