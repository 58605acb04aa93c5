# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The test command: which parts it runs, what it reports, and its checks of licence lines and coverage."""

import importlib.util
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import PurePath
from types import ModuleType

import pytest

import satform
from satform_tools import run_tests
from satform_tools.cli import main as cli
from satform_tools.run.scenario_library import ROOT


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands of the parts, of which mypy fails, instead of running them."""
    commands: list[list[str]] = []

    def call(command: Sequence[str]) -> int:
        commands.append(list(command))
        return int("mypy" in command)

    monkeypatch.setattr(run_tests, "_call", call)
    return commands


def script(name: str) -> ModuleType:
    """A script of `tools/lint` as a module."""
    found = importlib.util.spec_from_file_location(name, ROOT / "tools" / "lint" / f"{name}.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def test_test_runs_every_part_and_fails_when_one_does(
    called: list[list[str]],
    capsys: pytest.CaptureFixture[str],
    tmp_path: PurePath,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(run_tests, "ROOT", tmp_path)
    assert cli.main(["test"]) == 1
    assert called == [list(part.command) for part in run_tests.PARTS]
    printed = capsys.readouterr().out
    assert "mypy --strict: failed" in printed
    assert "unit tests: passed" in printed


def test_the_parts_run_every_folder_of_tests() -> None:
    named = {word for part in run_tests.PARTS if "pytest" in part.command for word in part.command}
    folders = {file.relative_to(ROOT).parts[:2] for file in (ROOT / "tests").rglob("test_*.py")}
    assert {"/".join(parts) for parts in folders} <= named


def test_the_types_of_every_package_are_checked() -> None:
    (checked,) = (part.command for part in run_tests.PARTS if "mypy" in part.command)
    sources = ROOT / "ros_ws" / "src"
    packages = {
        folder.name for folder in sources.iterdir() if (folder / folder.name / "__init__.py").exists()
    }
    packages |= {folder.parent.name for folder in (ROOT / "tools").glob("satform_*/__init__.py")}
    assert packages <= {word.rpartition("/")[2] for word in checked}


def test_test_with_arguments_is_pytest_alone(called: list[list[str]]) -> None:
    assert cli.main(["test", "tests/unit", "-k", "curve", "--help"]) == 0
    assert called == [["-m", "pytest", "tests/unit", "-k", "curve", "--help"]]


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("curve.py", '"""A curve."""\n', '{}"""A curve."""\n'),
        ("run", "#!/bin/sh\nexec true\n", "#!/bin/sh\n{}exec true\n"),
        ("State.msg", "float64 x\n", "{}float64 x\n"),
        ("page.md", "# A page\n", "# A page\n"),
        ("empty.py", "", ""),
    ],
)
def test_a_licence_header_is_added_once_below_the_line_of_the_interpreter(
    name: str, text: str, expected: str
) -> None:
    headers = script("licence_headers")
    lines = "# Copyright 2026 satform contributors\n# SPDX-License-Identifier: Apache-2.0\n"
    added = headers.with_header(PurePath(name), text)
    assert added == expected.format(lines)
    assert headers.with_header(PurePath(name), added) == added
    assert headers.has_header(PurePath(name), text) == (added == text)


def test_coverage_counts_the_files_of_one_package() -> None:
    coverage = script("coverage_figures")

    def entry(lines: int, branches: int) -> dict[str, dict[str, int]]:
        counts = {"covered_lines": lines, "covered_branches": branches}
        return {"summary": {**counts, "num_statements": 10, "num_branches": 4}}

    files = {
        "ros_ws/src/satform/satform/a.py": entry(10, 4),
        "ros_ws/src/satform/satform/b/c.py": entry(5, 3),
        "ros_ws/src/satform_nodes/satform_nodes/a.py": entry(0, 0),
    }
    assert coverage.figures(files, "satform") == (75.0, 87.5)
    with pytest.raises(KeyError, match="satform_bringup"):
        coverage.figures(files, "satform_bringup")


def test_every_package_has_the_version_of_the_library_and_so_has_the_citation() -> None:
    sources = ROOT / "ros_ws" / "src"
    found = {
        file.parent.name: ET.parse(file).findtext("version")  # noqa: S314 - our own files
        for file in sources.glob("*/package.xml")
    }
    for pattern in ("*/setup.py", "*/pyproject.toml"):
        for file in sources.glob(pattern):
            versions = re.findall(
                r'^\s*version ?= ?"([^"]+)"', file.read_text(encoding="utf-8"), re.MULTILINE
            )
            found |= {f"{file.parent.name}/{file.name}": version for version in versions}
    (found["CITATION.cff"],) = re.findall(
        r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE
    )
    assert len(found) >= 8
    assert set(found.values()) == {satform.__version__}
