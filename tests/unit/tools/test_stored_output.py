# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Output of commands that only look is printed again while nothing that it depends on has changed."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from satform_tools import stored_output
from satform_tools.cli import main as cli

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the library seems to be built; nothing is stored there yet."""
    folder = tmp_path / "install"
    folder.mkdir()
    (folder / "complete.json").write_text("{}")
    origin = str(folder / "satform" / "__init__.py")
    monkeypatch.setattr(stored_output, "_INSTALL", folder)
    monkeypatch.setattr(stored_output, "find_spec", lambda _name: type("Library", (), {"origin": origin}))
    return folder


@pytest.fixture
def own_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that stands for the files of the command line."""
    folder = tmp_path / "tools"
    folder.mkdir()
    monkeypatch.setattr(stored_output, "_TOOLS", folder)
    return folder


class Command:
    """A command that prints the text of a file, with a count on standard error."""

    def __init__(self, file: Path, code: int = 0) -> None:
        self.file, self.code, self.calls = file, code, 0

    def __call__(self) -> int:
        self.calls += 1
        with self.file.open() as file:
            sys.stdout.write(file.read())
        sys.stderr.write("a remark\n")
        return self.code


@pytest.fixture
def command(install: Path, own_files: Path, tmp_path: Path) -> Command:
    (tmp_path / "scenario.yaml").write_text("first\n")
    return Command(tmp_path / "scenario.yaml")


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> Run:
    def run(command: Callable[[], int], words: Sequence[str] = ("show", "x")) -> tuple[int, str, str]:
        code = stored_output.run(words, command)
        return (code, *capsys.readouterr())

    return run


def test_output_is_printed_again_without_running_the_command(command: Command, printed: Run) -> None:
    assert printed(command) == printed(command) == (0, "first\n", "a remark\n")
    assert command.calls == 1


def test_another_content_of_a_file_that_was_read_is_another_output(command: Command, printed: Run) -> None:
    printed(command)
    command.file.write_text("second\n")
    assert printed(command)[1] == "second\n"
    command.file.unlink()
    with pytest.raises(FileNotFoundError):
        printed(command)


@pytest.mark.parametrize("changed", ["command line", "build", "tools", "folder", "way of showing"])
def test_what_else_the_output_depends_on_is_in_its_name(
    changed: str, command: Command, printed: Run, install: Path, own_files: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    printed(command)
    words = ["show", "x"]
    if changed == "command line":
        words = ["show", "x", "--json"]
    elif changed == "build":
        (install / "complete.json").write_text("{1}")
    elif changed == "tools":
        (own_files / "check.py").write_text("pass")
    elif changed == "folder":
        monkeypatch.chdir(tmp_path)
    else:
        monkeypatch.setenv("COLUMNS", "41")
    printed(command, words)
    assert command.calls == 2


@pytest.mark.parametrize("words", [[], ["run", "x"], ["run", "--out", "-h"], ["test", "-h"], ["report", "x"]])
def test_commands_that_do_more_than_look_are_always_run(
    words: list[str], command: Command, printed: Run, install: Path
) -> None:
    printed(command, words)
    printed(command, words)
    assert command.calls == 2
    assert not (install / "cache").exists()


def test_a_command_that_finds_something_wrong_is_run_again(
    command: Command, printed: Run, install: Path
) -> None:
    command.code = 2
    assert printed(command)[0] == printed(command)[0] == 2
    assert not (install / "cache").exists()


@pytest.mark.parametrize("damage", ["cut short", "bit", "empty", "not json", "folder"])
def test_a_damaged_entry_is_computed_again(
    damage: str, command: Command, printed: Run, install: Path
) -> None:
    printed(command)
    (entry,) = (install / "cache" / "output").iterdir()
    content = bytearray(entry.read_bytes())
    content[-8] ^= 1
    damaged = {"cut short": content[:40], "bit": content, "empty": b"", "not json": b"a\nb"}
    entry.unlink()
    if damage == "folder":
        entry.mkdir()
    else:
        entry.write_bytes(damaged[damage])
    assert printed(command) == (0, "first\n", "a remark\n")
    assert command.calls == 2


def test_nothing_is_stored_of_a_file_that_was_changed_after_it_was_read(
    command: Command, printed: Run, install: Path
) -> None:
    def changing() -> int:
        command()
        command.file.write_text("changed at once\n")
        return 0

    assert printed(changing)[1] == "first\n"
    assert printed(command)[1] == "changed at once\n"


def test_nothing_is_stored_where_others_bring_parts_or_the_library_is_another(
    command: Command, printed: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(stored_output, "_has_foreign_parts", lambda: True)
        printed(command)
    with monkeypatch.context() as patch:
        patch.setattr(stored_output, "find_spec", lambda _name: None)
        printed(command)
    printed(command)
    assert command.calls == 3
    printed(command)
    assert command.calls == 3


def test_packages_with_parts_are_found_among_those_that_are_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not stored_output._has_foreign_parts()
    info = tmp_path / "site" / "own_law-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: own_law\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[satform.controllers]\nown = own_law:Spec\n")
    before = list(stored_output._packages())
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    assert stored_output._has_foreign_parts()
    assert list(stored_output._packages()) != before


def test_the_newest_entries_are_kept(
    command: Command, printed: Run, install: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stored_output, "_MOST_ENTRIES", 3)
    for number in range(5):
        printed(command, ["show", str(number)])
    assert len(list((install / "cache" / "output").iterdir())) == 3
    printed(command, ["show", "4"])
    assert command.calls == 5


def test_what_cannot_be_stored_is_printed(command: Command, printed: Run, install: Path) -> None:
    (install / "cache").write_text("a file in the folder's place")
    assert printed(command) == printed(command) == (0, "first\n", "a remark\n")
    assert command.calls == 2


@pytest.mark.parametrize("words", [["check", "directed_triangle"], ["show", "triangle", "--json"], ["-h"]])
def test_commands_print_the_same_again(
    words: list[str], printed: Run, install: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The library is not where it seems to be built, so that its modules are among the files that are opened.
    monkeypatch.setattr(stored_output, "_MOST_FILES", 10_000)
    first = printed(lambda: cli.main(words), words)
    assert (first[0], first[2]) == (0, "")
    assert len(first[1]) > 10
    assert printed(lambda: pytest.fail("is stored"), words) == first
    (entry,) = (install / "cache" / "output").iterdir()
    assert ("/scenarios/" in entry.read_text()) == (words != ["-h"])
