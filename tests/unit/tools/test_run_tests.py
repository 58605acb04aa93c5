# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The test command: which parts it runs, what it reports, and its checks of licence lines and coverage."""

import importlib.util
import os
import re
import signal
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

    def outcome(part: run_tests.Part) -> run_tests.Outcome:
        return run_tests.Outcome(call(part.command), f"output of {part.name}", 0.0)

    monkeypatch.setattr(run_tests, "_call", call)
    monkeypatch.setattr(run_tests, "_outcome", outcome)
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
    assert sorted(called[:-1]) == sorted(list(part.command) for part in run_tests.PARTS)
    assert called[-1] == list(run_tests.COVERAGE.command)
    printed = capsys.readouterr().out
    assert all(f"output of {part.name}\n" in printed for part in run_tests.PARTS)
    assert "mypy --strict: failed" in printed
    assert "unit tests: passed" in printed


MEETS = """
import os, pathlib, sys, time
own, others = pathlib.Path(sys.argv[1]), [pathlib.Path(name) for name in sys.argv[2:]]
own.touch()
end = time.monotonic() + 60.0
while not all(other.exists() for other in others):
    assert time.monotonic() < end, "the others have not started"
    time.sleep(0.01)  # polls: there is no event for a file that another process writes
print("met at", os.getpriority(os.PRIO_PROCESS, 0))
"""


def test_two_parts_run_beside_one_another_and_beside_two_at_low_priority(tmp_path: PurePath) -> None:
    names = ["first", "second", "background", "other background"]
    files = {name: str(tmp_path / name) for name in names}
    parts = [
        run_tests.Part(
            name,
            ("-c", MEETS, files[name], *(files[other] for other in names if other != name)),
            background="background" in name,
        )
        for name in names
    ]
    outcomes = {part.name: outcome for part, outcome in run_tests._side_by_side(parts)}
    own = os.getpriority(os.PRIO_PROCESS, 0)
    assert {name: outcome.code for name, outcome in outcomes.items()} == dict.fromkeys(names, 0), outcomes
    assert outcomes["first"].output == outcomes["second"].output == f"met at {own}\n"
    low = f"met at {min(own + 10, 19)}\n"
    assert outcomes["background"].output == outcomes["other background"].output == low


def test_a_part_s_output_is_whole_and_its_exit_code_is_kept() -> None:
    code = "import os, sys; print('one'); print('two', file=sys.stderr); os.system('echo three'); sys.exit(7)"
    ((_, outcome),) = run_tests._side_by_side([run_tests.Part("part", ("-c", code))])
    assert (outcome.code, outcome.output) == (7, "one\ntwo\nthree\n")


def test_the_processor_time_of_a_part_includes_that_of_the_processes_that_it_waited_for() -> None:
    spend = "import time; [None for _ in iter(lambda: time.process_time() < 0.05, False)]; "
    code = f"{spend}import subprocess, sys; subprocess.run([sys.executable, '-c', {spend!r}], check=True)"
    ((_, outcome),) = run_tests._side_by_side([run_tests.Part("part", ("-c", code))])
    assert (outcome.code, outcome.output) == (0, "")
    assert outcome.processor_seconds >= 2 * 0.05


def test_parts_store_bytecode_also_where_that_is_turned_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    code = "import sys; print(sys.dont_write_bytecode)"
    ((_, outcome),) = run_tests._side_by_side([run_tests.Part("part", ("-c", code))])
    assert outcome.output == "False\n"


def test_a_process_that_a_part_has_left_behind_does_not_hold_the_command_up() -> None:
    code = "import subprocess; print(subprocess.Popen(['sleep', '3600']).pid)"
    ((_, outcome),) = run_tests._side_by_side([run_tests.Part("part", ("-c", code))])
    os.kill(int(outcome.output), signal.SIGKILL)
    assert outcome.code == 0


def test_parts_of_one_folder_share_its_tests_by_a_marker_and_leave_none_out() -> None:
    chosen: dict[str, list[str]] = {}
    for part in run_tests.PARTS:
        if "pytest" in part.command:
            words = part.command[part.command.index("pytest") :]
            marker = words[words.index("-m") + 1] if "-m" in words else ""
            for word in words:
                if word.startswith("tests/"):
                    chosen.setdefault(word, []).append(marker)
    assert chosen["tests/unit"] == [""]
    assert chosen["tests/dds"] == ["unmeasured", "not unmeasured"]
    for folder, markers in chosen.items():
        (first, *others) = sorted(markers, key=len)
        # All of it, or those with a marker and those without.
        assert others == ([f"not {first}"] if first else []), (folder, markers)


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


def test_modules_of_tests_have_names_of_their_own() -> None:
    names = [file.name for file in (ROOT / "tests").rglob("test_*.py")]
    assert sorted({name for name in names if names.count(name) > 1}) == []
