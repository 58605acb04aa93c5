# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A wrong campaign file gets a sentence for everything that is wrong, with file and line."""

import json
from pathlib import Path
from typing import Any

import pytest

from flights import SCENARIOS
from satform.campaign.campaign_file import is_campaign
from satform.campaign.loader import load_campaign, parse_campaign, save_campaign
from satform.campaign.model import Campaign
from satform.campaign.scenario_file import CampaignSource
from satform.scenario import ScenarioError

HEAD = "name: study\nscenario: triangle\nruns: 10\n"
DISPERSED = HEAD + "dispersions:\n"
PATH = "  - path: {path}\n    distribution: {{kind: normal, standard_deviation: 1.0}}\n"


def loaded(text: str) -> Campaign:
    return parse_campaign(text, "study.yaml", CampaignSource(SCENARIOS))


def problems(text: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        loaded(text)
    return [str(problem) for problem in caught.value.problems]


def one(path: str, **fields: Any) -> str:
    return DISPERSED + f"  - {json.dumps({'path': path, **fields})}\n"


NORMAL = {"distribution": {"kind": "normal", "standard_deviation": 1.0}}
FROM_A_TO_B = {"distribution": {"kind": "choice", "values": ["a", "b"]}}
PAIR = (
    PATH.format(path="orbit.period\n    name: a") + PATH.format(path="satellites[*].arc_length\n    name: b")
).replace("\\n", "\n")

STEPS = HEAD.replace(
    "runs: 10\n",
    "dispersions: [{path: timing.step, grid: {values: [0.5, 1.0]}}]\nkeep: {series: [{quantity: position, ",
).replace("name:", "sampling: {kind: grid}\nname:")

WRONG = [
    (one("satellites[*].position_eror[0]", **NORMAL), 5, "did you mean position_error?"),
    (one("satellites[7].arc_length", **NORMAL), 5, "entries are counted from 0 to 2, or by name: sat1, sat2"),
    (one("satellites[sat9].arc_length", **NORMAL), 5, "there is no satellites.sat9"),
    (one("satellites[*].sensor.latency", **NORMAL), 5, "the scenario has no satellites[0].sensor: give it"),
    (one("satellites[0].position_error", **NORMAL), 5, "such as satellites[0].position_error[0], or [*]"),
    (one("satellites[0].arc_length.more", **NORMAL), 5, "satellites[0].arc_length is a single value"),
    (one("satellites[0].controller", **NORMAL), 5, "holds no single number"),
    (one("timing.duration", **NORMAL), 5, "all cases of a campaign last equally long"),
    (one("faults[*].at", **NORMAL), 5, "means no field: the list is empty"),
    (one("faults[0].at", **NORMAL), 5, "it has no entries"),
    (one("satellites[0].path_parameter", **NORMAL), 5, "holds text: disperse it by a choice"),
    (one("orbit.allow_below_surface", **NORMAL), 5, "holds true or false: disperse it by a choice"),
    (one("orbit.period", **FROM_A_TO_B), 5, 'found "a" among the values; orbit.period holds a number'),
    (one("satellites[0].path_parameter", applied="add", **FROM_A_TO_B), 5, "only numbers can be added to"),
    (
        one("satellites[0].rate", applied="add", **NORMAL),
        5,
        "satellites[0].rate is not given in the scenario",
    ),
    (one("satellites[0].arc_length", applied="scale", **NORMAL), 5, "is 0 in the scenario, and so is every"),
    (
        one("orbit.period", distribution={"kind": "normal", "standard_deviation": "3 deg"}),
        5,
        "found '3 deg' among the values; orbit.period holds no angle",
    ),
    (
        one("orbit.mean_motion", distribution={"kind": "uniform", "low": "3 deg", "high": "4 deg/s"}),
        5,
        "found '3 deg' among the values; orbit.mean_motion holds a rate in rad/s",
    ),
    (one("orbit.period"), 5, "give exactly one of distribution and grid"),
    (one("orbit.period", grid={"values": [1.0, 2.0]}), 5, "goes through no grid"),
    (one("orbit.period", grid={"first": 1.0, "last": 2.0}), 5, "need first, last and count"),
    (one("orbit.period", grid={}), 5, "give either values, or first, last and count"),
    (
        one("orbit.period", grid={"first": 0.0, "last": 2.0, "count": 3, "spacing": "logarithmic"}),
        5,
        "of the same sign, neither zero",
    ),
    (
        DISPERSED + PATH.format(path="orbit.period") * 2,
        7,
        "orbit.period is dispersed by orbit.period already",
    ),
    (
        DISPERSED
        + PATH.format(path="satellites[*].arc_length")
        + PATH.format(path="satellites[sat2].arc_length"),
        7,
        "satellites[1].arc_length is dispersed by satellites[*].arc_length already",
    ),
    (HEAD.replace("runs: 10\n", ""), 1, "the sampling monte_carlo needs a number of cases"),
    (HEAD + "sampling: {kind: grid}\n", 4, "no dispersion has a grid"),
    (
        HEAD + "sampling: {kind: one_at_a_time}\ndispersions:\n" + PATH.format(path="orbit.period"),
        3,
        "has 3 cases, as many as its values make: leave runs out",
    ),
    (
        HEAD.replace("10", "10000000")
        + "sampling: {kind: latin_hypercube}\ndispersions:\n"
        + PATH.format(path="satellites[*].position_error[*]"),
        4,
        "at most 50000000 are held in memory",
    ),
    (
        HEAD.replace("runs: 10\n", "sampling: {kind: grid}\n")
        + "dispersions: [{path: orbit.period, grid: {values: [5e+3, 6e+3]}}]\n"
        + "expect:\n  - {kind: success_rate, above: 0.5}\n"
        + "  - {kind: success_rate, above: 0.5, compare: interval}\n",
        7,
        "the sampling grid draws no cases at random and has no interval: use estimate",
    ),
    (HEAD + "sampling: {kind: sobl}\n", 4, "did you mean sobol?"),
    (HEAD + "set: {timing.stp: 1.0}\n", 4, "there is no such field; did you mean step?"),
    (HEAD + "set:\n  satellites[9].scale: 1.0\n", 5, "entries are counted from 0 to 2"),
    (HEAD + "figures:\n  - {name: dv, measure: {kind: delta_w}}\n", 5, "did you mean delta_v?"),
    (HEAD + "figures:\n  - {name: dv, measure: {kind: delta_v, below: 3}}\n", 5, "a figure has no below"),
    (
        HEAD + "figures:\n  - {name: dv, measure: {kind: delta_v, satellites: [a]}}\n",
        5,
        "there is no satellite a",
    ),
    (
        HEAD + "figures:\n  - {name: dv, measure: {kind: delta_v_per_orbit, before: 50.0}}\n",
        5,
        "less than one revolution of 6000 s",
    ),
    (
        HEAD + "figures:\n  - {name: margin, measure: {kind: link_margin}}\n",
        5,
        "no edge of the graph between the satellites that are meant has a radio or optical channel",
    ),
    (
        HEAD.replace("triangle", "patrol_drift")
        + "figures:\n  - {name: light, measure: {kind: pass_light_angle, satellites: [watcher, target1], "
        + "chief_longitude: 1.0, epoch: 2001-01-01}}\n",
        5,
        "the truth model's epoch is",
    ),
    (
        HEAD + "figures:\n" + "  - {name: dv, measure: {kind: delta_v}}\n" * 2,
        5,
        "another figure has this name",
    ),
    (
        HEAD + "expect:\n  - {kind: mean, figure: dv, below: 1}\n",
        5,
        "there is no figure 'dv'; there are arc-",
    ),
    (HEAD + "expect:\n  - {kind: success_rate, above: 1.5}\n", 5, "less than or equal to 1"),
    (
        HEAD + "expect:\n  - {kind: success_rate, above: 0.5}\n",
        5,
        "expect[0]: nothing says where the bounds come from: give a source",
    ),
    (
        HEAD + "expect:\n  - {kind: success_rate, above: 0.5, source: a test, regression: true}\n",
        5,
        "bounds have a source or follow what this software gave, not both",
    ),
    (HEAD + "keep: {series: [{quantity: positon}]}\n", 4, "did you mean position?"),
    (
        HEAD + "keep: {series: [{quantity: position, every: 0.7}]}\n",
        4,
        "not a whole number of steps of 0.5 s",
    ),
    (HEAD + "keep: {series: [{quantity: position, every: 1e6}]}\n", 4, "is longer than the flight"),
    (STEPS + "every: 0.75}]}\n", 5, "is not a whole number of steps of 0.5 s"),
    (STEPS + "every: 1.5}]}\n", 5, "only if `every` is a whole number of each step"),
    (STEPS + "}]}\n", 5, "only if `every` is a whole number of each step"),
    (
        HEAD
        + "keep: {series: [{quantity: position, every: 60}]}\ndispersions:\n"
        + PATH.format(path="timing.step"),
        4,
        "replace the step by listed values",
    ),
    (
        HEAD + "set: {timing.duration: 1.0e+6, timing.step: 0.1}\nkeep: {series: [{quantity: position}]}\n",
        5,
        "the series of one case take 720 MB, and at most 256 MB are allowed: give them a longer every",
    ),
    (HEAD + "keep: {record: sometimes}\n", 4, "allowed: never, on_failure, always"),
    (HEAD + "correlated:\n  - {of: [a, b], matrix: [[1, 0], [0, 1]]}\n", 5, "there is no dispersion a"),
    (HEAD + "correlated:\n  - {of: [a, b], matrix: [[1, 2], [2, 1]]}\n", 5, "less than or equal to 1"),
    (HEAD + "correlated:\n  - {of: [a, b], matrix: [[1, 0.5], [0.4, 1]]}\n", 5, "is not symmetric"),
    (HEAD + "correlated:\n  - {of: [a, b], matrix: [[1, 0.5], [0.5, 0.9]]}\n", 5, "on the matrix's diagonal"),
    (HEAD + "correlated:\n  - {of: [a, b], matrix: [[1, 0.5]]}\n", 5, "has 2 rows of 2 numbers"),
    (HEAD + "correlated:\n  - {of: [a, a], matrix: [[1, 0], [0, 1]]}\n", 5, "a dispersion is named twice"),
    (
        HEAD + "correlated:\n  - {of: [a, b, c], matrix: [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]}\n",
        5,
        "is not positive definite",
    ),
    (DISPERSED + PAIR + "correlated:\n  - {of: [a, b], matrix: [[1, 0], [0, 1]]}\n", 12, "a has 1, b has 3"),
    (HEAD.replace("triangle", "tringle"), 2, "there is no scenario 'tringle'"),
    (HEAD.replace("triangle", "n" * 300), 2, f"there is no scenario '{'n' * 300}'"),
    (HEAD.replace("triangle", "none.yaml"), None, "cannot be read: No such file"),
    (HEAD + "seeds: 3\n", 4, "there is no such field; did you mean seed?"),
    ("- a\n", 1, "a campaign is a mapping of fields"),
    ("a: [\n", 2, "is not YAML"),
    (HEAD + "seed: true\n", 4, "it should be a number"),
]


@pytest.mark.parametrize(("text", "line", "sentence"), WRONG, ids=[entry[2][:80] for entry in WRONG])
def test_what_is_wrong_is_said_with_its_line(text: str, line: int | None, sentence: str) -> None:
    found = problems(text)
    assert any(sentence in problem for problem in found), found
    if line is not None:
        assert any(problem.startswith(f"study.yaml:{line}: ") and sentence in problem for problem in found), (
            found
        )


def test_series_are_kept_of_cases_whose_steps_divide_their_times() -> None:
    assert loaded(STEPS + "every: 2.0}]}\n").cases == 2


def test_everything_wrong_is_found_at_once() -> None:
    text = (
        "name: Study\nscenario: triangle\nruns: 0\ndispersions:\n"
        + PATH.format(path="satellites[*].position_eror[0]")
        + "expect:\n  - {kind: success_rate}\n"
    )
    found = problems(text)
    assert [problem.split(": ")[0] for problem in found] == [f"study.yaml:{line}" for line in (1, 3, 5, 8)]


def test_an_error_of_the_scenario_has_its_place_there(tmp_path: Path) -> None:
    (tmp_path / "broken.yaml").write_text(
        (SCENARIOS / "triangle.yaml").read_text().replace("kind: cw", "kind: cv")
    )
    (tmp_path / "study.yaml").write_text("name: Study\nscenario: broken\nruns: 10\n")
    with pytest.raises(ScenarioError) as caught:
        load_campaign(tmp_path / "study.yaml")
    own, others = caught.value.problems
    assert (own.file, own.line, own.field) == (str(tmp_path / "study.yaml"), 1, "name")
    assert others.file.endswith("broken.yaml")
    assert "there is no kind 'cv'; allowed: cw" in others.sentence


@pytest.mark.parametrize(
    ("scenario", "sentence"),
    [
        ("none.yaml", "{folder}/none.yaml: cannot be read: No such file or directory"),
        ("other.yaml", "{folder}/other.yaml is a campaign itself; name the scenario that it disperses"),
        ("study.yaml", "{folder}/study.yaml is a campaign itself; name the scenario that it disperses"),
    ],
)
def test_a_file_that_is_no_scenario_gets_one_sentence_at_the_field_that_names_it(
    scenario: str, sentence: str, tmp_path: Path
) -> None:
    (tmp_path / "other.yaml").write_text(HEAD)
    file = tmp_path / "study.yaml"
    file.write_text(f"name: study\nscenario: {scenario}\nruns: 10\nset: {{timing.duration: 60.0}}\n")
    with pytest.raises(ScenarioError) as caught:
        load_campaign(file)
    [problem] = caught.value.problems
    assert str(problem) == f"{file}:2: scenario: {sentence.format(folder=tmp_path)}"


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("none.yaml", "cannot be read: No such file"),
        ("no\0ne.yaml", "is not a possible file name"),
        ("n" * 300, "cannot be read: File name too long"),
    ],
    ids=["none", "null character", "long"],
)
def test_a_file_that_cannot_be_there_is_said(name: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=sentence):
        load_campaign(tmp_path / name)
    assert not is_campaign(tmp_path / name)


def test_a_campaign_is_written_and_read_again_with_its_scenario_and_files(tmp_path: Path) -> None:
    text = "scenario: attitude_cape_canaveral\nruns: 3\nset: {timing.duration: 600.0, expect: []}\n"
    first = loaded("name: study\n" + text)
    again = load_campaign(save_campaign(first, tmp_path))
    assert again.digest == first.digest
    assert again.base == first.base


def test_the_digest_follows_content_and_scenario_but_no_words() -> None:
    base = loaded(DISPERSED + PATH.format(path="orbit.period"))
    same = loaded(DISPERSED + PATH.format(path="orbit.period") + "title: another\ntext: words\n")
    assert base.digest == same.digest
    rate = "expect: [{kind: success_rate, above: 0.5, "
    digests = {
        loaded(HEAD + rate + origin).digest for origin in ("source: a}]", "source: b}]", "regression: true}]")
    }
    assert len(digests) == 1
    assert loaded(HEAD).digest not in digests
    others = [
        loaded(HEAD),
        loaded((DISPERSED + PATH.format(path="orbit.period")).replace("runs: 10", "runs: 11")),
        loaded((DISPERSED + PATH.format(path="orbit.period")).replace("triangle", "triangle_inertial")),
        loaded(DISPERSED + PATH.format(path="orbit.period") + "set: {timing.duration: 6000.0}\n"),
        loaded((DISPERSED + PATH.format(path="orbit.period")).replace("1.0}", "1.5}")),
    ]
    assert len({base.digest, *(other.digest for other in others)}) == 6
