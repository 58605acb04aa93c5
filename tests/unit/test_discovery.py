"""Processes find each other on this machine, however many they are, as far as it can be."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from satform_bringup import discovery


@pytest.fixture(autouse=True)
def untold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(discovery.RANGE, raising=False)
    monkeypatch.delenv(discovery.PROFILE, raising=False)


def test_a_small_run_is_found_by_whoever_looks_in_without_being_told_how(tmp_path: Path) -> None:
    assert discovery.variables(5, tmp_path) == {}
    assert list(tmp_path.iterdir()) == []


def test_a_large_run_has_no_transport_that_leaves_the_machine(tmp_path: Path) -> None:
    profile = Path(discovery.variables(66, tmp_path)[discovery.PROFILE])
    tree = ElementTree.parse(profile)  # noqa: S314 - written by the code under test
    kinds = [element.text for element in tree.iter() if element.tag.endswith("}type")]
    builtin = [element.text for element in tree.iter() if element.tag.endswith("}useBuiltinTransports")]
    assert (kinds, builtin) == (["SHM"], ["false"])


@pytest.mark.parametrize(
    ("name", "value"), [(discovery.RANGE, "SUBNET"), (discovery.PROFILE, "/etc/own_profile.xml")]
)
def test_what_the_environment_says_is_left_as_it_is(
    name: str, value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    assert discovery.variables(66, tmp_path) == {}


def test_too_many_processes_are_refused_with_a_group_size_that_fits(tmp_path: Path) -> None:
    with pytest.raises(discovery.DiscoveryError, match="--group 11"):
        discovery.variables(1002, tmp_path)
