# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""From a YAML file to a `Scenario`, or to all that is wrong with it."""

from collections.abc import Callable, Iterable
from pathlib import Path

from satform.files.bounded_file import too_large
from satform.files.durable_file import write_durably
from satform.files.named_file import FileSource
from satform.scenario.checking import checked
from satform.scenario.errors import Problem, ScenarioError
from satform.scenario.model import Scenario
from satform.scenario.overrides import apply_changes
from satform.scenario.text_file import MAXIMUM_FILE_BYTES, first_problems, read_text_file
from satform.scenario.truncation import beyond_the_end, excluded, within_the_end
from satform.scenario.yaml_reader import plain, read_mapping

_SCENARIO = "a scenario"


def load_scenario(
    path: str | Path,
    changes: Iterable[str] = (),
    remark: Callable[[str], None] | None = None,
    *,
    recorded: bool = False,
) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: the YAML file; files that it names count from its folder.
        changes: `key=value` settings laid over the file, with paths of fields and YAML values, for
            example `timing.step=1.0` or `satellites[0].arc_length=100.0`. Where they shorten the
            flight, what the file expects, breaks or changes beyond its new end is left out.
        remark: called with a sentence about what was left out.
        recorded: whether it comes with a flight that it was flown by, whose expectations need no source.

    Returns:
        The scenario, complete and consistent.

    Raises:
        ScenarioError: the file cannot be read or cannot fly; all problems at once.
    """
    text = read_text_file(path, _SCENARIO)
    return parse_scenario(text, str(path), changes, remark, FileSource(Path(path).parent, recorded=recorded))


SCENARIO_FILE = "scenario.json"
"""In the folder of a run or a campaign: its scenario."""


def save_scenario(scenario: Scenario, path: Path) -> None:
    """Write a scenario to a file, with copies of the files that it names beside it.

    Args:
        scenario: to be written.
        path: of the new file.

    Raises:
        OSError: it cannot be written.
    """
    for name, content in scenario.files().items():
        write_durably(path.parent / name, content)
    write_durably(path, scenario.to_json().encode())


def parse_scenario(
    text: str,
    file: str = "<text>",
    changes: Iterable[str] = (),
    remark: Callable[[str], None] | None = None,
    files: FileSource | None = None,
) -> Scenario:
    """Check the text of a scenario.

    Args:
        text: YAML 1.2.
        file: the name to use in messages.
        changes: as for `load_scenario`.
        remark: as for `load_scenario`.
        files: where the files that it names are looked for; the working directory when left out.

    Returns:
        The scenario, complete and consistent.

    Raises:
        ScenarioError: the text cannot fly; all problems at once.
    """
    if len(text) > MAXIMUM_FILE_BYTES:
        sentence = too_large(len(text), MAXIMUM_FILE_BYTES, _SCENARIO)
        raise ScenarioError([Problem(file, None, "", sentence)])
    tree = read_mapping(text, file, "a scenario is a mapping of fields such as name, orbit, satellites")
    data = plain(tree)
    written = plain(tree)
    changed = apply_changes(data, changes)
    beyond = beyond_the_end(written, data, changed)
    flown = within_the_end(data, beyond)
    scenario, found = checked(Scenario, flown, tree, file, changed, files)
    if found and beyond:
        # Found once more in the whole, where every problem has the place that the file gives it.
        outside = {f"{field}[{row}]" for field, rows in beyond.items() for row in rows}
        _, every = checked(Scenario, data, tree, file, changed, files)
        found = [problem for problem in every if not problem.field.startswith(tuple(outside))] or found
    if scenario is None or found:
        raise ScenarioError(first_problems(sorted(found, key=lambda problem: problem.line or 0)))
    if remark is not None:
        for sentence in excluded(beyond):
            remark(sentence)
    return scenario
