# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A package with a part of one's own, made by `satform new`, found on PYTHONPATH and flown."""

import os
import subprocess
import sys
from pathlib import Path

LAUNCHER = Path(__file__).parents[1] / "tools" / "satform"


def made(kind: str, folder: Path) -> Path:
    """The folder of a new package, named as its part."""
    subprocess.run([LAUNCHER, "new", kind, folder.name, "--out", folder], check=True)
    return folder


def satform(path: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """A finished command of `satform` that finds the packages in a folder."""
    return subprocess.run(
        [LAUNCHER, *words],
        env={**os.environ, "PYTHONPATH": str(path)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def fly_both_ways(package: Path, out: Path) -> None:
    """Fly the scenario of a package in process and over DDS; both succeed, with the same bits."""
    for mode in ("inprocess", "lockstep"):
        scenario = package / f"{package.name}.yaml"
        done = satform(package, "run", scenario, "--mode", mode, "--out", out / mode)
        assert done.returncode == 0, done.stdout + done.stderr
    # The scenario in the bag can be read only where the package is found.
    compare = (
        "import sys; from pathlib import Path; from satform_tools.report.command import find;"
        "a, b = (find(Path(folder)) for folder in sys.argv[1:]);"
        "assert a.complete and b.complete; found = a.record.differences(b.record); assert not found, found"
    )
    search = os.pathsep.join([str(package), os.environ.get("PYTHONPATH", "")])
    subprocess.run(
        [sys.executable, "-c", compare, str(out / "inprocess"), str(out / "lockstep")],
        env={**os.environ, "PYTHONPATH": search},
        check=True,
    )
