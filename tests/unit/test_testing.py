"""The test command: which parts it runs, what it says of them, and how it ends."""

import os
import platform
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from satform_tools import cli, testing


def test_test_runs_every_part_and_fails_when_one_does(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    called = record_calls(monkeypatch, fails="mypy")
    assert cli.main(["test"]) == 1
    assert [command[2] for command in called] == ["ruff", "ruff", "mypy", *["pytest"] * 3]
    printed = capsys.readouterr().out
    assert "mypy --strict: failed" in printed
    assert "unit tests: passed" in printed


def test_a_part_that_runs_beside_others_counts_and_what_it_printed_comes_at_the_end(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    parts = [
        testing.Part("beside", ("this_module_is_missing",), beside=True),
        testing.Part("in front", ("platform",)),
    ]
    monkeypatch.setattr(testing, "PARTS", parts)
    assert cli.main(["test"]) == 1
    printed = capfd.readouterr().out
    assert "in front: passed" in printed
    assert "beside: failed" in printed
    assert printed.index(platform.platform(aliased=True)) < printed.index("this_module_is_missing")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_part_that_runs_beside_others_ends_with_all_it_started_when_the_command_is_stopped(
    number: signal.Signals, tmp_path: Path
) -> None:
    # A part that starts another process and waits for it; the other one tells its number.
    (tmp_path / "part.py").write_text(
        "import subprocess, sys\n"
        "tell = 'import os, time; print(os.getpid(), flush=True); time.sleep(600)'\n"
        f"subprocess.run([sys.executable, '-c', tell], stdout=open({str(tmp_path / 'number')!r}, 'w'))\n"
    )
    (tmp_path / "front.py").write_text(
        "import os, pathlib, signal, time\n"
        f"number = pathlib.Path({str(tmp_path / 'number')!r})\n"
        "while not (number.exists() and number.read_text().endswith('\\n')): time.sleep(0.01)\n"
        f"os.kill(os.getppid(), {int(number)})\n"
        "time.sleep(600)\n"
    )
    command = (
        "import sys; from satform_tools import cli, testing\n"
        "part = testing.Part('beside', ('part',), beside=True)\n"
        "testing.PARTS = (part, testing.Part('in front', ('front',)))\n"
        "sys.exit(cli.main(['test']))\n"
    )
    search = os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]])
    environment = {**os.environ, "PYTHONPATH": search}
    # The one in front is of the group that is stopped, as in a terminal; the one beside is not.
    stopped = subprocess.Popen(
        [sys.executable, "-c", command], env=environment, stdout=subprocess.PIPE, start_new_session=True
    )
    try:
        output, _ = stopped.communicate(timeout=60)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(stopped.pid, signal.SIGKILL)
    assert stopped.returncode == 128 + number
    assert b"KeyboardInterrupt" in output
    started = int((tmp_path / "number").read_text())
    with pytest.raises(ProcessLookupError):
        os.kill(started, 0)


def test_the_parts_of_the_test_command_run_every_folder_of_tests() -> None:
    told = {word for part in testing.PARTS if part.command[0] == "pytest" for word in part.command}
    folders_of_tests = {file.parent for file in (testing.ROOT / "tests").rglob("test_*.py")}
    assert {str(folder.relative_to(testing.ROOT)) for folder in folders_of_tests} <= told


def test_test_with_arguments_is_pytest_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    called = record_calls(monkeypatch, fails="")
    assert cli.main(["test", "tests/unit", "-k", "curve", "--help"]) == 0
    assert called == [[sys.executable, "-m", "pytest", "tests/unit", "-k", "curve", "--help"]]


def record_calls(monkeypatch: pytest.MonkeyPatch, fails: str) -> list[list[str]]:
    called: list[list[str]] = []

    def call(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        called.append(command)
        return subprocess.CompletedProcess(command, int(fails in command))

    class Begun:
        pid, returncode = 0, 0

        def __init__(self, command: list[str], **_: Any) -> None:
            # Without the words before it that take away its priority.
            called.append(command[3:])

        def wait(self) -> int:
            return 0

    monkeypatch.setattr(testing.subprocess, "run", call)
    monkeypatch.setattr(testing.subprocess, "Popen", Begun)
    return called
