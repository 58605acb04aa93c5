# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts ROS messages to plain data and back, by the fields of their definitions."""

import difflib
import importlib
import re
from array import array
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from satform_tools.errors import CommandError

_MANY = re.compile(
    r"sequence<(?P<sequence>(?:[^<>,]|<[^<>]*>)+)(?:, *(?P<most>\d+))?>|(?P<array>.+)\[(?P<count>\d+)\]"
)
"""A field of many values as rosidl's Python writes its type."""

_ELEMENT = re.compile(r"([^.\[\]]+)((?:\[\d+\])*)")


def interface(name: str) -> Any:
    """The class of a message or service type.

    Args:
        name: such as `satform_msgs/msg/Command`.

    Raises:
        CommandError: no such type can be imported here.
    """
    package, _, rest = name.partition("/")
    group, _, kind = rest.rpartition("/")
    try:
        return getattr(importlib.import_module(f"{package}.{group or 'msg'}"), kind)
    except (ImportError, AttributeError, TypeError, ValueError):
        raise CommandError(f"the type {name} is not among the packages of this environment") from None


def plain(value: Any) -> Any:
    """A message or a field of one as dictionaries, lists, strings and numbers."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, np.ndarray | array):
        return value.tolist()
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(entry) for entry in value]
    return value


def flat(data: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers and strings of plain data, each with its dotted name."""
    if isinstance(data, dict):
        for name, value in data.items():
            yield from flat(value, f"{prefix}.{name}" if prefix else name)
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from flat(value, f"{prefix}[{index}]")
    else:
        yield prefix, data


def pick(data: Any, field: str) -> Any:
    """The part of plain data at a dotted name such as `position.x` or `alive[0]`.

    Raises:
        CommandError: there is nothing of that name.
    """
    for part in field.split("."):
        match = _ELEMENT.fullmatch(part)
        name = match[1] if match else part
        if not isinstance(data, dict) or name not in data:
            there = f"there are {', '.join(data)}" if isinstance(data, dict) else "it has no fields"
            raise CommandError(f"--field {field}: there is no {part!r}; {there}")
        data = data[name]
        for index in map(int, re.findall(r"\d+", match[2]) if match else []):
            if not isinstance(data, list) or index >= len(data):
                length = f"has {len(data)} entries" if isinstance(data, list) else "is no list"
                raise CommandError(f"--field {field}: there is no entry {index}: {name} {length}")
            data = data[index]
    return data


def fill(message: Any, data: Any, path: str = "") -> Any:
    """Set the fields of a message from plain data; those that are not named stay as they are.

    Args:
        message: to be filled.
        data: names and values.
        path: dotted name of the message in the one that it is part of.

    Returns:
        The message.

    Raises:
        CommandError: a name or a value does not fit.
    """
    kinds = message.get_fields_and_field_types()
    what = path or type(message).__name__.removesuffix("_Request")
    if not isinstance(data, dict):
        wanted = "{" + ", ".join(f"{name}: ..." for name in kinds) + "}"
        raise CommandError(f"{what}: found {data!r}; it has to be of the form {wanted}")
    for name, value in data.items():
        if name not in kinds:
            close = difflib.get_close_matches(str(name), kinds, n=1)
            known = f"did you mean {close[0]}?" if close else f"there are {', '.join(kinds) or 'none'}"
            raise CommandError(f"{what}: there is no field {name!r}; {known}")
        _set(message, name, value, f"{path}.{name}" if path else name)
    return message


def _set(message: Any, name: str, value: Any, path: str) -> None:
    old = getattr(message, name)
    kind = message.get_fields_and_field_types()[name]
    if hasattr(old, "get_fields_and_field_types"):
        fill(old, value, path)
        return
    try:
        setattr(message, name, _converted(kind, value, path))
    except (AssertionError, TypeError, ValueError, OverflowError):
        raise CommandError(f"{path}: found {value!r}; it has to be of the type {kind}") from None


def _converted(kind: str, value: Any, path: str) -> Any:
    """A value checked and converted for a field; the setters of rclpy check nothing by default."""
    many = _MANY.fullmatch(kind)
    if many:
        inner, most, count = many["sequence"] or many["array"], many["most"], many["count"]
        if not isinstance(value, list):
            raise TypeError
        if (count and len(value) != int(count)) or (most and len(value) > int(most)):
            raise ValueError
        return [_converted(inner, entry, f"{path}[{index}]") for index, entry in enumerate(value)]
    if "/" in kind:
        package, _, short = kind.partition("/")
        return fill(interface(f"{package}/msg/{short}")(), value, path)
    whole = isinstance(value, int) and not isinstance(value, bool)
    if kind in ("float", "double"):
        if not (whole or isinstance(value, float)):
            raise TypeError
        return float(value)
    if kind == "boolean" or "string" in kind:
        if not isinstance(value, bool if kind == "boolean" else str):
            raise TypeError
        return value
    lowest, highest = _range(kind)
    if not whole or not lowest <= value <= highest:
        raise ValueError
    return bytes([value]) if kind == "octet" else value


def _range(kind: str) -> tuple[int, int]:
    """Smallest and largest value of a whole-number type such as `uint8` or `int64`."""
    if kind == "octet":
        return 0, 255
    bits = int(kind.lstrip("uint"))
    return (0, 2**bits - 1) if kind.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
