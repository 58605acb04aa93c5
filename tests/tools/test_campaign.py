# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns from the command line: flown and judged, their cases, and what is refused."""

import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from campaigns import SHIPPED
from satform.campaign.cases import case_scenario, changed_scenario
from satform.campaign.distributions import UniformSpec
from satform.campaign.loader import load_campaign
from satform.campaign.software import software
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_MISSED
from satform.flight.simulate import simulate
from satform_tools.cli import main as cli
from small_campaign import campaign_command, campaign_summary, write_campaign


@pytest.mark.parametrize("workers", [1, 3])
def test_the_hash_over_all_results_is_that_of_cases_flown_one_by_one_for_any_number_of_workers(
    workers: int, file: Path, tmp_path: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = campaign_summary(capsys, "run", file, "--out", tmp_path / "out", "--workers", str(workers))
    assert found["results_hash"] == wanted
    assert (found["cases"], found["flown"], found["complete"], found["exit_code"]) == (12, 12, True, 0)
    assert 0 < found["succeeded"] < 12
    assert found["success_rate"]["estimate"] == found["succeeded"] / 12
    again = campaign_summary(capsys, "report", tmp_path / "out")
    assert {**found, "speed": None} == again


def test_a_missed_expectation_is_exit_code_1_in_the_output_and_in_junit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write_campaign(tmp_path, above=1.0)
    words = ("run", file, "--out", tmp_path / "out", "--workers", "1", "--junit", tmp_path / "junit.xml")
    code, out, _ = campaign_command(capsys, *words)
    assert code == EXIT_MISSED
    assert "MISSED: 1 of 1." in out
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()  # noqa: S314 - our own
    flights, *_ = suite.findall("testcase")
    assert (flights.get("name"), len(flights)) == ("all cases are flown", 0)
    (failed,) = suite.findall("testcase[failure]")
    assert failed.get("name") == "success rate"
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    skipped = suite.findall("testcase[skipped]")
    assert len(skipped) == found["failed"] == int(suite.get("skipped") or 0)
    assert (suite.get("failures"), suite.get("tests")) == ("1", str(found["failed"] + 2))
    number = found["failures"][0]["number"]
    assert skipped[0].findtext("skipped") == f"satform run --campaign {tmp_path}/out --case {number}"


def test_a_case_shows_its_values_and_its_run_has_the_bits_of_the_campaign(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    campaign = load_campaign(file)
    code, out, _ = campaign_command(capsys, "case", file, "3")
    assert code == EXIT_DONE
    assert "satellites[0].arc_length" in out
    assert "seed" in out
    case = campaign_summary(capsys, "case", file, "3")
    assert set(case["changes"]) == {f"satellites[{index}].arc_length" for index in range(3)} | {"seed"}
    assert abs(case["changes"]["satellites[0].arc_length"] - campaign.base.satellites[0].arc_length) < 15e3
    run = ["run", "--campaign", str(file), "--case", "3", "--mode", "inprocess", "--json"]
    code = cli.main([*run, "--out", str(tmp_path / "run")])
    flown = json.loads(capsys.readouterr().out)
    assert flown["state_hash"] == simulate(case_scenario(campaign, 3)).digest()
    assert code == flown["exit_code"] == (EXIT_DONE if flown["expectations"][0]["met"] else EXIT_MISSED)
    assert json.loads((tmp_path / "run" / "case.json").read_text())["changes"] == case["changes"]
    words = ("case", file, "3", "--fly", "--mode", "inprocess", "--out", tmp_path / "fly")
    assert campaign_summary(capsys, *words)["state_hash"] == flown["state_hash"]


def test_a_case_of_a_folder_has_the_values_that_are_stored_there(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    assert campaign_command(capsys, "run", file, "--out", out, "--workers", "1")[0] == EXIT_DONE
    computed = json_and_notes(capsys, "campaign", "case", file, "3", "--json")
    stored = json_and_notes(capsys, "campaign", "case", out, "3", "--json")
    assert stored[0]["changes"] == computed[0]["changes"]
    assert stored[1] == computed[1] == ""

    value = UniformSpec.value
    monkeypatch.setattr(
        UniformSpec, "value", lambda spec, quantile: math.nextafter(value(spec, quantile), math.inf)
    )
    other = f"case 3: 3 of 4 values are computed otherwise on this machine; those stored in {out} are used"
    found, notes = json_and_notes(capsys, "campaign", "case", out, "3", "--json")
    assert found["changes"] == stored[0]["changes"]
    assert notes.strip() == other
    assert json_and_notes(capsys, "campaign", "case", file, "3", "--json")[0]["changes"] != found["changes"]

    monkeypatch.setattr("satform.campaign.folder.software", lambda: {**software(), "arithmetic": "another"})
    run = ("run", "--campaign", out, "--case", "3", "--mode", "inprocess", "--json")
    flown, notes = json_and_notes(capsys, *run, "--out", tmp_path / "run")
    assert other in notes
    assert f"{out}: its results are of other software (arithmetic " in notes
    scenario = changed_scenario(load_campaign(file), stored[0]["changes"], "case 3")
    assert flown["state_hash"] == simulate(scenario).digest()
    assert json.loads((tmp_path / "run" / "case.json").read_text())["changes"] == found["changes"]

    for path in (out / "results").iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    code, _, err = campaign_command(capsys, "case", out, "3")
    assert code == EXIT_BAD_INPUT
    assert "is damaged: its content does not have the digest in its name" in err


def json_and_notes(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[Any, str]:
    """What a command that succeeds prints to standard output, as JSON, and to standard error."""
    code = cli.main([str(word) for word in words])
    found = capsys.readouterr()
    assert code in {EXIT_DONE, EXIT_MISSED}, found.err
    return json.loads(found.out), found.err


def test_records_of_failed_cases_are_runs_that_report_opens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write_campaign(tmp_path, more="keep: {record: on_failure}")
    found = campaign_summary(capsys, "run", file, "--out", tmp_path / "out", "--workers", "2")
    folders = sorted(path.name for path in (tmp_path / "out" / "records").iterdir())
    assert folders == [f"case-{failure['number']:08d}" for failure in found["failures"]]
    first = found["failures"][0]
    record = tmp_path / "out" / first["record"]
    assert cli.main(["report", str(record), "--json", "--out", str(tmp_path / "report")]) == 0
    reported = json.loads(capsys.readouterr().out)
    scenario = case_scenario(load_campaign(file), first["number"])
    assert reported["state_hash"] == simulate(scenario).digest()


def test_what_cannot_be_used_is_exit_code_2_and_a_sentence(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty").mkdir()
    sentences = {
        ("run", "no_such_campaign"): "there is no campaign 'no_such_campaign'",
        ("run", tmp_path / "none.yaml"): "none.yaml: cannot be read",
        ("run", file, "--engine", "dask"): "--engine dask needs --scheduler ADDRESS",
        ("run", file, "--scheduler", "tcp://h:1"): "--scheduler is for --engine dask",
        ("run", file, "--engine", "dask", "--scheduler", "h:1", "--workers", "2"): "--workers is for",
        ("resume", tmp_path / "empty"): "is not the folder of a campaign",
        ("resume", file): "was started from",
        ("report", tmp_path / "none"): "there is no such folder",
        ("case", file, "12"): "there is no case 12: small has cases 0 to 11",
        ("case", file, "1", "--out", tmp_path / "x"): "--out is for --fly",
    }
    for words, sentence in sentences.items():
        code, out, err = campaign_command(capsys, *words)
        assert (code, out) == (EXIT_BAD_INPUT, ""), words
        assert sentence in err
        assert "Traceback" not in err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "name a SCENARIO to fly, or a case"),
        (["--campaign", "x"], "--campaign and --case belong together"),
        (["--case", "1"], "--campaign and --case belong together"),
        (["triangle", "--campaign", "x", "--case", "1"], "not both"),
        (["--campaign", "x", "--case", "1", "--seed", "3"], "--set and --seed are for scenarios"),
        (["--campaign", "x", "--case", "1", "--set", "seed=3"], "--set and --seed are for scenarios"),
    ],
)
def test_run_takes_either_a_scenario_or_a_case(
    words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["run", *words, "--mode", "inprocess"]) == EXIT_BAD_INPUT
    assert sentence in capsys.readouterr().err


def test_shipped_campaigns_are_found_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    for shipped in SHIPPED:
        assert campaign_summary(capsys, "case", shipped, "0")["changes"]
