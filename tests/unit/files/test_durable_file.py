# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A file is whole or not there: on a full disk nothing is left behind, and the sentence names the disk."""

import errno
import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from flights import shipped, shortened
from satform.common.exit_codes import EXIT_LOST
from satform.files import durable_file
from satform.files.durable_file import write_durably
from satform.flight.compile_satellite import flight_plan
from satform.flight.satellite import Satellite
from satform.record.archive import RECORD, load_record, save_record
from satform.scenario import Scenario
from satform_nodes.satellite.checkpoint_file import CheckpointFile
from satform_tools.errors import sentence_of
from satform_tools.run import command as run_command
from satform_tools.run import output_folders

ROOM = 64 * 1024
"""Size of the disk, bytes."""


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of its own with little room."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={ROOM}", "tmpfs", str(place)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("NOT TESTED: only root can mount a small disk")
    yield place
    subprocess.run(["umount", "--lazy", str(place)], check=True)


def test_on_a_full_disk_the_old_file_stays_and_no_draft_is_left(disk: Path) -> None:
    file = disk / "state"
    write_durably(file, b"old")
    with pytest.raises(OSError, match="No space left") as caught:
        write_durably(file, bytes(2 * ROOM))
    assert caught.value.errno == errno.ENOSPC
    assert caught.value.filename == str(file)
    assert file.read_bytes() == b"old"
    assert [each.name for each in disk.iterdir()] == ["state"]
    assert sentence_of(caught.value).endswith(f"{disk} has 0.1 MB of 0.1 MB free")


def test_a_file_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, seen = tmp_path / "state", []

    def sync(descriptor: int) -> None:
        seen.append((str(Path(f"/proc/self/fd/{descriptor}").readlink()), file.exists()))

    monkeypatch.setattr(durable_file.os, "fsync", sync)
    write_durably(file, b"new")
    (draft, there), (folder, named) = seen
    assert draft.startswith(f"{tmp_path}/.state.")
    assert not there
    assert (folder, named) == (str(tmp_path), True)


def test_a_checkpoint_without_room_does_not_end_its_satellite(disk: Path) -> None:
    memory = CheckpointFile(str(disk / "checkpoints"), "sat1", 1)
    satellite = Satellite(flight_plan(shortened("triangle", 60.0), 0), 2)
    memory.keep(satellite, [1, 2])
    written = (disk / "checkpoints" / "sat1.checkpoint").read_bytes()
    (disk / "full").write_bytes(bytes(os.statvfs(disk).f_bavail * 4096))
    satellite.join(7)
    memory.keep(satellite, [1, 2])
    assert memory.failures == 1
    assert (
        "the checkpoint of step 7 cannot be written, the last one is of step 0: the disk is full"
        in memory.problem
    )
    assert str(disk) in memory.problem
    assert [file.read_bytes() for file in (disk / "checkpoints").iterdir()] == [written]
    (disk / "full").unlink()
    memory.keep(satellite, [1, 2])
    assert (memory.written, memory.problem, memory.failures) == (7, "", 1)


def test_a_run_whose_record_has_no_room_is_lost_and_leaves_no_part_of_a_file(disk: Path) -> None:
    scenario = shipped("triangle", "timing.duration=2000.0", "expect=[]")
    outcome = run_command.run(scenario, "inprocess", record=True, out=disk / "run")
    assert outcome.exit_code == EXIT_LOST
    assert f"flown to step {scenario.timing.steps}, but the record cannot be stored" in outcome.reason
    assert "the disk is full" in outcome.reason
    assert f"{disk} has" in outcome.reason
    assert not (disk / "run" / RECORD).exists()
    result = disk / "run" / output_folders.RESULT
    assert not result.exists() or json.loads(result.read_text())["exit_code"] == EXIT_LOST
    assert not [file.name for file in (disk / "run").iterdir() if file.name.startswith(".")]


def test_a_run_without_room_for_its_result_leaves_no_empty_one(
    disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save = run_command.save_scenario

    def save_and_fill_the_disk(scenario: Scenario, path: Path) -> None:
        save(scenario, path)
        with (disk / "full").open("wb", buffering=0) as file, suppress(OSError):
            while True:
                file.write(bytes(512))

    monkeypatch.setattr(run_command, "save_scenario", save_and_fill_the_disk)
    outcome = run_command.run(shortened("triangle", 10.0), "inprocess", record=False, out=disk / "run")
    assert outcome.exit_code == EXIT_LOST
    assert outcome.reason.startswith(f"the result cannot be stored: {disk}/run/result.json: the disk is full")
    assert not (disk / "run" / output_folders.RESULT).exists()


def test_the_record_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    from satform.flight.simulate import simulate

    flight = simulate(shortened("triangle", 10.0))
    save_record(flight, tmp_path / RECORD)
    assert np.array_equal(load_record(tmp_path / RECORD).position, flight.position)
