# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `check`: validates scenario files and prints errors and warnings."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from satform.campaign.campaign_file import is_campaign
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from satform.files.bounded_file import is_file
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
    warnings: tuple[Problem, ...]


def check(files: Sequence[str], *, as_json: bool) -> int:
    """Check files of scenarios and campaigns and print what was found.

    Args:
        files: paths, or names of scenarios or campaigns.
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
    campaign = _campaign(file)
    if campaign is not None:
        from satform_tools.check import campaigns  # noqa: PLC0415 - checks of scenarios need no scipy.stats

        try:
            return Checked(file, (), tuple(campaigns.check(campaign, file)))
        except ScenarioError as error:
            return Checked(file, tuple(error.problems), ())
    try:
        scenario = scenario_library.load(file)
    except CommandError as error:
        return Checked(file, (Problem(file, None, "", str(error)),), ())
    except ScenarioError as error:
        return Checked(file, tuple(error.problems), ())
    from satform_tools.check import warnings  # noqa: PLC0415 - a file that cannot fly needs none

    return Checked(file, (), tuple(Problem(file, None, "", sentence) for sentence in warnings(scenario)))


def _campaign(file: str) -> Path | None:
    """The file of a campaign; None where it is none, or cannot be read."""
    shipped = scenario_library.SCENARIOS / "campaigns" / f"{file}.yaml"
    path = shipped if is_file(shipped) and file not in scenario_library.names() else Path(file)
    return path if is_campaign(path) else None


def _print(entry: Checked) -> None:
    for problem in entry.problems:
        console.error(str(problem))
    for warning in entry.warnings:
        location = warning.file if warning.line is None else f"{warning.file}:{warning.line}"
        console.line(f"{location}: warning: {_text(warning)}", "yellow")
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
        "warnings": [_text(warning) for warning in entry.warnings],
    }


def _text(warning: Problem) -> str:
    return f"{warning.field}: {warning.sentence}" if warning.field else warning.sentence
