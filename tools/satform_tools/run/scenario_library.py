# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Shipped scenarios by name: finds and loads them, with the nearest spelling in errors."""

from collections.abc import Iterable
from pathlib import Path

from satform.scenario import Scenario, load_scenario
from satform_tools import console
from satform_tools.run import shipped_files

ROOT = shipped_files.ROOT
SCENARIOS = shipped_files.SCENARIOS


def names() -> list[str]:
    """Names of the shipped scenarios."""
    return shipped_files.names(SCENARIOS)


def find(scenario: str) -> Path:
    """The file of a scenario.

    Args:
        scenario: name of one in the project's folder, or the path of a file.

    Returns:
        The file; a path is returned whether or not there is such a file.

    Raises:
        CommandError: nothing of that name is known.
    """
    return shipped_files.find(scenario, SCENARIOS, "scenario", "or the path of a YAML file")


def load(scenario: str, changes: Iterable[str] = (), seed: int | None = None) -> Scenario:
    """Load a scenario; expectations that need a longer flight are omitted, with a note.

    Args:
        scenario: its name or the path of its file.
        changes: `key=value` settings laid over the file.
        seed: laid over the file's when given.

    Returns:
        The scenario.

    Raises:
        CommandError: nothing of that name is known.
        ScenarioError: it cannot fly.
    """
    seeds = () if seed is None else (f"seed={seed}",)
    return load_scenario(find(scenario), (*changes, *seeds), console.note)
