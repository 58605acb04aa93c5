# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every shipped scenario says what it is, and the schema beside them is theirs."""

import functools
import json

import jsonschema
import pytest
from ruamel.yaml import YAML

from flights import SCENARIOS, shipped
from satform.scenario import parse_scenario
from satform_tools.check import warnings
from satform_tools.describe import json_schema

NAMES = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))

RESPONSES = {name for name in NAMES if name.startswith(("geo_parallel_l", "geo_sphere_l"))}

SATURATED = ("netsat_helix", "thruster_limited")

CIRCULAR_LAW = ("eccentric_rigid", "netsat_helix")


@functools.cache
def validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(json.loads((SCENARIOS / "scenario.schema.json").read_text()))


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_scenario_bears_its_own_name_and_says_where_it_comes_from(name: str) -> None:
    scenario = shipped(name)
    assert scenario.name == name
    assert scenario.sources


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_scenario_follows_all_advice_on_gains_and_steps(name: str) -> None:
    # Some leave a satellite out of the graph on purpose, to show what becomes of it; step responses begin
    # in the chief's place, as in their source, where another satellite stays or is compared with them.
    # Formations of 100 km and more fly under CW as in their sources; what that costs is said.
    meant = ("graph: ", "is of first order in the distance")
    meant += ("start at the same position",) if name in RESPONSES else ()
    # What small thrusters do to a flight is what some of them show.
    meant += ("its thrusters are saturated at first",) if name in SATURATED else ()
    # A law about a circular chief flies beside one that knows the eccentricity, or about an orbit that is
    # nearly circular, from which its mean elements differ little.
    meant += (
        ("the CW equations about a circular chief orbit are the model of controller kind",)
        if name in CIRCULAR_LAW
        else ()
    )
    # One of three filters has a model about a circular chief on purpose.
    if name == "eccentric_navigation":
        meant += ("are the model of the filter;", "filter of circular: ", "filter of keplerian: ")
    # Cameras leave distances to the thrust that a plan does not have.
    if name.startswith("bearing_only"):
        meant += ("navigation: sat1, sat2, sat3, sat4: on the planned motion",)
    # The cameras of all but one observer are off.
    if name == "bearing_only_one_observer":
        meant += ("outages: cover all readings of the flight",)
    # Distances that hardly change leave the phase of a triangle, which its scenario says.
    if name == "laser_ranging_triangle":
        meant += ("navigation: sat1, sat2, sat3: on the planned motion",)
    # Ranges to one satellite on a free orbit leave a direction, which no filter can know better.
    if name.startswith("range_only"):
        meant += ("navigation: seeker: on the planned motion",)
    said = [warning for warning in warnings(shipped(name)) if not any(words in warning for words in meant)]
    assert not said


@pytest.mark.unmeasured
@pytest.mark.parametrize("name", NAMES)
def test_the_schema_accepts_the_shipped_scenario_as_an_editor_would(name: str) -> None:
    data = YAML(typ="safe").load((SCENARIOS / f"{name}.yaml").read_text())
    # To an editor a moment is text.
    validator().validate(json.loads(json.dumps(data, default=str)))


def test_the_schema_refuses_what_the_loader_refuses() -> None:
    data = YAML(typ="safe").load((SCENARIOS / "triangle.yaml").read_text())
    for wrong in ({"timing": {"stepp": 1.0}}, {"graph": {"kind": "circle"}}, {"orbit": {"period": -1.0}}):
        assert not validator().is_valid({**data, **wrong})


def test_the_schema_beside_the_scenarios_is_that_of_the_code() -> None:
    kept = (SCENARIOS / "scenario.schema.json").read_text()
    assert kept == json_schema.text(), "run ./tools/satform schema > scenarios/scenario.schema.json"


@pytest.mark.parametrize(
    "character", ["\x7f", "\x85", "\x9f", "\u2028", "\ufeff", "\uffff", "\U0001f6f0", "é"]
)
def test_a_title_of_any_character_is_read_again_from_what_is_kept(character: str) -> None:
    scenario = shipped("triangle").model_copy(update={"title": f"before{character}after"})
    assert parse_scenario(scenario.to_json()).title == scenario.title
