# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every shipped campaign is right, has an effect with each dispersion, and flies where theory says."""

import json
from typing import Any

import jsonschema
import numpy as np
import pytest
from ruamel.yaml import YAML

from campaigns import CAMPAIGNS, SHIPPED
from flights import SCENARIOS
from satform.campaign.cases import case_scenario, case_values, changed_scenario
from satform.campaign.loader import load_campaign
from satform.campaign.plan_digest import plan_digest
from satform.common.spec import FieldPath
from satform.evaluation.evaluate import evaluate
from satform.evaluation.stability_borders import loop_radius, lossy_consensus
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_tools.cli import main as cli
from satform_tools.describe import campaign_schema

pytestmark = pytest.mark.unmeasured

LOADED = {name: load_campaign(CAMPAIGNS / f"{name}.yaml") for name in SHIPPED}


def validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(json.loads((SCENARIOS / "campaign.schema.json").read_text()))


def test_campaigns_are_shipped() -> None:
    assert {"triangle_dispersed", "noisy_navigation_dispersed", "lossy_links_sweep", "gain_sweep"} <= set(
        SHIPPED
    )


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_campaign_says_what_it_is(name: str) -> None:
    campaign = LOADED[name]
    assert campaign.name == name
    assert campaign.title != "untitled"
    assert len(campaign.text) > 200
    assert campaign.expect


@pytest.mark.parametrize("name", SHIPPED)
def test_all_values_of_a_shipped_campaign_can_fly_and_no_dispersion_is_without_effect(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", name]) == 0
    assert capsys.readouterr().out.strip() == f"{name}: OK"


DISPERSIONS = [(name, index) for name in SHIPPED for index in range(len(LOADED[name].dispersions))]


@pytest.mark.parametrize(("name", "index"), DISPERSIONS)
def test_every_dispersion_is_applied(name: str, index: int) -> None:
    campaign = LOADED[name]
    number = campaign.cases // 2 + 1
    values, flown = case_values(campaign, number), case_scenario(campaign, number)
    assert campaign.targets[index]
    for target in campaign.targets[index]:
        assert value(flown, target.path) == values[target.text]
        assert value(flown, target.path) != value(campaign.base, target.path)
    only = {target.text: values[target.text] for target in campaign.targets[index]}
    assert plan_digest(changed_scenario(campaign, only, "a case")) != plan_digest(campaign.base)


def value(scenario: Scenario, path: FieldPath) -> Any:
    """What a scenario has at a path; of a satellite also what it takes from `satellite_defaults`."""
    node: Any = scenario
    for place, part in enumerate(path):
        if isinstance(part, int):
            node = scenario.satellite(part) if path[:place] == ("satellites",) else node[part]
        else:
            node = getattr(node, part)
    return node


@pytest.mark.parametrize("name", SHIPPED)
def test_the_schema_accepts_the_shipped_campaign(name: str) -> None:
    data = YAML(typ="safe", pure=True).load((CAMPAIGNS / f"{name}.yaml").read_text())
    validator().validate(data)


@pytest.mark.parametrize(
    "wrong",
    [
        {"runs": 3},
        {"scenario": "triangle", "dispersions": [{"distribution": {"kind": "normal"}}]},
        {"scenario": "triangle", "sampling": {"kind": "sobl"}},
        {"scenario": "triangle", "runs": 3, "expect": [{"kind": "success_rate", "above": 0.5}]},
        {"scenario": "triangle", "figures": [{"name": "dv", "measure": {"kind": "delta_v", "below": 3.0}}]},
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(wrong: dict[str, object]) -> None:
    assert not validator().is_valid(wrong)


def test_the_schema_beside_the_scenarios_is_that_of_the_code() -> None:
    kept = (SCENARIOS / "campaign.schema.json").read_text()
    command = "./tools/satform schema --campaign > scenarios/campaign.schema.json"
    assert kept == campaign_schema.text(), f"run {command}"


def test_agreement_fails_at_the_loss_of_the_theory() -> None:
    campaign = LOADED["lossy_links_sweep"]
    theory = lossy_consensus(campaign.base)
    assert theory.largest_loss() == pytest.approx(0.788, abs=0.001)
    grid = campaign.dispersions[0].grid
    assert grid is not None
    for loss, agrees in ((0.0, True), (0.5, True), (0.9, False)):
        number = int(np.argmin(np.abs(np.array(grid.points, dtype=float) - loss)))
        scenario = case_scenario(campaign, number)
        [verdict] = evaluate(scenario, simulate(scenario))
        assert verdict.met is agrees
        assert (theory.mean_square_radius(loss) < 1.0) is agrees


@pytest.mark.parametrize("number", [0, 78, 143, 230, 260, 300, 383])
def test_gains_are_stable_in_flight_where_they_are_in_theory(number: int) -> None:
    campaign = LOADED["gain_sweep"]
    scenario = case_scenario(campaign, number)
    radius = loop_radius(scenario, "tracking")
    # So close to one a loop takes longer than the flight.
    assert abs(radius - 1.0) > 0.01
    assert all(verdict.met for verdict in evaluate(scenario, simulate(scenario))) is (radius < 1.0)


def test_both_filters_of_ranges_alone_fly_with_the_same_readings() -> None:
    campaigns = [LOADED[name] for name in ("range_only_cubature", "range_only_cubature_particle")]
    for number in (0, 150):
        first, second = (
            simulate(case_scenario(each, number).with_({"timing.duration": 90.0})) for each in campaigns
        )
        assert first.navigation is not None
        assert second.navigation is not None
        assert np.array_equal(first.navigation.readings, second.navigation.readings, equal_nan=True)
        assert not np.array_equal(first.navigation.mean, second.navigation.mean)
