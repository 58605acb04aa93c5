# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The packages that `new` makes are tested as they are, and what cannot be made is rejected."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from satform_tools.cli import main as cli
from satform_tools.templates.kinds import PartKind
from satform_tools.templates.package import KINDS, TEMPLATES


def test_every_kind_has_a_template_with_a_module_a_scenario_and_a_test() -> None:
    for kind in PartKind:
        name = KINDS[kind].name
        assert {path.name for path in (TEMPLATES / kind).iterdir() if path.is_file()} == {
            f"{name}.py",
            f"{name}.yaml",
            f"test_{name}.py",
        }


def test_the_tests_of_new_packages_pass_and_fly_their_scenarios(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for kind in PartKind:
        assert cli.main(["new", kind, f"my_{kind}", "--out", str(tmp_path / kind)]) == 0
        assert f"run {tmp_path / kind}/my_{kind}.yaml" in capsys.readouterr().out
    for file in tmp_path.rglob("*.py"):
        assert "Copyright" not in file.read_text()
    folders = [str(tmp_path / kind) for kind in PartKind]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", tmp_path, tmp_path],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*folders, os.environ.get("PYTHONPATH", "")])},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert f"{2 * len(PartKind)} passed" in done.stdout


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Mine", "lower case letters"),
        ("class", "no keyword"),
        ("lqr", "there is a control law of the kind 'lqr' already"),
        ("json", "there is a Python module of the name 'json' already"),
    ],
)
def test_a_name_that_cannot_be_used_is_rejected(
    name: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["new", "controller", name, "--out", str(tmp_path / "new")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_folder_with_files_is_not_touched(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert cli.main(["new", "controller", "my_law", "--out", str(tmp_path)]) == 2
    assert "is not an empty folder" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
