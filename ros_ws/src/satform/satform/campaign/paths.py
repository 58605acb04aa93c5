# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""From the path of a dispersion to the fields of a scenario that it means."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from satform.common.angle_text import PATTERNS
from satform.common.spec import FieldPath, Spec, choices, validators
from satform.scenario import Scenario
from satform.scenario.field_errors import dotted, nearest
from satform.scenario.field_paths import entries_text, entry_indices, path_parts

Scalar = bool | int | float | str


class PathError(ValueError):
    """A path that leads to no field that can be dispersed; its text says why."""


@dataclass(frozen=True)
class Target:
    """One field of a scenario, or one entry of a vector.

    Attributes:
        path: names of fields and indices in lists.
        value: of the scenario itself; None where the field is optional and not given.
        types: what the field holds: `float`, `int`, `bool`, `str`, one or several.
        angle: pattern of the text that it takes for an angle or a rate; empty where it takes none.
    """

    path: FieldPath
    value: Scalar | None
    types: frozenset[type]
    angle: str

    @property
    def text(self) -> str:
        """The path as messages print it."""
        return dotted(self.path)

    @property
    def is_number(self) -> bool:
        """Whether the field holds numbers."""
        return bool(self.types & {float, int})

    @property
    def is_whole(self) -> bool:
        """Whether the field holds whole numbers and no others."""
        return int in self.types and float not in self.types


@dataclass(frozen=True)
class _Node:
    """Where a walk along a path is.

    Attributes:
        path: so far.
        node: what is there, of the validated scenario.
        annotation: declared type of it.
        field: the nearest field on the way; None at the top.
    """

    path: FieldPath
    node: Any
    annotation: Any
    field: FieldInfo | None


def targets(scenario: Scenario, path: str) -> list[Target]:
    """The fields that a path means.

    Args:
        scenario: validated; what a satellite leaves out is that of `satellite_defaults`.
        path: of a field, see `satform.scenario.field_paths`.

    Returns:
        In order of the entries; at least one.

    Raises:
        PathError: there is no such field, it is not given in the scenario, or holds no single value.
    """
    nodes = [_Node((), scenario, type(scenario), None)]
    for part in path_parts(path):
        nodes = [inner for current in nodes for inner in _step(current, part, scenario)]
    if not nodes:
        raise PathError("means no field: the list is empty")
    return [_target(current) for current in nodes]


def _step(current: _Node, part: str, scenario: Scenario) -> list[_Node]:
    node = current.node
    if isinstance(node, Spec):
        known = type(node).model_fields
        if part not in known:
            raise PathError(f"there is no {_joined(current.path, part)}{nearest(part, sorted(known))}")
        return [_Node((*current.path, part), getattr(node, part), known[part].annotation, known[part])]
    if isinstance(node, tuple):
        return [
            _Node((*current.path, index), _entry(current.path, node, index, scenario), inner, current.field)
            for index in _indices(current.path, node, part)
            for inner in [_entry_annotation(current.annotation, index)]
        ]
    if node is None:
        raise PathError(
            f"the scenario has no {dotted(current.path)}: give it one, for example with set, whose {part} "
            "can then be dispersed"
        )
    raise PathError(f"{dotted(current.path)} is a single value; it has no {part}")


def _indices(path: FieldPath, node: tuple[Any, ...], part: str) -> Sequence[int]:
    names = [str(getattr(entry, "name", "")) for entry in node]
    found = entry_indices(part, names)
    if found is None:
        raise PathError(f"there is no {_joined(path, part)} in the scenario; {entries_text(names)}")
    return found


def _entry(path: FieldPath, node: tuple[Any, ...], index: int, scenario: Scenario) -> Any:
    """An entry; a satellite with what it takes from `satellite_defaults`."""
    return scenario.satellite(index) if path == ("satellites",) else node[index]


def _joined(path: FieldPath, part: str) -> str:
    inside = f"[{part}]" if part.isdigit() else f".{part}"
    return f"{dotted(path)}{inside}" if path else part


def _entry_annotation(annotation: Any, index: int) -> Any:
    """Declared type of an entry of a tuple."""
    for choice in choices(annotation):
        if get_origin(choice) is tuple:
            parts = get_args(choice)
            return parts[0] if parts[-1] is ... else parts[min(index, len(parts) - 1)]
    return None


def _target(current: _Node) -> Target:
    found: set[type] = set()
    for choice in choices(current.annotation):
        if get_origin(choice) is Literal:
            found |= {type(value) for value in get_args(choice)}
        elif choice in (float, int, bool, str):
            found.add(choice)
    if not found or isinstance(current.node, tuple | Spec):
        entries = (
            f"; name one of its entries, such as {dotted(current.path)}[0], or [*] for all"
            if isinstance(current.node, tuple)
            else ""
        )
        raise PathError(f"{dotted(current.path)} holds no single number, text or true and false{entries}")
    taken = () if current.field is None else validators(current.field)
    angle = next((PATTERNS[function] for function in taken if function in PATTERNS), "")
    return Target(current.path, current.node, frozenset(found), angle)
