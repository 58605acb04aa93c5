# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Finds the line of a scenario file that a warning is about.

A warning begins with a path of fields, `links.edges[0].delay: ...`, or with a part of satellites,
`controller of sat1, sat2: ...`.
"""

import re
from collections.abc import Mapping
from typing import Any

from satform.scenario import Problem, Scenario
from satform.scenario.field_paths import path_parts
from satform.scenario.yaml_reader import line_of

_PATH = re.compile(r"[a-z_]+(?:\[\d+\])?(?:\.[a-z_]+(?:\[\d+\])?)*")
_PART = re.compile(r"([a-z_]+) of ([a-z][a-z0-9_]*)(?:, .*)?")

_Path = tuple[int | str, ...]


def located(sentence: str, scenario: Scenario, tree: Mapping[str, Any], file: str) -> Problem:
    """A warning with its line.

    Args:
        sentence: the warning.
        scenario: that it is about.
        tree: of its file, which knows the lines.
        file: name to use in messages.

    Returns:
        The warning, with the first line of the file where it names no field.
    """
    field, colon, rest = sentence.partition(": ")
    path = _path_of(field, scenario)
    if not colon or not path:
        return Problem(file, 1, "", sentence)
    return Problem(file, line_of(_written(path, tree), tree), field, rest)


def _path_of(field: str, scenario: Scenario) -> _Path:
    if _PATH.fullmatch(field):
        return tuple(int(part) if part.isdigit() else part for part in path_parts(field))
    part = _PART.fullmatch(field)
    names = [satellite.name for satellite in scenario.satellites]
    if part is None or part[2] not in names:
        return ()
    return ("satellites", names.index(part[2]), part[1])


def _written(path: _Path, tree: Mapping[str, Any]) -> _Path:
    """Where a file gives a part of a satellite: among the defaults where the satellite has none itself."""
    if len(path) < 3 or path[0] != "satellites" or not isinstance(path[1], int):
        return path
    satellites = tree.get("satellites")
    own = satellites[path[1]] if isinstance(satellites, list) and path[1] < len(satellites) else {}
    defaults = tree.get("satellite_defaults")
    if path[2] not in own and isinstance(defaults, Mapping) and path[2] in defaults:
        return ("satellite_defaults", *path[2:])
    return path
