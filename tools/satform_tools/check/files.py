# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `check`: validates scenario files and prints errors and warnings."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from satform.scenario import Problem, ScenarioError
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.run import scenario_library


@dataclass(frozen=True)
class Checked:
    """One file and what was found in it.

    Attributes:
        file: as the user named it.
        problems: errors; empty when it can fly.
        warnings: about what is valid but unwise.
    """

    file: str
    problems: tuple[Problem, ...]
    warnings: tuple[str, ...]


def check(files: Sequence[str], *, as_json: bool) -> int:
    """Check scenario files and print what was found.

    Args:
        files: paths, or names of scenarios.
        as_json: whether to print JSON.

    Returns:
        Exit code: 2 when a file cannot fly.
    """
    found = [_check(file) for file in files]
    if as_json:
        console.as_json([_data(entry) for entry in found])
    else:
        for entry in found:
            _print(entry)
    return EXIT_BAD_INPUT if any(entry.problems for entry in found) else EXIT_DONE


def _check(file: str) -> Checked:
    try:
        scenario = scenario_library.load(file)
    except CommandError as error:
        return Checked(file, (Problem(file, None, "", str(error)),), ())
    except ScenarioError as error:
        return Checked(file, tuple(error.problems), ())
    from satform_tools.check import warnings  # noqa: PLC0415 - a file that cannot fly needs none

    return Checked(file, (), tuple(warnings(scenario)))


def _print(entry: Checked) -> None:
    for problem in entry.problems:
        console.error(str(problem))
    for warning in entry.warnings:
        console.line(f"{entry.file}: warning: {warning}", "yellow")
    if not entry.problems:
        console.line(f"{entry.file}: OK", "green")


def _data(entry: Checked) -> dict[str, Any]:
    return {
        "file": entry.file,
        "ok": not entry.problems,
        "problems": [
            {"file": problem.file, "line": problem.line, "field": problem.field, "sentence": problem.sentence}
            for problem in entry.problems
        ],
        "warnings": list(entry.warnings),
    }
