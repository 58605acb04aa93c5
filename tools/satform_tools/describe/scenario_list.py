# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The command `list`: a table of the shipped scenarios."""

from typing import Any

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from satform.scenario import Scenario, ScenarioError
from satform_tools import console
from satform_tools.console import Table
from satform_tools.run import scenario_library


def show(*, as_json: bool) -> int:
    """Print name, title, satellites, duration and graph of each scenario.

    Args:
        as_json: whether for a machine.

    Returns:
        Exit code: 2 when a scenario cannot be read, with an error on standard error.
    """
    entries, problems = [], []
    for name in scenario_library.names():
        try:
            entries.append(_entry(name, scenario_library.load(name)))
        except ScenarioError as error:
            problems += error.problems
    if as_json:
        console.as_json(entries)
    else:
        console.table(_table(entries))
    for problem in problems:
        console.error(str(problem))
    return EXIT_BAD_INPUT if problems else EXIT_DONE


def _entry(name: str, scenario: Scenario) -> dict[str, Any]:
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
