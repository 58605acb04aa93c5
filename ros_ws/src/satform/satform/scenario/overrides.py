# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Settings laid over a scenario's data, such as `timing.step=1.0`."""

import re
from collections.abc import Iterable
from typing import Any

from satform.scenario.error_messages import Path as FieldPath
from satform.scenario.errors import Problem, ScenarioError
from satform.scenario.yaml_reader import found, read_value

_IN_BRACKETS = re.compile(r"\[([^\[\]]*)\]")
_MOST_NAMES = 8
"""Entries of a list that a message names."""


def apply_changes(data: Any, changes: Iterable[str]) -> dict[FieldPath, str]:
    """Lay settings over a scenario's data.

    Args:
        data: of the scenario; is changed.
        changes: `key=value`, the value as YAML. A key is the path of a field as messages print it: fields
            with dots between them, and for an entry of a list its place from 0 or its name:
            `satellites[0].scale`, `satellites.0.scale`, `satellites[sat1].scale`, `satellites.sat1.scale`.

    Returns:
        Each setting by the path that it has changed.

    Raises:
        ScenarioError: a setting cannot be laid over the data; all of these at once.
    """
    changed: dict[FieldPath, str] = {}
    complaints = []
    for change in changes:
        outcome = _apply_change(data, change)
        if isinstance(outcome, str):
            complaints.append(Problem(f"--set {change}", None, "", outcome))
        else:
            changed[outcome] = change
    if complaints:
        raise ScenarioError(complaints)
    return changed


def _apply_change(data: Any, change: str) -> FieldPath | str:
    """The path that was changed, or why it could not be."""
    key, equals, text = change.partition("=")
    if not equals or not key:
        return "is not of the form key=value, such as timing.step=1.0"
    try:
        value = read_value(text, f"--set {change}")
    except ScenarioError as error:
        return f"the value {found(text)}: {error.problems[0].sentence}"
    path: list[int | str] = []
    node = data
    *parents, last = _IN_BRACKETS.sub(r".\1", key).split(".")
    for part in parents:
        step = _step(node, part)
        if step is None:
            return _unknown([*path, part], node)
        path.append(step)
        if isinstance(node, dict) and node.get(part) is None:
            node[part] = {}
        node = node[step]
    step = _step(node, last)
    if step is None:
        return _unknown([*path, last], node)
    node[step] = value
    return (*path, step)


def _step(node: Any, part: str) -> int | str | None:
    """A part of a key as a key or index of a node; None where the node has no such place."""
    if isinstance(node, dict):
        return part
    if not isinstance(node, list):
        return None
    # Digits of other scripts are digits too, and the longest numbers are refused by Python.
    if part.isascii() and part.isdigit() and len(part) < 9:
        return int(part) if int(part) < len(node) else None
    names = _names(node)
    return names.index(part) if part and part in names else None


def _names(node: list[Any]) -> list[str]:
    """Names of a list's entries; empty for an entry that has none."""
    return [str(entry.get("name", "")) if isinstance(entry, dict) else "" for entry in node]


def _unknown(path: list[int | str], node: Any) -> str:
    sentence = f"there is no {'.'.join(map(str, path))} in the scenario"
    if not isinstance(node, list) or not node:
        return sentence
    names = [name for name in _names(node) if name]
    listed = ", ".join(names[:_MOST_NAMES]) + (", ..." if len(names) > _MOST_NAMES else "")
    by_name = f", or by name: {listed}" if names else ""
    return f"{sentence}; entries are counted from 0 to {len(node) - 1}{by_name}"
