# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages that show commands show those that there are, with options that they have."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main

from satform_tools.cli import main as cli

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "commands.md"
OF_THE_SETUP: dict[tuple[str, ...], set[str]] = {("setup",): {"--clean"}, ("exec",): set()}
"""Commands that are there before the environment is, in `tools/satform_setup`."""


def commands(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], set[str]]]:
    """Every command by its words, with its options."""
    for name, command in group.commands.items():
        words = (*path, name)
        options = {
            option
            for parameter in command.params
            for option in (*parameter.opts, *parameter.secondary_opts)
            if option.startswith("--")
        }
        yield words, options
        if hasattr(command, "commands"):
            yield from commands(command, words)


COMMANDS = {**dict(commands(typer.main.get_group(cli.app))), **OF_THE_SETUP}


def shown(text: str) -> Iterator[tuple[tuple[str, ...], set[str]]]:
    """Commands and options in the code of a table's first column."""
    for line in re.findall(r"^\| (`.*?) \|", text, flags=re.MULTILINE):
        for call in re.findall(r"`([^`]+)`", line):
            words = call.removeprefix("./tools/satform ").split()
            path = tuple(words[:2]) if tuple(words[:2]) in COMMANDS else tuple(words[:1])
            yield path, {word for word in words if word.startswith("--")}


@pytest.mark.parametrize("page", [PAGE, ROOT / "README.md"], ids=["docs/commands.md", "README.md"])
def test_every_command_that_is_shown_exists_with_its_options(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if page != PAGE:
        text = text.partition("## Using it")[2].partition("\n## ")[0]
    found = list(shown(text))
    assert len(found) > 8
    assert [path for path, options in found if not options <= COMMANDS.get(path, {"missing"} - options)] == []
    assert [path for path, _ in found if path not in COMMANDS] == []


def test_every_command_is_on_the_page() -> None:
    single = {path[0] for path in COMMANDS}
    assert single == {path[0] for path, _ in shown(PAGE.read_text(encoding="utf-8"))}


def test_every_option_of_run_is_on_the_page() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert [option for option in COMMANDS["run",] if f"{option}" not in text and option != "--record"] == []
