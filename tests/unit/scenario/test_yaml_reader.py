# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""YAML as people and programs write it: anchors, aliases, merge keys, limits, and lines of errors."""

import os
import textwrap
from pathlib import Path

import pytest
import yaml

from satform.scenario import ScenarioError, load_scenario, parse_scenario
from satform.scenario.text_file import MAXIMUM_FILE_BYTES
from satform.scenario.yaml_reader import read_value

ANCHORED = textwrap.dedent(
    """\
    name: base
    title: Two satellites on circles
    text: small
    orbit: {period: 6000.0}
    timing: {step: 1.0, duration: 60.0}
    dynamics: {kind: cw}
    graph: {kind: complete}
    consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
    nominal_motion: {period: 6000.0}
    satellite_defaults:
      controller: {kind: sliding_mode, proportional_gain: 0.01, boundary_layer: 0.1}
    satellites:
      - &first
        name: sat1
        scale: 1.0
        curve: &circle
          kind: circle
          radius: 1000.0
      - <<: *first
        name: sat2
        arc_length: 500.0
      - name: sat3
        curve: *circle
    """
)


def lines_and_fields(text: str) -> list[tuple[int | None, str]]:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text)
    return [(problem.line, problem.field) for problem in caught.value.problems]


def line_with(words: str) -> int:
    return next(number for number, line in enumerate(ANCHORED.splitlines(), 1) if words in line)


def test_aliases_and_merge_keys_mean_what_they_stand_for() -> None:
    # PyYAML reads the anchors and writes the same data without them.
    data = yaml.safe_load(ANCHORED)
    dumper = type("Plain", (yaml.SafeDumper,), {"ignore_aliases": lambda *_: True})
    without = yaml.dump(data, Dumper=dumper)
    assert "*" not in without
    assert parse_scenario(ANCHORED).digest() == parse_scenario(without).digest()
    # What it writes by itself of one object in several places has aliases.
    shared = {"kind": "lqr"}
    for satellite in data["satellites"]:
        satellite["controller"] = shared
    written = yaml.safe_dump(data)
    assert "*id001" in written
    assert parse_scenario(written).digest() == parse_scenario(yaml.dump(data, Dumper=dumper)).digest()


def test_a_setting_changes_one_of_those_that_share_a_part() -> None:
    changed = parse_scenario(ANCHORED, changes=["satellites.sat3.curve.radius=2e3"])
    assert [satellite.curve.radius for satellite in changed.satellites] == [1000.0, 1000.0, 2000.0]


def test_what_is_wrong_in_a_shared_part_has_the_line_on_which_it_stands() -> None:
    line = line_with("radius")
    found = lines_and_fields(ANCHORED.replace("radius: 1000.0", "radius: -1.0"))
    assert found == [(line, f"satellites[{index}].curve.radius") for index in range(3)]
    line = line_with("scale")
    found = lines_and_fields(ANCHORED.replace("scale: 1.0", "scale: large"))
    assert found == [(line, f"satellites[{index}].scale") for index in range(2)]
    # Its own key, not the one that it takes the place of.
    found = lines_and_fields(ANCHORED.replace("name: sat2", "name: Sat2"))
    assert found == [(line_with("name: sat2"), "satellites[1].name")]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0),
        ("1.0e3", 1000.0),
        ("1.0e+3", 1000.0),
        ("-2E-3", -0.002),
        ("7", 7),
        ("[1e-1, 1, .5]", [0.1, 1, 0.5]),
        ("true", True),
        ("off", "off"),
    ],
)
def test_a_value_is_read_by_the_rules_of_yaml_1_2(text: str, value: object) -> None:
    read = read_value(text, "typed")
    assert read == value
    assert type(read) is type(value)


def test_every_form_of_a_path_that_messages_print_names_the_same_field() -> None:
    forms = ("satellites[1].scale", "satellites.1.scale", "satellites[sat2].scale", "satellites.sat2.scale")
    flown = {parse_scenario(ANCHORED, changes=[f"{form}=0.5"]).digest() for form in forms}
    assert len(flown) == 1
    assert flown != {parse_scenario(ANCHORED).digest()}
    with pytest.raises(ScenarioError, match=r"counted from 0 to 2, or by name: sat1, sat2, sat3"):
        parse_scenario(ANCHORED, changes=["satellites.sat9.scale=1.0"])


def refused(path: Path) -> str:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    (problem,) = caught.value.problems
    return problem.sentence


@pytest.mark.unmeasured
def test_what_is_no_regular_file_of_a_scenarios_size_is_refused_at_once(tmp_path: Path) -> None:
    pipe, large = tmp_path / "pipe.yaml", tmp_path / "large.yaml"
    os.mkfifo(pipe)
    assert refused(pipe) == "cannot be read: is a pipe, not a file"
    assert refused(Path("/dev/zero")) == "cannot be read: is a device, not a file"
    assert refused(tmp_path) == "cannot be read: is a folder, not a file"
    size = MAXIMUM_FILE_BYTES + 1
    large.write_bytes(b" " * size)
    assert refused(large) == f"cannot be read: has {size} bytes; a scenario has at most {size - 1}"
    # Its size is known only after reading it.
    many = "".join(f"  - {{name: s{number}}}\n" for number in range(10_001))
    (tmp_path / "many.yaml").write_text(ANCHORED.partition("satellites:")[0] + "satellites:\n" + many)
    assert "has more than the 10000 entries that are allowed" in refused(tmp_path / "many.yaml")
