# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Degrees where radians are asked: as text with the unit, in every field whose description asks for rad."""

import json
import math
import re

import jsonschema
import pytest

from satform.common.spec import field_description, specs
from satform.scenario import ScenarioError, parse_scenario
from satform_tools.describe import json_schema
from satform_tools.describe.field_text import GROUPS, type_text

ORBIT = """
name: angled
title: t
text: t
orbit: {mean_motion: MOTION}
timing: {step: 1.0, duration: 10.0}
dynamics:
  kind: cw
  perturbations: [{kind: harmonic, amplitude: 1.0e-6, phase: PHASE, phase_step: STEP}]
graph: {kind: none}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {rate: 0.0}
satellite_defaults:
  controller: {kind: lqr}
satellites: [{name: sat1, curve: {kind: fixed_point, position: [0.0, 10.0, 0.0]}}]
"""


def text(motion: str = "1.0e-3", phase: str = "0.0", step: str = "0.0") -> str:
    return ORBIT.replace("MOTION", motion).replace("PHASE", phase).replace("STEP", step)


def test_degrees_mean_the_radians_that_they_are() -> None:
    written = parse_scenario(text("0.06 deg/s", "90 deg", "-4.5e1deg"))
    assert written.orbit.rate == math.radians(0.06)
    assert math.isclose(written.orbit.rate, 0.06 * math.pi / 180.0, rel_tol=1e-15)
    (harmonic,) = written.dynamics.perturbations
    assert harmonic.phase == (math.pi / 2,) * 3
    assert harmonic.phase_step == -math.pi / 4
    plain = text(repr(math.radians(0.06)), repr(math.pi / 2), repr(-math.pi / 4))
    assert parse_scenario(plain).digest() == written.digest()
    assert parse_scenario(written.to_json()).digest() == written.digest()
    assert parse_scenario(text(), changes=["orbit.mean_motion=0.06 deg/s"]).orbit.rate == written.orbit.rate


@pytest.mark.parametrize(
    ("changed", "field", "unit", "example"),
    [
        (text(motion="0.06 deg"), "orbit.mean_motion", "rad/s", "0.06 deg/s"),
        (text(motion="fast"), "orbit.mean_motion", "rad/s", "0.06 deg/s"),
        (text(step="45 degrees"), "dynamics.perturbations[0].phase_step", "rad", "45 deg"),
        (text(step="'45'"), "dynamics.perturbations[0].phase_step", "rad", "45 deg"),
    ],
)
def test_another_text_is_refused_with_the_unit_and_an_example(
    changed: str, field: str, unit: str, example: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(changed)
    (problem,) = caught.value.problems
    assert problem.field == field
    assert problem.sentence.endswith(f'it should be a number of {unit}, or text such as "{example}"')


def test_degrees_out_of_bounds_and_where_no_angle_is_asked_are_refused() -> None:
    with pytest.raises(ScenarioError, match="less than or equal to"):
        parse_scenario(text(motion="1e9 deg/s"))
    with pytest.raises(ScenarioError, match="should be a number"):
        parse_scenario(text().replace("step: 1.0", "step: 1.0 deg"))


def test_the_schema_takes_and_refuses_the_same_texts() -> None:
    validator = jsonschema.Draft202012Validator(json.loads(json_schema.text()))
    data = json.loads(parse_scenario(text()).to_json())
    for motion, fits in (("0.06 deg/s", True), (1e-3, True), ("0.06 deg", False), ("fast", False)):
        data["orbit"] = {"mean_motion": motion}
        assert validator.is_valid(data) == fits, motion


def test_every_scalar_field_that_asks_for_radians_offers_degrees() -> None:
    asks = re.compile(r"\brad(/s)?(?=[.;\]])")
    missing = []
    for group in GROUPS:
        for kind, spec in specs(group).items():
            for name, field in spec.model_fields.items():
                words = type_text(field)
                scalar = words.startswith("number")
                said = field_description(spec, name)
                if scalar and asks.search(said) and "deg" not in words:
                    missing.append(f"{kind}.{name}: {said}")
    assert missing == []
