# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `check`: validates scenario files and prints errors and warnings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from satform.campaign.campaign_file import is_campaign
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from satform.files.bounded_file import is_file
from satform.scenario import Problem, Scenario, ScenarioError
from satform.scenario.yaml_reader import read_mapping
from satform_tools import console
from satform_tools.check.annotations import Annotation, github, sarif
from satform_tools.check.locations import located
from satform_tools.errors import CommandError
from satform_tools.output_streams import write
from satform_tools.report.formats import CheckFormat
from satform_tools.run import scenario_library


@dataclass(frozen=True)
class Checked:
    """One file and what was found in it.

    Attributes:
        file: as the user named it.
        path: of the file.
        problems: errors; empty when it can fly.
        warnings: about what is valid but unwise.
    """

    file: str
    path: Path
    problems: tuple[Problem, ...]
    warnings: tuple[Problem, ...]

    def annotations(self) -> Iterator[Annotation]:
        """Errors and warnings with the paths of the files that they are about."""
        levels: tuple[tuple[Literal["error", "warning"], tuple[Problem, ...]], ...] = (
            ("error", self.problems),
            ("warning", self.warnings),
        )
        for level, problems in levels:
            for problem in problems:
                path = self.path if problem.file == self.file else Path(problem.file)
                yield Annotation(level, path.absolute(), problem)


def check(files: Sequence[str], form: CheckFormat, changes: Sequence[str] = ()) -> int:
    """Check files of scenarios and campaigns and print what was found.

    Args:
        files: paths, or names of scenarios or campaigns.
        form: of what is printed.
        changes: `key=value` settings laid over each scenario.

    Returns:
        Exit code: 2 when a file cannot fly.
    """
    found = [_check(file, changes) for file in files]
    code = EXIT_BAD_INPUT if any(entry.problems for entry in found) else EXIT_DONE
    annotations = [annotation for entry in found for annotation in entry.annotations()]
    if form is CheckFormat.JSON:
        console.as_json([_data(entry) for entry in found])
    elif form is CheckFormat.SARIF:
        console.as_json(sarif(annotations, version("satform"), code))
    else:
        if form is CheckFormat.GITHUB:
            write(github(annotations))
        for entry in found:
            _print(entry, summary_only=form is CheckFormat.GITHUB)
    return code


def _check(file: str, changes: Sequence[str]) -> Checked:
    campaign = _campaign(file)
    if campaign is not None:
        if changes:
            raise CommandError(
                f"{file} is a campaign: --set changes fields of scenarios; remove it or {file}"
            )
        from satform_tools.check import campaigns  # noqa: PLC0415 - checks of scenarios need no scipy.stats

        try:
            return Checked(file, campaign, (), tuple(campaigns.check(campaign, file)))
        except ScenarioError as error:
            return Checked(file, campaign, tuple(error.problems), ())
    path = Path(file)
    try:
        path = scenario_library.find(file)
        scenario = scenario_library.load(file, changes)
    except CommandError as error:
        return Checked(file, path, (Problem(file, None, "", str(error)),), ())
    except ScenarioError as error:
        return Checked(file, path, tuple(error.problems), ())
    return Checked(file, path, (), tuple(_warnings(scenario, path, file)))


def _warnings(scenario: Scenario, path: Path, file: str) -> Iterator[Problem]:
    from satform_tools.check import warnings  # noqa: PLC0415 - a file that cannot fly needs none

    tree = read_mapping(path.read_text(encoding="utf-8"), file, "a scenario")
    return (located(sentence, scenario, tree, file) for sentence in warnings(scenario))


def _campaign(file: str) -> Path | None:
    """The file of a campaign; None where it is none, or cannot be read."""
    shipped = scenario_library.SCENARIOS / "campaigns" / f"{file}.yaml"
    path = shipped if is_file(shipped) and file not in scenario_library.names() else Path(file)
    return path if is_campaign(path) else None


def _print(entry: Checked, *, summary_only: bool) -> None:
    for problem in () if summary_only else entry.problems:
        console.error(str(problem))
    for warning in () if summary_only else entry.warnings:
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
