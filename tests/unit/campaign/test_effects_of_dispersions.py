# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Dispersions that cannot fly or have no effect are found before a campaign is flown."""

from typing import Any

import pytest

from campaigns import campaign, of
from flights import shipped
from satform.campaign.effects import case_problems, without_effect
from satform.campaign.plan_digest import plan_digest

UNIT = {"kind": "uniform", "low": 1.0, "high": 2.0}


def idle(scenario: str, *dispersions: dict[str, Any], **fields: Any) -> list[tuple[int, str]]:
    return without_effect(campaign(scenario, runs=10, dispersions=list(dispersions), **fields))


def test_a_default_that_every_satellite_overrides_changes_nothing() -> None:
    own = {f"satellites[{index}].scale": 1.0 for index in range(3)}
    found = idle("triangle", of("satellite_defaults.scale", UNIT), set=own)
    assert found == [(0, "satellite_defaults.scale changes nothing of what is flown")]
    # Two of three take the default here.
    assert idle("triangle", of("satellite_defaults.scale", UNIT)) == []


def test_a_default_of_links_that_every_edge_overrides_changes_nothing() -> None:
    path, wide = "links.default.loss", {"kind": "uniform", "low": 0.0, "high": 0.5}
    names = ("sat1", "sat2", "sat3")
    edges = [{"sender": a, "receiver": b, "loss": 0.1} for a in names for b in names if a != b]
    assert idle("lossy_links", of(path, wide)) == []
    assert idle("lossy_links", of(path, wide), set={"links.edges": edges}) == [
        (0, "links.default.loss changes nothing of what is flown")
    ]


def test_a_distribution_without_width_is_named() -> None:
    found = idle(
        "triangle",
        of("orbit.period", {"kind": "normal", "mean": 6000.0, "standard_deviation": 0.0}),
        of("seed", {"kind": "choice", "values": [3]}),
        of("satellites[0].arc_length", UNIT),
    )
    assert [index for index, _ in found] == [0, 1]
    assert all("has the same value in all cases" in sentence for _, sentence in found)


def test_what_only_processes_wait_for_changes_nothing() -> None:
    assert [index for index, _ in idle("triangle", of("node_timeout", UNIT))] == [0]


def test_fields_of_a_wildcard_without_effect_are_named_one_by_one() -> None:
    # Satellite 1 receives from nobody.
    own = {
        "graph": {"kind": "matrix", "rows": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]},
        "links.edges": [
            {"sender": "sat3", "receiver": "sat1", "loss": 0.1},
            {"sender": "sat1", "receiver": "sat2", "loss": 0.1},
        ],
    }
    wide = {"kind": "uniform", "low": 0.0, "high": 0.5}
    assert idle("lossy_links", of("links.edges[*].loss", wide), set=own) == [
        (0, "links.edges[0].loss changes nothing of what is flown")
    ]


def test_rounded_values_that_are_all_alike_change_nothing() -> None:
    narrow = {"kind": "uniform", "low": 0.6, "high": 1.4}
    found = idle("triangle", of("seed", narrow))
    assert found == [(0, "seed changes nothing of what is flown")]


@pytest.mark.parametrize(
    "name",
    ["triangle", "noisy_navigation", "lossy_links", "geo_sphere", "directed_triangle", "formation_pointing"],
)
def test_the_digest_of_what_is_flown_sees_a_start_and_no_words(name: str) -> None:
    own = shipped(name).with_({"expect": [], "title": "another", "node_timeout": 20.0})
    assert plan_digest(own) == plan_digest(shipped(name))
    assert plan_digest(own.with_({"satellites[0].velocity_error": [1.0, 0.0, 0.0]})) != plan_digest(own)


def test_what_a_plan_computes_when_it_is_asked_is_no_part_of_its_digest() -> None:
    own = shipped("directed_triangle", "title=another")
    before = plan_digest(own)
    graph = own.membership_plan().possible_graph
    assert "eigenvalues" not in vars(graph)
    assert len(graph.eigenvalues) == 3
    assert plan_digest(own) == before


def test_values_that_cannot_fly_are_found_at_the_ends_of_a_distribution() -> None:
    wide = {"kind": "normal", "mean": 0.75, "standard_deviation": 0.25}
    made = campaign(runs=10_000, dispersions=[of("satellites[1].scale", wide)])
    [(index, sentence)] = case_problems(made)
    assert index == 0
    assert sentence.startswith("a case, satellites[1].scale = -")
    assert "greater than 0" in sentence
    narrow = campaign(runs=100, dispersions=[of("satellites[1].scale", {**wide, "standard_deviation": 0.05})])
    assert case_problems(narrow) == []


def test_values_that_cannot_fly_together_are_found() -> None:
    # Alone each begin is before the end and each end after the begin.
    made = campaign(
        "lossy_links",
        runs=10,
        dispersions=[
            of("links.edges[0].outages[0].begin", {"kind": "uniform", "low": 1500.0, "high": 2099.0}),
            of("links.edges[0].outages[0].end", {"kind": "choice", "values": [1501.0, 2100.0, 1501.5]}),
        ],
    )
    [(index, sentence), *_] = case_problems(made)
    assert index is None
    assert "is not later than begin" in sentence


def test_a_value_of_a_grid_that_cannot_fly_is_found() -> None:
    made = campaign(
        sampling={"kind": "grid"}, dispersions=[of("timing.step", grid={"values": [0.5, 0.7, 1.0]})]
    )
    [(index, sentence)] = case_problems(made)
    assert index == 0
    assert "17142.9 steps" in sentence


def test_the_ends_of_many_fields_are_farther_out_than_those_of_one() -> None:
    # The end is 3.5 standard deviations below the mean for 100 draws, 3.8 for 300; 0 is 3.7 below it.
    wide = {"kind": "normal", "mean": 1.0, "standard_deviation": 0.267}
    shared = of("satellites[*].scale", wide, shared=True)
    assert case_problems(campaign(runs=100, dispersions=[shared])) == []
    [(index, sentence)] = case_problems(campaign(runs=100, dispersions=[of("satellites[*].scale", wide)]))
    assert index == 0
    assert "greater than 0" in sentence
