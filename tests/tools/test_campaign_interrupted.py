# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns that are stopped, killed, lose a worker or fill the disk keep what is flown."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from process_ends import ended
from satform.campaign.chunk import fly_case
from satform.campaign.folder import CampaignFolder, locked
from satform.campaign.folder_repair import damaged_files
from satform.common.exit_codes import EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from small_campaign import campaign_command, results_hash, write_campaign


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
        time.sleep(0.02)  # polls: there is no event for a file that another process writes


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


@pytest.fixture
def long(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """A campaign under way that has stored a result, and its folder."""
    out = tmp_path / "long"
    process = started(
        ["run", write_campaign(tmp_path, runs=4000, duration=20.0), "--out", out, "--workers", "2"]
    )
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


def test_a_killed_worker_costs_no_case(tmp_path: Path) -> None:
    file, out = write_campaign(tmp_path, runs=60, duration=20.0), tmp_path / "out"
    process = started(["run", file, "--out", out, "--workers", "2", "--json"])
    end = time.monotonic() + 120.0
    while not (workers := workers_of(out)):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)  # polls: no event for the start of another process's child
    os.kill(workers[0], signal.SIGKILL)
    output, errors = process.communicate(timeout=300)
    assert process.returncode == EXIT_DONE, errors
    killed = json.loads(output)
    assert (killed["flown"], killed["lost"]) == (60, 0)
    assert killed["results_hash"] == results_hash(file)


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
        file = write_campaign(tmp_path, runs=60, duration=400.0, more=series)
        code, out, err = campaign_command(capsys, "run", file, "--out", disk / "out", "--workers", "1")
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
