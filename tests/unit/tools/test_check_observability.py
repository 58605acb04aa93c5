# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about motions that the readings which reach a satellite do not show."""

from flights import shipped
from satform_tools.check.observability import observability_warnings

CAMERAS = "on the planned motion the readings that arrive do not show the size of the whole formation"


def test_a_pair_with_gnss_is_observable() -> None:
    assert observability_warnings(shipped("gnss_differential_pair")) == []


def test_without_absolute_gnss_the_whole_formation_is_not() -> None:
    differential = {"kind": "differential_gnss", "reference": "chief"}
    radio = {"kind": "radio_ranging", "targets": ["deputy"]}
    pair = shipped("gnss_differential_pair").with_(
        {"satellites[chief].sensors": [radio], "satellites[deputy].sensors": [differential]}
    )
    (sentence,) = observability_warnings(pair)
    assert sentence.startswith("navigation: chief, deputy: ")
    assert "do not show position and velocity of the whole formation;" in sentence


def test_without_exchange_each_knows_what_it_measures_itself() -> None:
    alone = shipped("gnss_differential_pair").with_({"satellite_defaults.navigation.exchange": "none"})
    (sentence,) = observability_warnings(alone)
    assert sentence.startswith("navigation: chief: ")
    assert "do not show position and velocity of deputy;" in sentence


def test_without_an_edge_nothing_is_exchanged() -> None:
    apart = shipped("gnss_differential_pair").with_({"graph": {"kind": "none"}})
    assert observability_warnings(apart)[0].startswith("navigation: chief: ")


def test_a_graph_that_holds_for_long_is_judged_by_itself() -> None:
    both = [["chief", "deputy"], ["deputy", "chief"]]
    parted = shipped("gnss_differential_pair").with_(graph_schedule=[{"at": 2000.0, "remove": both}])
    (sentence,) = observability_warnings(parted)
    assert sentence.startswith("navigation: from 2000 s on: chief: ")


def test_cameras_leave_the_size_of_a_formation_in_free_motion() -> None:
    (sentence,) = observability_warnings(shipped("bearing_only_swarm"))
    assert CAMERAS in sentence


def test_one_camera_leaves_the_distance_of_each_target() -> None:
    (sentence,) = observability_warnings(shipped("bearing_only_one_observer"))
    for name in ("sat2", "sat3", "sat4"):
        assert f"the distance of {name} from sat1" in sentence


def test_a_reference_is_known_and_needs_no_readings() -> None:
    # A range to it does not show what is across the plane in which both move.
    (sentence,) = observability_warnings(shipped("range_only_large_error"))
    assert "do not show a combined motion of seeker;" in sentence
    gnss = {"satellites[seeker].sensors": [{"kind": "gnss"}]}
    assert observability_warnings(shipped("range_only_large_error").with_(gnss)) == []
    unknown = {**gnss, "satellites[seeker].navigation.references": []}
    (sentence,) = observability_warnings(shipped("range_only_large_error").with_(unknown))
    assert "do not show position and velocity of known;" in sentence
