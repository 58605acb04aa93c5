# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns from the command line: flown, stopped, killed, resumed, and what is refused."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from campaigns import CAMPAIGNS
from flights import SCENARIOS
from satform.campaign.cases import case_scenario
from satform.campaign.chunk import fly_case
from satform.campaign.folder import CampaignFolder, locked
from satform.campaign.folder_repair import damaged_files
from satform.campaign.loader import load_campaign
from satform.campaign.result_files import result_files
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_LOST, EXIT_MISSED, EXIT_STOPPED
from satform.flight.simulate import simulate
from satform_tools.cli import main as cli
from satform_tools.run import output_folders

CAMPAIGN = """
name: small
title: Some short flights
scenario: triangle.yaml
runs: {runs}
seed: 7
set:
  timing.duration: {duration}
  expect: [{{kind: arc_length_spread, at: 4.0, below: 50.0e3, source: a test}}]
dispersions:
  - path: satellites[*].arc_length
    distribution: {{kind: uniform, low: -15.0e3, high: 15.0e3}}
    applied: add
figures: [{{name: effort, measure: {{kind: delta_v}}}}]
expect: [{{kind: success_rate, above: {above}, compare: estimate, source: a test}}]
{more}
"""


def write(folder: Path, *, runs: int = 12, duration: float = 4.0, above: float = 0.0, more: str = "") -> Path:
    """The file of a campaign, with its scenario beside it."""
    shutil.copy(SCENARIOS / "triangle.yaml", folder)
    file = folder / "small.yaml"
    file.write_text(CAMPAIGN.format(runs=runs, duration=duration, above=above, more=more))
    return file


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path)


def command(capsys: pytest.CaptureFixture[str], *words: str | Path) -> tuple[int, str, str]:
    """Exit code, output and errors of `satform campaign`."""
    code = cli.main(["campaign", *map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def summary(capsys: pytest.CaptureFixture[str], *words: str | Path) -> dict[str, Any]:
    _, out, err = command(capsys, *words, "--json")
    assert out, err
    found: dict[str, Any] = json.loads(out)
    return found


@pytest.fixture(scope="module")
def wanted(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The hash over all results of the campaign, flown in this process alone."""
    from satform.campaign.chunk import columns_of, fly_chunk
    from satform.campaign.results import ResultsHash

    campaign = load_campaign(write(tmp_path_factory.mktemp("wanted")))
    found = ResultsHash(columns_of(campaign))
    for result in fly_chunk(campaign, range(12)):
        found.add(columns_of(campaign).complete(result))
    return found.hexdigest()


@pytest.mark.parametrize("workers", [1, 2, 7])
def test_the_hash_over_all_results_is_that_of_cases_flown_one_by_one_for_any_number_of_workers(
    workers: int, file: Path, tmp_path: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = summary(capsys, "run", file, "--out", tmp_path / "out", "--workers", str(workers))
    assert found["results_hash"] == wanted
    assert (found["cases"], found["flown"], found["complete"], found["exit_code"]) == (12, 12, True, 0)
    assert 0 < found["succeeded"] < 12
    assert found["success_rate"]["estimate"] == found["succeeded"] / 12
    again = summary(capsys, "report", tmp_path / "out")
    assert {**found, "speed": None} == again


def test_a_missed_expectation_is_exit_code_1_in_the_output_and_in_junit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path, above=1.0)
    words = ("run", file, "--out", tmp_path / "out", "--workers", "1", "--junit", tmp_path / "junit.xml")
    code, out, _ = command(capsys, *words)
    assert code == EXIT_MISSED
    assert "MISSED: 1 of 1." in out
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()  # noqa: S314 - our own
    (failed,) = suite.findall("testcase[failure]")
    assert failed.get("name") == "success rate"
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    skipped = suite.findall("testcase[skipped]")
    assert len(skipped) == found["failed"] == int(suite.get("skipped") or 0)
    assert (suite.get("failures"), suite.get("tests")) == ("1", str(found["failed"] + 1))
    number = found["failures"][0]["number"]
    assert skipped[0].findtext("system-out") == f"satform run --campaign {file} --case {number}"


def test_a_case_shows_its_values_and_its_run_has_the_bits_of_the_campaign(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    campaign = load_campaign(file)
    code, out, _ = command(capsys, "case", file, "3")
    assert code == EXIT_DONE
    assert "satellites[0].arc_length" in out
    assert "seed" in out
    case = summary(capsys, "case", file, "3")
    assert set(case["changes"]) == {f"satellites[{index}].arc_length" for index in range(3)} | {"seed"}
    assert abs(case["changes"]["satellites[0].arc_length"] - campaign.base.satellites[0].arc_length) < 15e3
    run = ["run", "--campaign", str(file), "--case", "3", "--mode", "inprocess", "--json"]
    code = cli.main([*run, "--out", str(tmp_path / "run")])
    flown = json.loads(capsys.readouterr().out)
    assert flown["state_hash"] == simulate(case_scenario(campaign, 3)).digest()
    assert code == flown["exit_code"] == (EXIT_DONE if flown["expectations"][0]["met"] else EXIT_MISSED)
    assert json.loads((tmp_path / "run" / "case.json").read_text())["changes"] == case["changes"]
    words = ("case", file, "3", "--fly", "--mode", "inprocess", "--out", tmp_path / "fly")
    assert summary(capsys, *words)["state_hash"] == flown["state_hash"]


def test_records_of_failed_cases_are_runs_that_report_opens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path, more="keep: {record: on_failure}")
    found = summary(capsys, "run", file, "--out", tmp_path / "out", "--workers", "2")
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
        code, out, err = command(capsys, *words)
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


def test_results_of_another_campaign_in_a_folder_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path, runs=2)
    for out, seed in (("first", "seed: 7"), ("second", "seed: 8")):
        file.write_text(file.read_text().replace("seed: 7", seed))
        words = ["campaign", "run", str(file), "--workers", "1", "--out", str(tmp_path / out)]
        assert cli.main(words) == EXIT_DONE
    [other] = (tmp_path / "second" / "results").iterdir()
    [own] = (tmp_path / "first" / "results").iterdir()
    own.unlink()
    shutil.copy(other, own.parent)
    capsys.readouterr()
    assert cli.main(["campaign", "resume", "--stored", str(tmp_path / "first")]) == EXIT_BAD_INPUT
    error = capsys.readouterr().err
    assert f"{own.parent / other.name}: is of another campaign: it has the digest" in error
    assert len(error.splitlines()) == 1
    assert cli.main(["campaign", "resume", "--stored", str(tmp_path / "first"), "--repair"]) == EXIT_DONE
    assert (tmp_path / "first" / "damaged" / other.name).exists()


def test_two_campaigns_do_not_share_a_folder(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert command(capsys, "run", file, "--out", out, "--workers", "1")[0] == EXIT_DONE
    before = sorted(out.rglob("*"))
    code, _, err = command(capsys, "run", file, "--out", out)
    assert code == EXIT_BAD_INPUT
    assert f"{out} already holds the campaign small: go on with satform campaign resume {out}" in err
    assert sorted(out.rglob("*")) == before
    with locked(out):
        code, _, err = command(capsys, "resume", out)
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
        code, _, err = command(capsys, "run", file, "--out", out, "--workers", "1")
    assert code == EXIT_BAD_INPUT
    expected = {"locked": "is flying a campaign in this folder", "done": "is not an empty folder"}
    assert f"{out}: " in err
    assert expected[moment] in err
    assert len(err.splitlines()) == 1
    assert CampaignFolder.open(out).manifest.started == "2026-01-01T00:00:00+00:00"
    assert not (out / "results").exists()


@pytest.fixture
def half_done(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """The folder of a campaign of which about half of the cases have results."""
    out = tmp_path / "half"
    assert command(capsys, "run", file, "--out", out, "--workers", "1")[0] == EXIT_DONE
    folder = CampaignFolder.open(out)
    results = list(folder.results())
    shutil.rmtree(out / "results")
    from satform.campaign.result_files import write_results

    write_results(out, results[:2], folder.manifest.schema)
    write_results(out, [*results[3:5], results[9]], folder.manifest.schema)
    return out


def test_a_resumed_campaign_flies_what_is_missing_and_has_the_same_hash(
    half_done: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    partial = summary(capsys, "report", half_done)
    assert (partial["flown"], partial["results_hash"], partial["exit_code"]) == (5, None, EXIT_LOST)
    found = summary(capsys, "resume", half_done, "--workers", "2")
    assert (found["results_hash"], found["speed"]["cases"]) == (wanted, 7)
    assert summary(capsys, "resume", half_done)["results_hash"] == wanted


def test_a_campaign_is_resumed_by_its_file_from_the_newest_folder(
    file: Path, tmp_path: Path, half_done: Path, wanted: str,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    (tmp_path / "runs").mkdir()
    half_done.rename(tmp_path / "runs" / "small-1")
    monkeypatch.chdir(tmp_path)
    assert summary(capsys, "resume", file)["results_hash"] == wanted


@pytest.mark.parametrize("changed", ["small.yaml", "triangle.yaml"])
def test_a_changed_campaign_or_scenario_is_not_resumed_unless_the_stored_one_is_meant(
    changed: str, half_done: Path, tmp_path: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (tmp_path / changed).read_text()
    old, new = ("seed: 7", "seed: 8") if changed == "small.yaml" else ("period: 6000.0", "period: 6001.0")
    (tmp_path / changed).write_text(text.replace(old, new))
    code, _, err = command(capsys, "resume", half_done)
    assert code == EXIT_BAD_INPUT
    assert "the campaign or its scenario is not the one that was started" in err
    assert "--stored goes on with the copy in the folder" in err
    assert summary(capsys, "resume", half_done, "--stored")["results_hash"] == wanted


def test_a_damaged_file_of_results_is_named_and_a_repair_flies_its_cases_again(
    half_done: Path, wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged = result_files(half_done)[1].path
    content = bytearray(damaged.read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    for words in (("resume", half_done), ("report", half_done)):
        code, _, err = command(capsys, *words)
        assert code == EXIT_BAD_INPUT
        assert f"{damaged}: is damaged" in err
        assert f"satform campaign resume {half_done} --repair" in err
    assert summary(capsys, "resume", half_done, "--repair")["results_hash"] == wanted
    assert (half_done / "damaged" / damaged.name).exists()


def started(words: Sequence[str | Path]) -> subprocess.Popen[str]:
    """A `satform campaign` in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "satform_tools", "campaign", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for_results(folder: Path, process: subprocess.Popen[str]) -> None:
    """Wait until a campaign has stored a first result."""
    end = time.monotonic() + 120.0
    while not list((folder / "results").glob("*.parquet")):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


def workers_of(folder: Path) -> list[int]:
    """Numbers of the processes whose standard error is the log of a campaign's workers."""
    found = []
    for descriptor in Path("/proc").glob("[0-9]*/fd/2"):
        try:
            if descriptor.readlink() == folder / "workers.log":
                found.append(int(descriptor.parts[2]))
        except OSError:
            continue
    return found


def ended(pids: Sequence[int]) -> bool:
    """Whether processes end within some time."""
    end = time.monotonic() + 60.0
    while any(Path(f"/proc/{pid}/stat").exists() for pid in pids):
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


@pytest.fixture
def long(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """A campaign under way that has stored a result, and its folder."""
    out = tmp_path / "long"
    process = started(["run", write(tmp_path, runs=4000, duration=20.0), "--out", out, "--workers", "2"])
    try:
        wait_for_results(out, process)
        yield process, out
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()


def assert_as_flown_alone(out: Path) -> None:
    """The first and the last results of an interrupted campaign are those of their cases flown alone."""
    folder = CampaignFolder.open(out)
    campaign, stored = folder.campaign(), list(folder.results())
    for result in (*stored[:2], *stored[-2:]):
        alone = folder.manifest.columns.complete(fly_case(campaign, result.number))
        for name in ("changes", "figures", "met", "success", "reason"):
            assert getattr(result, name) == getattr(alone, name)


def test_ctrl_c_keeps_what_is_done_ends_the_workers_and_says_how_to_go_on(
    long: tuple[subprocess.Popen[str], Path],
) -> None:
    process, out = long
    workers = workers_of(out)
    assert len(workers) == 2
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=120)
    assert process.returncode == EXIT_STOPPED
    assert "Traceback" not in errors
    assert ended(workers)
    found = json.loads((out / "summary.json").read_text())
    assert 0 < found["flown"] < 4000
    assert f"STOPPED: {4000 - found['flown']} of 4000 cases are not flown" in output
    assert f"satform campaign resume {out}" in output
    assert CampaignFolder.open(out).done().sum() == found["flown"]
    assert_as_flown_alone(out)


def test_a_killed_campaign_leaves_whole_files_and_no_workers(
    long: tuple[subprocess.Popen[str], Path],
) -> None:
    process, out = long
    workers = workers_of(out)
    process.kill()
    process.wait()
    assert ended(workers)
    folder = CampaignFolder.open(out)
    assert damaged_files(folder) == []
    assert 0 < folder.done().sum() < 4000
    assert_as_flown_alone(out)
    # The lock has ended with its process.
    with locked(out):
        pass


def test_a_killed_worker_costs_no_case(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    process = started(
        ["run", write(tmp_path, runs=60, duration=20.0), "--out", out, "--workers", "2", "--json"]
    )
    end = time.monotonic() + 120.0
    while not (workers := workers_of(out)):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    os.kill(workers[0], signal.SIGKILL)
    output, errors = process.communicate(timeout=300)
    assert process.returncode == EXIT_DONE, errors
    killed = json.loads(output)
    assert (killed["flown"], killed["lost"]) == (60, 0)
    undisturbed = summary(capsys, "run", tmp_path / "small.yaml", "--out", tmp_path / "other")
    assert killed["results_hash"] == undisturbed["results_hash"]


def test_a_full_disk_ends_the_campaign_with_a_sentence_and_what_is_stored_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(disk)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("NOT TESTED: only root can mount a small disk")
    try:
        series = "keep: {series: [{quantity: position}, {quantity: velocity}, {quantity: acceleration}]}"
        file = write(tmp_path, runs=60, duration=400.0, more=series)
        code, out, err = command(capsys, "run", file, "--out", disk / "out", "--workers", "1")
        assert code == EXIT_LOST
        assert "NOT COMPLETE" in out
        assert "the results cannot be stored" in out
        assert f"the disk is full (no space, or no inodes): {disk} has" in out
        assert "Traceback" not in err
        folder = CampaignFolder.open(disk / "out")
        assert damaged_files(folder) == []
        assert not [path for path in (disk / "out").rglob(".*") if path.name != ".lock"]
    finally:
        subprocess.run(["umount", "--lazy", str(disk)], check=True)


def test_cases_that_do_not_end_in_time_are_lost_and_are_flown_again_when_that_is_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = write(tmp_path, runs=2, duration=3000.0)
    words = ("run", slow, "--out", tmp_path / "out", "--workers", "1", "--timeout", "0.1")
    found = summary(capsys, *words)
    assert found["lost"] == found["failed"] == found["flown"] == 2
    assert found["results_hash"] is None
    assert found["reasons"] == {"timeout: not flown within ... s of wall-clock time": 2}
    assert summary(capsys, "resume", tmp_path / "out")["lost"] == 2
    again = summary(capsys, "resume", tmp_path / "out", "--retry", "--workers", "1")
    assert (again["lost"], again["flown"]) == (0, 2)


def test_shipped_campaigns_are_found_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    for shipped in sorted(path.stem for path in CAMPAIGNS.glob("*.yaml")):
        assert summary(capsys, "case", shipped, "0")["changes"]
