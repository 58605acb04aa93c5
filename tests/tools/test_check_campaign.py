# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `check` on campaign files: errors with their lines, warnings, shipped ones by name."""

import json
from pathlib import Path

import pytest

from satform_tools.cli import main as cli

UNWISE = """\
name: unwise
scenario: triangle
runs: 1000
sampling: {kind: sobol}
dispersions:
  - path: satellites[1].scale
    distribution: {kind: normal, mean: 0.75, standard_deviation: 0.25}
  - path: node_timeout
    distribution: {kind: uniform, low: 5.0, high: 10.0}
  - path: orbit.period
    distribution: {kind: choice, values: [6000.0]}
"""


def written(folder: Path, text: str) -> str:
    file = folder / "study.yaml"
    file.write_text(text)
    return str(file)


def test_check_warns_of_values_that_cannot_fly_and_dispersions_without_effect(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path, UNWISE)
    assert cli.main(["check", file]) == 0
    *warnings, end = capsys.readouterr().out.splitlines()
    assert end == f"{file}: OK"
    beginnings = [
        f"{file}:6: warning: dispersions[0]: some cases cannot fly: a case, satellites[1].scale = -",
        f"{file}:8: warning: dispersions[1]: node_timeout changes nothing of what is flown",
        f"{file}:10: warning: dispersions[2]: orbit.period has the same value in all cases",
        f"{file}:3: warning: runs: 1000 runs of a Sobol sequence are less evenly spread than a power of two, "
        "such as 1024",
    ]
    assert len(warnings) == len(beginnings)
    assert all(found.startswith(begin) for found, begin in zip(warnings, beginnings, strict=True))


def test_check_prints_all_errors_of_a_campaign_with_their_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = UNWISE.replace("satellites[1].scale", "satellites[1].scal").replace("high: 10.0", "high: 1.0")
    file = written(tmp_path, wrong)
    assert cli.main(["check", file, "triangle"]) == 2
    captured = capsys.readouterr()
    assert (
        f"{file}:6: dispersions[0].path: there is no satellites[1].scal; did you mean scale?" in captured.err
    )
    assert f"{file}:9: dispersions[1].distribution: low 5 is above high 1" in captured.err
    assert captured.out.endswith("triangle: OK\n")


def test_check_prints_json_of_a_campaign(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path, UNWISE)
    assert cli.main(["check", file, "--json"]) == 0
    [found] = json.loads(capsys.readouterr().out)
    assert (found["file"], found["ok"], found["problems"]) == (file, True, [])
    assert found["warnings"][1] == "dispersions[1]: node_timeout changes nothing of what is flown"


def test_a_path_of_a_scenario_is_checked_as_a_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", "triangle", "triangle_dispersed"]) == 0
    *_, scenario, campaign = capsys.readouterr().out.splitlines()
    assert (scenario, campaign) == ("triangle: OK", "triangle_dispersed: OK")


def test_the_schema_of_campaigns_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["schema", "--campaign"]) == 0
    assert "dispersions" in json.loads(capsys.readouterr().out)["properties"]


DECIDED = [
    ("kind: success_rate, above: 0.0", "cannot be missed: it is met if no case succeeds, and if all do"),
    ("kind: success_rate, below: 1.0", "cannot be missed: it is met if no case succeeds, and if all do"),
    (
        "kind: success_rate, above: 0.95",
        "cannot be met with 20 cases: if all succeed, the lower limit of the 95 % interval is 0.8389; use "
        "more runs, or compare: estimate",
    ),
    (
        "kind: success_rate, below: 0.1",
        "cannot be met with 20 cases: if none succeeds, the upper limit of the 95 % interval is 0.1611; use "
        "more runs, or compare: estimate",
    ),
    (
        "kind: percentile, figure: dv, percentile: 95, below: 3.0, compare: interval",
        "cannot be met: 20 cases are too few for its interval",
    ),
    ("kind: success_rate, above: 0.95, compare: estimate", None),
    ("kind: success_rate, above: 0.8", None),
    ("kind: success_rate, below: 0.2", None),
    ("kind: percentile, figure: dv, percentile: 50, below: 3.0, compare: interval", None),
    ("kind: percentile, figure: dv, percentile: 95, below: 3.0", None),
    ("kind: mean, figure: dv, above: 1.0, below: 2.0, compare: interval", None),
]


@pytest.mark.parametrize(("expectation", "sentence"), DECIDED)
def test_check_warns_of_expectations_that_no_flight_can_decide(
    expectation: str, sentence: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (
        "scenario: triangle\nruns: 20\nset: {timing.duration: 60.0, expect: []}\n"
        "figures: [{name: dv, measure: {kind: delta_v}}]\n"
        f"expect:\n  - {{{expectation}, source: a test}}\n"
    )
    file = written(tmp_path, text)
    assert cli.main(["check", file]) == 0
    *warnings, _ = capsys.readouterr().out.splitlines()
    assert warnings == ([] if sentence is None else [f"{file}:6: warning: expect[0]: {sentence}"])


@pytest.mark.parametrize("command", [["check"], ["campaign", "run"], ["run"]])
def test_a_name_that_no_file_can_have_gets_a_sentence(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    name, what = "n" * 300, "campaign" if command[0] == "campaign" else "scenario"
    assert cli.main([*command, name]) == 2
    assert f"there is no {what} '{name}'" in capsys.readouterr().err
