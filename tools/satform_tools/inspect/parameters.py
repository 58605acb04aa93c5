# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads and sets parameters of a running node through its services."""

import difflib
import math
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import parameter_value_to_python

from satform.common.angle_text import is_angle
from satform.scenario import ScenarioError
from satform.scenario.yaml_reader import read_value
from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError
from satform_tools.inspect.graph import known_node
from satform_tools.inspect.observer_node import Observer
from satform_tools.inspect.service_call import ask

_KINDS = {
    ParameterType.PARAMETER_BOOL: ("bool", "bool_value", bool),
    ParameterType.PARAMETER_INTEGER: ("integer", "integer_value", int),
    ParameterType.PARAMETER_DOUBLE: ("double", "double_value", float),
    ParameterType.PARAMETER_STRING: ("string", "string_value", str),
    ParameterType.PARAMETER_BOOL_ARRAY: ("bool array", "bool_array_value", bool),
    ParameterType.PARAMETER_INTEGER_ARRAY: ("integer array", "integer_array_value", int),
    ParameterType.PARAMETER_DOUBLE_ARRAY: ("double array", "double_array_value", float),
    ParameterType.PARAMETER_STRING_ARRAY: ("string array", "string_array_value", str),
}
"""Name, field of the message, and Python's type of each kind of parameter."""


def list_all(observer: Observer, node: str, *, as_json: bool) -> None:
    """Print the names and values of all parameters of a node."""
    full = _find(observer, node)
    names = _names(observer, full)
    values = dict(zip(names, _values(observer, full, names), strict=True))
    if as_json:
        console.as_json(values)
    else:
        console.table(Table(("parameter", "value"), [(name, _text(value)) for name, value in values.items()]))


def get(observer: Observer, node: str, name: str, *, as_json: bool) -> None:
    """Print the value of a parameter."""
    full = _find(observer, node)
    (value,) = _values(observer, full, [_known(observer, full, name)])
    if as_json:
        console.as_json(value)
    else:
        console.line(_text(value))


def describe(observer: Observer, node: str, name: str, *, as_json: bool) -> None:
    """Print type, meaning, bounds and value of a parameter."""
    full = _find(observer, node)
    _known(observer, full, name)
    descriptor = _descriptor(observer, full, name)
    (value,) = _values(observer, full, [name])
    described = {
        "name": name,
        "type": _KINDS[descriptor.type][0] if descriptor.type in _KINDS else "not set",
        "value": value,
        "description": descriptor.description,
        "constraints": _constraints(descriptor),
        "read_only": descriptor.read_only,
    }
    if as_json:
        console.as_json(described)
        return
    for key, entry in described.items():
        if entry not in ("", None):
            console.line(f"{key.replace('_', ' ')}: {_text(entry)}")


def change(observer: Observer, node: str, name: str, text: str, *, as_json: bool) -> bool:
    """Set a parameter, and print the reply of the node.

    Args:
        observer: in the formation's domain.
        node: name of the node.
        name: of the parameter.
        text: the value as in a scenario file; whole numbers do for doubles, one number for several.
        as_json: print JSON.

    Returns:
        Whether the node has accepted it.

    Raises:
        CommandError: there is no such node or parameter, or the value is of another type.
    """
    full = _find(observer, node)
    _known(observer, full, name)
    value = as_parameter(_descriptor(observer, full, name).type, name, text)
    request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
    (result,) = ask(observer, SetParameters, f"{full}/set_parameters", request).results
    if as_json:
        console.as_json({"successful": result.successful, "reason": result.reason})
    elif result.successful:
        console.line(f"{full} {name}: " + (result.reason or "changed"))
    else:
        console.error(f"{full} {name} stays as it is: {result.reason or 'the node gives no reason'}")
    return bool(result.successful)


def as_parameter(kind: int, name: str, text: str) -> ParameterValue:
    """A value of a declared type from text of the command line.

    Raises:
        CommandError: it is of another type.
    """
    title, field, python = _KINDS.get(kind, _KINDS[ParameterType.PARAMETER_STRING])
    try:
        typed = text if python is str and not title.endswith("array") else read_value(text, name)
    except ScenarioError:
        typed = None
    many = title.endswith("array")
    if python is float and is_angle(typed):
        # The node knows which of its parameters are angles.
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=typed)
    if (
        kind == ParameterType.PARAMETER_DOUBLE_ARRAY
        and isinstance(typed, int | float)
        and _fits(typed, float)
    ):
        # One number for all axes; the node rejects it where it needs several.
        return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=float(typed))
    entries = typed if many and isinstance(typed, list) else [typed]
    if many != isinstance(typed, list) or not all(_fits(entry, python) for entry in entries):
        raise CommandError(f"{name}: found {text!r}; it has to be of the type {title}, {_EXAMPLES[title]}")
    converted = [python(entry) for entry in entries]
    return ParameterValue(type=kind, **{field: converted if many else converted[0]})


_EXAMPLES = {
    "bool": "true or false",
    "integer": "such as 3",
    "double": "such as 0.5",
    "string": "any text",
    "bool array": "such as '[true, false]'",
    "integer array": "such as '[1, 2]'",
    "double array": "such as '[0.1, 0.1, 0.1]'",
    "string array": "such as '[sat1, sat2]'",
}


def _fits(value: Any, python: type) -> bool:
    if python is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return type(value) is python


def _find(observer: Observer, node: str) -> str:
    observer.find_formation()
    return known_node(observer, node)


def _names(observer: Observer, node: str) -> list[str]:
    reply = ask(observer, ListParameters, f"{node}/list_parameters", ListParameters.Request())
    return sorted(reply.result.names)


def _values(observer: Observer, node: str, names: list[str]) -> list[Any]:
    request = GetParameters.Request(names=names)
    values = ask(observer, GetParameters, f"{node}/get_parameters", request).values
    found = [parameter_value_to_python(value) for value in values]
    return [
        value if isinstance(value, str | None) or not hasattr(value, "__len__") else list(value)
        for value in found
    ]


def _descriptor(observer: Observer, node: str, name: str) -> ParameterDescriptor:
    request = DescribeParameters.Request(names=[name])
    (descriptor,) = ask(observer, DescribeParameters, f"{node}/describe_parameters", request).descriptors
    return descriptor


def _known(observer: Observer, node: str, name: str) -> str:
    names = _names(observer, node)
    if name not in names:
        close = difflib.get_close_matches(name, names, n=1)
        hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"
        raise CommandError(f"{node} has no parameter {name!r}; {hint}")
    return name


def _constraints(descriptor: ParameterDescriptor) -> str:
    parts = [
        f"from {limits.from_value:g} to {limits.to_value:g}"
        for limits in (*descriptor.floating_point_range, *descriptor.integer_range)
    ]
    return "; ".join(
        [*parts, *([descriptor.additional_constraints] if descriptor.additional_constraints else [])]
    )


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else str(value)
