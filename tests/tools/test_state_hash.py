# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""One flight has one state hash, whoever names it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from bag_writing import first_steps, messages_of, write
from flights import shortened
from satform.flight.simulate import simulate
from satform_tools.cli import main as cli
from satform_tools.report.page.content import provenance
from satform_tools.run.replay import compare
from satform_tools.run.stored_run import find


@pytest.fixture(scope="module")
def scenario():
    return shortened("triangle", 20.0)


@pytest.fixture(scope="module")
def record(scenario):
    return simulate(scenario)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory, scenario, record) -> Path:
    folder = tmp_path_factory.mktemp("run") / "bag"
    write(folder, scenario, messages_of(record))
    return folder


def test_run_report_replay_and_the_files_of_a_flight_name_the_same_hash(
    bag: Path, scenario, record, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    words = ["run", "triangle", "--mode", "inprocess", "--json", "--out", str(out)]
    assert cli.main([*words, "--set", "timing.duration=20.0", "--set", "expect=[]"]) == 0
    run = json.loads(capsys.readouterr().out)
    hashes = {run["state_hash"], json.loads((out / "result.json").read_text())["state_hash"]}
    for kept in (out, bag):
        assert cli.main(["report", str(kept), "--json", "--out", str(tmp_path / "report")]) == 0
        hashes.add(json.loads(capsys.readouterr().out)["state_hash"])
        assert run["state_hash"] in (tmp_path / "report" / "report.html").read_text()
    hashes.add(compare(scenario, record, {}).state_hash)
    assert hashes == {record.digest()}


def test_two_flights_side_by_side_are_told_with_the_hash_of_each(
    bag: Path, record, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["report", str(bag), str(bag), "--json", "--out", str(tmp_path)]) == 0
    assert json.loads(capsys.readouterr().out)["state_hashes"] == [record.digest()] * 2


def test_a_flight_on_the_wall_clock_has_no_hash_and_says_why(bag: Path) -> None:
    kept = replace(find(bag), clocked=True)
    assert kept.state_hash == ""
    rows = dict(provenance([kept]).rows)
    assert rows["state hash"] == "none: runs against the wall clock are not bitwise reproducible"


def test_a_part_of_a_flight_has_no_hash_and_says_why(tmp_path: Path, scenario, record) -> None:
    write(tmp_path / "bag", scenario, messages_of(first_steps(record, 30)))
    rows = dict(provenance([find(tmp_path / "bag")]).rows)
    assert rows["state hash"] == "none: cut short at step 30 of 40"
    assert compare(scenario, first_steps(record, 30), {}).state_hash is None
