# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `list`: a table of the shipped scenarios."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from satform_tools import console
from satform_tools.console import Table
from satform_tools.run import result_cache, shipped_files
from satform_tools.run.shipped_files import ROOT, SCENARIOS

if TYPE_CHECKING:
    from satform.scenario import Scenario


def show(*, as_json: bool) -> int:
    """Print name, title, satellites, duration and graph of each scenario.

    Args:
        as_json: whether for a machine.

    Returns:
        Exit code: 2 when a scenario cannot be read, with an error on standard error.
    """
    sources = sorted(path for path in SCENARIOS.rglob("*") if path.is_file())
    entries, problems = result_cache.stored("list", ROOT, (Path(__file__), *sources), _entries_and_problems)
    if as_json:
        console.as_json(entries)
    else:
        console.table(_table(entries))
    for problem in problems:
        console.error(problem)
    return EXIT_BAD_INPUT if problems else EXIT_DONE


def _entries_and_problems() -> tuple[list[dict[str, Any]], list[str]]:
    """An entry for each scenario that can be read, and what is wrong with the others."""
    from satform.scenario import ScenarioError  # noqa: PLC0415 - not needed where the list is stored
    from satform_tools.run import scenario_library  # noqa: PLC0415

    entries: list[dict[str, Any]] = []
    problems: list[str] = []
    for name in shipped_files.names(SCENARIOS):
        try:
            entries.append(_entry(name, scenario_library.load(name)))
        except ScenarioError as error:
            problems += map(str, error.problems)
    return entries, problems


def _entry(name: str, scenario: "Scenario") -> dict[str, Any]:
    return {
        "name": name,
        "title": scenario.title,
        "satellites": len(scenario.satellites),
        "duration": scenario.timing.duration,
        "step": scenario.timing.step,
        "graph": getattr(scenario.graph, "kind", ""),
        "expectations": len(scenario.expect),
    }


def _table(entries: list[dict[str, Any]]) -> Table:
    rows = [
        (
            entry["name"],
            str(entry["satellites"]),
            entry["graph"],
            f"{entry['duration']:g}",
            f"{entry['step']:g}",
            entry["title"],
        )
        for entry in entries
    ]
    return Table(
        ("scenario", "satellites", "graph", "duration [s]", "step [s]", "what is flown"),
        rows,
        frozenset({1, 3, 4}),
    )
