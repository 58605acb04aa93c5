# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Settings laid over a scenario's data, such as `timing.step=1.0`."""

from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from typing import Any

from satform.common.spec import FieldPath
from satform.scenario.errors import Problem, ScenarioError
from satform.scenario.field_paths import entries_text, entry_indices, path_parts
from satform.scenario.yaml_reader import found, read_value


def apply_changes(data: Any, changes: Iterable[str]) -> dict[FieldPath, str]:
    """Lay settings in text over a scenario's data.

    Args:
        data: of the scenario; is changed.
        changes: `key=value`, the value as YAML; for the key see `set_value`.

    Returns:
        Where each setting comes from, such as `--set seed=1`, by the path that it has changed.

    Raises:
        ScenarioError: a setting cannot be laid over the data; all of these at once.
    """
    settings = []
    complaints = []
    for change in changes:
        source = f"--set {change}"
        key, equals, text = change.partition("=")
        if not equals or not key:
            complaints.append(
                Problem(source, None, "", "is not of the form key=value, such as timing.step=1.0")
            )
            continue
        try:
            settings.append((source, key, read_value(text, source)))
        except ScenarioError as error:
            sentence = f"the value {found(text)}: {error.problems[0].sentence}"
            complaints.append(Problem(source, None, "", sentence))
    return _lay_over(data, settings, complaints)


def apply_values(data: Any, values: Mapping[str, Any]) -> dict[FieldPath, str]:
    """Lay settings with plain values over a scenario's data.

    Args:
        data: of the scenario; is changed.
        values: plain values by key; for the key see `set_value`.

    Returns:
        Where each setting comes from, such as `with_ 'seed'`, by the path that it has changed.

    Raises:
        ScenarioError: a setting cannot be laid over the data; all of these at once.
    """
    return _lay_over(data, [(f"with_ {key!r}", key, value) for key, value in values.items()], [])


def _lay_over(
    data: Any, settings: Iterable[tuple[str, str, Any]], complaints: list[Problem]
) -> dict[FieldPath, str]:
    changed: dict[FieldPath, str] = {}
    for source, key, value in settings:
        outcome = set_value(data, key, value)
        if isinstance(outcome, str):
            complaints.append(Problem(source, None, "", outcome))
        else:
            changed.update(dict.fromkeys(outcome, source))
    if complaints:
        raise ScenarioError(complaints)
    return changed


def set_value(data: Any, key: str, value: Any) -> list[FieldPath] | str:
    """Set one field of a scenario's data, or the same field of several entries of a list.

    Args:
        data: of the scenario; is changed. A satellite that has none of a part of its own gets a copy of that
            of `satellite_defaults` before a field of the part is set.
        key: path of a field, see `satform.scenario.field_paths`.
        value: plain.

    Returns:
        The paths that were set; a sentence where there is no such place.
    """
    parts = path_parts(key)
    nodes: list[tuple[FieldPath, Any]] = [((), data)]
    for number, part in enumerate(parts):
        steps: list[tuple[FieldPath, Any, int | str]] = []
        for path, node in nodes:
            own = _steps(node, part)
            if own is None:
                return _unknown([*path, part], node)
            steps += [(path, node, step) for step in own]
        if number == len(parts) - 1:
            for _, node, step in steps:
                node[step] = deepcopy(value)
            return [(*path, step) for path, _, step in steps]
        for path, node, step in steps:
            if isinstance(node, dict) and node.get(str(step)) is None:
                node[step] = _inherited(data, path, str(step))
        nodes = [((*path, step), node[step]) for path, node, step in steps]
    return []


def _inherited(data: Any, path: FieldPath, part: str) -> Any:
    """What a satellite takes a part from; empty for anything else."""
    defaults = data.get("satellite_defaults") if len(path) == 2 and path[0] == "satellites" else None
    return deepcopy(defaults.get(part) or {}) if isinstance(defaults, dict) else {}


def _steps(node: Any, part: str) -> Sequence[int | str] | None:
    """A part of a key as keys or indices of a node; None where the node has no such place."""
    if isinstance(node, dict):
        return [part]
    return entry_indices(part, _names(node)) if isinstance(node, list) else None


def _names(node: list[Any]) -> list[str]:
    """Names of a list's entries; empty for an entry that has none."""
    return [str(entry.get("name", "")) if isinstance(entry, dict) else "" for entry in node]


def _unknown(path: list[int | str], node: Any) -> str:
    sentence = f"there is no {'.'.join(map(str, path))} in the scenario"
    return f"{sentence}; {entries_text(_names(node))}" if isinstance(node, list) else sentence
