# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Each call of the file system fails once, or kills its process: what was said to be kept is there."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent

WRITERS = {
    "file": {"open": 12, "write": 9, "fsync": 12, "rename": 6},
    "checkpoint": {"open": 12, "fsync": 12, "rename": 6},
    "bag": {"open": 4, "fsync": 6, "rename": 2},
    "recovery": {"open": 4, "fsync": 6, "rename": 2},
    "record": {"open": 2, "fsync": 4, "rename": 2},
    "registry": {"open": 4, "rename": 4},
    "campaign": {"open": 20, "fsync": 36, "rename": 18},
    "retry": {"open": 8, "fsync": 16, "rename": 12},
}
"""By the name of a writer: how many failures of some kinds there are at least."""


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What came of the failures of each writer."""
    if shutil.which("gcc") is None:
        pytest.skip("NOT TESTED: failing calls are made by a library in C, and there is no gcc")
    library = tmp_path_factory.mktemp("calls") / "failing_calls.so"
    source = HERE / "failing_calls.c"
    options = ["-shared", "-fPIC", "-O1", "-Wall", "-Werror"]
    subprocess.run(["gcc", *options, "-o", library, source, "-ldl"], check=True)
    done = subprocess.run(
        [sys.executable, HERE / "fail_each_call.py"],
        env={**os.environ, "LD_PRELOAD": str(library)},
        capture_output=True,
        text=True,
        timeout=1200.0,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {own["writer"]: own for own in map(json.loads, done.stdout.splitlines())}


@pytest.mark.parametrize("writer", WRITERS)
def test_what_was_said_to_be_kept_is_there_whichever_call_fails(
    writer: str, found: dict[str, dict[str, Any]]
) -> None:
    assert found[writer]["broken"] == []
    for kind, least in WRITERS[writer].items():
        assert found[writer]["failures"][kind] >= least, kind
