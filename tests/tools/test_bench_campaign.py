# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of campaigns flies what it says, and counts the memory of all processes."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from satform.campaign.folder import CampaignFolder
from satform_tools.bench import campaign as bench


def test_the_benchmark_disperses_starts_gains_and_noise_of_the_triangle(tmp_path: Path) -> None:
    made = bench._made(tmp_path, 3, 12_000.0)
    assert (made.cases, made.base.timing.steps, len(made.base.satellites)) == (3, 24_000, 3)
    assert [dispersion.path.rpartition(".")[2] for dispersion in made.dispersions] == [
        "position_error[*]",
        "arc_length",
        "reaching_gain[*]",
    ]
    assert len({bench.case_values(made, number)["seed"] for number in range(3)}) == 3
    assert made.base.satellite(0).sensor is not None
    assert len(made.figure_names) == len(made.base.expect) > 0


def test_the_engine_is_measured_with_every_case_stored(tmp_path: Path) -> None:
    size = replace(bench.QUICK, short=40, workers=1)
    figure = bench._overhead(bench._made(tmp_path, size.short, 5.0), tmp_path, size, 1)
    assert figure.yardstick == bench.FLOWN
    assert figure.ratio > 0.0
    assert np.all(CampaignFolder.open(tmp_path / "engine0").done())


def test_memory_is_that_of_a_process_and_of_those_that_it_starts() -> None:
    program = "import subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"
    held = "held = bytearray(b'1') * 90_000_000; print('ready', flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", program, held], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        assert bench._memory(process.pid) > 90_000_000
        process.communicate(b"\n")
    assert bench._memory(process.pid) == 0
    assert bench._memory(os.getpid()) > 10_000_000
