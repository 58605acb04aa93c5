# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A satellite that does not send what others wait for is lost after `node_timeout`, not those who wait."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from satform.bag.reader import read_bag

OPTIONS = ("satellites[sat2].external=true", "node_timeout=3.0", "timing.duration=20")


def flown(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_faulty: Callable[[Path, str], "subprocess.Popen[str]"],
    run: Path,
    fault: str,
    *more: str,
) -> tuple[int, str]:
    """Exit code of the run, and what it printed, in one line."""
    changes = [argument for option in (*OPTIONS, *more) for argument in ("--set", option)]
    flight = start_run("triangle", *changes)
    start_faulty(run, fault)
    output, messages = flight.communicate(timeout=120)
    return flight.returncode, " ".join(f"{output} {messages}".split())


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("NoPhase", "no /sat2/arc_length for step 3 within 3 s"),
        ("Stuck", "no answer within 3 s from sat2"),
    ],
)
def test_the_satellite_that_holds_up_a_step_is_lost_and_the_others_fly_on(
    fault: str,
    reason: str,
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_faulty: Callable[[Path, str], "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    code, text = flown(start_run, start_faulty, tmp_path / "run", fault)
    assert code == 3, text
    assert reason in text
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["lost"] == ["sat2"]
    record = read_bag(tmp_path / "run" / "bag").record
    assert record.steps == 40
    assert record.absent[:, 1].tolist() == [False] * 3 + [True] * 37
    assert not record.absent[:, [0, 2]].any()


def test_a_satellite_without_its_first_phase_ends_the_flight_by_name(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_faulty: Callable[[Path, str], "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    code, text = flown(start_run, start_faulty, tmp_path / "run", "NoFirstPhase")
    assert code == 3
    assert "no /sat2/arc_length for step 0 within 3 s" in text


def test_a_satellite_whose_phase_the_recorder_alone_lacks_is_lost_and_not_the_recorder(
    start_run: Callable[..., "subprocess.Popen[str]"],
    start_faulty: Callable[[Path, str], "subprocess.Popen[str]"],
    tmp_path: Path,
) -> None:
    # The plant waits for the recorder when it is 256 steps ahead.
    one_way = "graph={kind: matrix, rows: [[0, 0, 1], [1, 0, 1], [1, 0, 0]]}"
    more = (one_way, "timing.duration=150")
    code, text = flown(start_run, start_faulty, tmp_path / "run", "NoPhaseForRecorder", *more)
    assert code == 3, text
    assert "no /sat2/arc_length for step 25" in text
    assert json.loads((tmp_path / "run" / "result.json").read_text())["lost"] == ["sat2"]
    assert read_bag(tmp_path / "run" / "bag").record.steps == 300
