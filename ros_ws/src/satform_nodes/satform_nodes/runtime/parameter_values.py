# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Values of parameters as people type them: what a scenario file takes for a field, its parameter takes.

`ros2 param set`, `-p` and parameter files go by YAML 1.1, in which `1e3` is text and `[1, 2, 3]` is a list of
whole numbers. A parameter that is declared as doubles takes those too, by the one reader of scenario files.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from pydantic_core import PydanticCustomError
from rclpy.parameter import Parameter

from satform.scenario import ScenarioError
from satform.scenario.field_errors import A_LIST, A_NUMBER, shortened
from satform.scenario.yaml_reader import read_value

_NUMBERS = {Parameter.Type.DOUBLE, Parameter.Type.DOUBLE_ARRAY}


@dataclass(frozen=True)
class Forms:
    """In which forms a scenario file takes a field besides numbers, one for each of the parameter's.

    Attributes:
        one_for_all: whether one number stands for as many equal ones as there are.
        angle: makes a number of text such as `45 deg`; None where no such text is taken.
    """

    one_for_all: bool = False
    angle: Callable[[Any], Any] | None = None


def as_declared(parameter: Parameter, declared: Parameter, forms: Forms) -> Parameter:
    """A parameter's new value in the type with which it was declared.

    Args:
        parameter: with the new value.
        declared: the same parameter as it is.
        forms: of the parameter.

    Returns:
        The parameter with numbers of the declared type; as given when it is declared as something else.

    Raises:
        ValueError: the value is not of that type; the text says what is wrong with it.
    """
    if declared.type_ not in _NUMBERS or parameter.type_ in {declared.type_, Parameter.Type.NOT_SET}:
        return parameter
    found = _plain(parameter.value, forms)
    if declared.type_ is Parameter.Type.DOUBLE:
        return Parameter(parameter.name, value=_number(found, parameter.name))
    if isinstance(found, list):
        numbers = [_number(entry, f"{parameter.name}[{index}]") for index, entry in enumerate(found)]
    elif forms.one_for_all:
        numbers = [_number(found, parameter.name)] * len(declared.value)
    else:
        raise ValueError(f"{parameter.name}: found {shortened(found)}; it {A_LIST}")
    return Parameter(parameter.name, Parameter.Type.DOUBLE_ARRAY, numbers)


def _plain(value: Any, forms: Forms) -> Any:
    """A value with the texts in it read as YAML 1.2, and those of angles as numbers."""
    if isinstance(value, str):
        try:
            read = read_value(value, "the value")
        except ScenarioError:
            return value
        return _converted(read, forms)
    if hasattr(value, "__len__"):
        return [_plain(entry, forms) for entry in value]
    return value


def _converted(value: Any, forms: Forms) -> Any:
    if isinstance(value, list):
        return [_converted(entry, forms) for entry in value]
    if isinstance(value, str) and forms.angle:
        with suppress(PydanticCustomError):
            return forms.angle(value)
    return value


def _number(value: Any, name: str) -> float:
    """A value as a double.

    Raises:
        ValueError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{name}: found {shortened(value)}; it {A_NUMBER}")
    return float(value)
