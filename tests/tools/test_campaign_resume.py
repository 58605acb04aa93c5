# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Folders of campaigns: each holds one campaign, which is resumed and repaired in it."""

import json
import os
import shutil
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from satform.campaign.chunk import fly_chunk
from satform.campaign.folder import CampaignFolder, locked
from satform.campaign.loader import load_campaign
from satform.campaign.result_files import result_files, write_results
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_LOST
from satform_tools.cli import main as cli
from satform_tools.run import output_folders
from small_campaign import campaign_command, campaign_summary, write_campaign


def test_a_case_of_a_folder_whose_copy_of_the_scenario_was_changed_is_refused(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    CampaignFolder.create(out, load_campaign(file), file, "2026-01-01T00:00:00+00:00")
    assert cli.main(["campaign", "case", str(out), "1"]) == EXIT_DONE
    copy = out / "scenario.json"
    data = json.loads(copy.read_text())
    data["orbit"]["period"] += 1.0
    copy.write_text(json.dumps(data))
    capsys.readouterr()
    run = [
        "run",
        "--campaign",
        str(out),
        "--case",
        "1",
        "--mode",
        "inprocess",
        "--out",
        str(tmp_path / "run"),
    ]
    for words in (["campaign", "case", str(out), "1"], run):
        assert cli.main(words) == EXIT_BAD_INPUT
        error = capsys.readouterr().err
        assert "the campaign or its scenario is not the one that was started in" in error
        assert len(error.splitlines()) == 1
    assert not (tmp_path / "run").exists()


def stored(out: Path, file: Path, *numbers: Sequence[int]) -> Path:
    """The folder of a campaign whose cases with some numbers were flown in this process, by file."""
    out.mkdir()
    campaign = load_campaign(file)
    manifest = CampaignFolder.create(out, campaign, file, "2026-01-01T00:00:00+00:00").manifest
    for some in numbers:
        results = [manifest.columns.complete(result) for result in fly_chunk(campaign, some)]
        write_results(out, results, manifest.schema)
    return out


def test_results_of_another_campaign_in_a_folder_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write_campaign(tmp_path, runs=2)
    for out, seed in (("first", "seed: 7"), ("second", "seed: 8")):
        file.write_text(file.read_text().replace("seed: 7", seed))
        stored(tmp_path / out, file, [0, 1])
    [other] = (tmp_path / "second" / "results").iterdir()
    [own] = (tmp_path / "first" / "results").iterdir()
    own.unlink()
    shutil.copy(other, own.parent)
    capsys.readouterr()
    assert cli.main(["campaign", "resume", "--stored", str(tmp_path / "first")]) == EXIT_BAD_INPUT
    error = capsys.readouterr().err
    assert f"{own.parent / other.name}: is of another campaign: it has the digest" in error
    assert len(error.splitlines()) == 1
    assert (
        cli.main(["campaign", "resume", "--stored", str(tmp_path / "first"), "--repair", "--workers", "1"])
        == EXIT_DONE
    )
    assert (tmp_path / "first" / "damaged" / other.name).exists()


def test_two_campaigns_do_not_share_a_folder(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert campaign_command(capsys, "run", file, "--out", out, "--workers", "1")[0] == EXIT_DONE
    before = sorted(out.rglob("*"))
    code, _, err = campaign_command(capsys, "run", file, "--out", out)
    assert code == EXIT_BAD_INPUT
    assert f"{out} already holds the campaign small: go on with satform campaign resume {out}" in err
    assert sorted(out.rglob("*")) == before
    with locked(out):
        code, _, err = campaign_command(capsys, "resume", out)
    assert code == EXIT_BAD_INPUT
    assert f"process {os.getpid()} is flying a campaign in this folder" in err


@pytest.mark.parametrize("moment", ["locked", "done"])
def test_of_two_runs_that_find_the_same_folder_empty_one_is_refused_and_changes_nothing(
    moment: str, file: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    out, make = tmp_path / "out", output_folders.make

    def overtaken(*given: Any) -> Path:
        """Another process comes first once this one has found the folder empty."""
        path = make(*given)
        with locked(path):
            CampaignFolder.create(path, load_campaign(file), file, "2026-01-01T00:00:00+00:00")
        if moment == "locked":
            others.enter_context(locked(path))
        return path

    with ExitStack() as others:
        monkeypatch.setattr(output_folders, "make", overtaken)
        code, _, err = campaign_command(capsys, "run", file, "--out", out, "--workers", "1")
    assert code == EXIT_BAD_INPUT
    expected = {"locked": "is flying a campaign in this folder", "done": "is not an empty folder"}
    assert f"{out}: " in err
    assert expected[moment] in err
    assert len(err.splitlines()) == 1
    assert CampaignFolder.open(out).manifest.started == "2026-01-01T00:00:00+00:00"
    assert not (out / "results").exists()


@pytest.fixture
def half_done(file: Path, tmp_path: Path) -> Path:
    """The folder of a campaign of which about half of the cases have results."""
    return stored(tmp_path / "half", file, [0, 1], [3, 4, 9])


def test_a_resumed_campaign_flies_what_is_missing_and_has_the_same_hash(
    half_done: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    partial = campaign_summary(capsys, "report", half_done)
    assert (partial["flown"], partial["results_hash"], partial["exit_code"]) == (5, None, EXIT_LOST)
    found = campaign_summary(capsys, "resume", half_done, "--workers", "2")
    assert (found["results_hash"], found["speed"]["cases"]) == (wanted, 7)
    assert campaign_summary(capsys, "resume", half_done)["results_hash"] == wanted


def test_a_campaign_is_resumed_by_its_file_from_the_newest_folder(
    file: Path, tmp_path: Path, half_done: Path, wanted: str,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    (tmp_path / "runs").mkdir()
    half_done.rename(tmp_path / "runs" / "small-1")
    monkeypatch.chdir(tmp_path)
    assert campaign_summary(capsys, "resume", file, "--workers", "1")["results_hash"] == wanted


@pytest.mark.parametrize("changed", ["small.yaml", "triangle.yaml"])
def test_a_changed_campaign_or_scenario_is_not_resumed_unless_the_stored_one_is_meant(
    changed: str, half_done: Path, tmp_path: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (tmp_path / changed).read_text()
    old, new = ("seed: 7", "seed: 8") if changed == "small.yaml" else ("period: 6000.0", "period: 6001.0")
    (tmp_path / changed).write_text(text.replace(old, new))
    code, _, err = campaign_command(capsys, "resume", half_done)
    assert code == EXIT_BAD_INPUT
    assert "the campaign or its scenario is not the one that was started" in err
    assert "--stored goes on with the copy in the folder" in err
    assert (
        campaign_summary(capsys, "resume", half_done, "--stored", "--workers", "1")["results_hash"] == wanted
    )


def test_a_damaged_file_of_results_is_named_and_a_repair_flies_its_cases_again(
    half_done: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged = result_files(half_done)[1].path
    content = bytearray(damaged.read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    for words in (("resume", half_done), ("report", half_done)):
        code, _, err = campaign_command(capsys, *words)
        assert code == EXIT_BAD_INPUT
        assert f"{damaged}: is damaged" in err
        assert f"satform campaign resume {half_done} --repair" in err
    assert (
        campaign_summary(capsys, "resume", half_done, "--repair", "--workers", "1")["results_hash"] == wanted
    )
    assert (half_done / "damaged" / damaged.name).exists()


def test_cases_that_do_not_end_in_time_are_lost_and_are_flown_again_when_that_is_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = write_campaign(tmp_path, runs=2, duration=3000.0)
    words = ("run", slow, "--out", tmp_path / "out", "--workers", "1", "--timeout", "0.1")
    found = campaign_summary(capsys, *words)
    assert found["lost"] == found["failed"] == found["flown"] == 2
    assert found["results_hash"] is None
    assert found["reasons"] == {"timeout: not flown within ... s of wall-clock time": 2}
    assert campaign_summary(capsys, "resume", tmp_path / "out")["lost"] == 2
    again = campaign_summary(capsys, "resume", tmp_path / "out", "--retry", "--workers", "1")
    assert (again["lost"], again["flown"]) == (0, 2)
