# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who flies and who hears whom is taken from the plant's word when it fits this formation."""

import pytest
from satform_msgs.msg import FormationStatus, SatelliteTarget

from flights import shortened
from satform.flight.compile import compile_scenario
from satform.membership.reconfiguration import Target, TargetSpec, target_of
from satform.protocol.formation_view import FormationView

NAMES = ["sat1", "sat2", "sat3"]


def word(**changes: object) -> FormationStatus:
    whole = {
        "version": 1,
        "step": 7,
        "phase": FormationStatus.FLYING,
        "satellites": NAMES,
        "alive": [True, True, True],
        "edge_receivers": [0, 2],
        "edge_senders": [1, 0],
    }
    status = FormationStatus(**(whole | changes))
    seconds, half = divmod(status.step, 2)
    status.header.stamp.sec, status.header.stamp.nanosec = seconds, half * 500_000_000
    return status


@pytest.fixture
def view() -> FormationView:
    return FormationView(compile_scenario(shortened("triangle", 10.0)))


def test_a_newer_word_is_the_formation_from_its_step_on(view: FormationView) -> None:
    assert view.take(word(alive=[True, False, True]))
    assert view.formation.graph.adjacency.tolist() == [[0, 1, 0], [0, 0, 0], [1, 0, 0]]
    assert (view.formation.number, view.formation.step) == (1, 7)
    assert view.lost == ["sat2"]
    before = view.formation.graph
    assert view.take(word(version=2, step=9))
    # Whose graph is the same has kept what has been computed of it.
    assert view.formation.graph is before
    assert view.lost == []


def test_a_word_that_is_not_newer_tells_the_phase_alone(view: FormationView) -> None:
    assert view.take(word(version=0, alive=[False, False, False], phase=FormationStatus.PAUSED))
    assert view.paused
    assert view.lost == []
    assert view.formation.number == 0


@pytest.mark.parametrize(
    "changes",
    [
        {"satellites": ["sat1", "sat2", "other"]},
        {"alive": [True, True]},
        {"edge_receivers": [0]},
        {"edge_receivers": [0], "version": 0},
        {"edge_senders": [1, 3]},
        {"edge_senders": [0, 1]},
        {"lost": ["other"]},
        {"rejoined": ["sat1"]},
        {"targets": [SatelliteTarget(satellite="other", target="{}")]},
        {"targets": [SatelliteTarget(satellite="sat1", target='{"scale": -1.0}')]},
    ],
)
def test_a_word_that_does_not_fit_changes_nothing(view: FormationView, changes: dict[str, object]) -> None:
    assert not view.take(word(phase=FormationStatus.FINISHED, **changes))
    assert view.ended is None
    assert view.received_statuses == view.formation.number == 0


def test_the_text_of_a_target_is_parsed_once_for_all_satellites_of_a_process(view: FormationView) -> None:
    other = FormationView(compile_scenario(shortened("triangle", 10.0)))
    target = SatelliteTarget(satellite="sat2", since=7, target='{"scale": 1.25}', fields=["scale"])
    parsed = target_of.cache_info().misses
    for version in (1, 2):
        assert view.take(word(version=version, targets=[target]))
        assert other.take(word(version=version, targets=[target]))
    assert target_of.cache_info().misses == parsed + 1
    expected = Target(TargetSpec(scale=1.25), 7, frozenset({"scale"}))
    assert view.formation.targets == other.formation.targets == {1: expected}
