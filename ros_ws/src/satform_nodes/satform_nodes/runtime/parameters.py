# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS parameters from specifications: type, default, bounds and description from one declaration.

`declare_spec` declares a node's parameters and checks values given at the start; it raises `ParameterError`.
A value that is set in flight passes three checks, each of which can reject it with a reason. `FormationNode`
converts it to the declared type (`parameter_values`). The callback that `on_spec_change` adds builds the
changed specification with `satform.flight.online_parameters.changed`, in which pydantic validates the values.
Then it calls `accept`, a function of `satellite.parameters`, which rejects a change by raising ValueError.
"""

import difflib
from collections.abc import Callable, Sequence
from typing import Any, get_args

from annotated_types import Ge, Gt, Le, Lt
from pydantic import ValidationError
from pydantic.fields import FieldInfo
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from satform.common.angle_text import PATTERNS
from satform.common.spec import Spec, field_description, one_for_all, validators
from satform.flight.online_parameters import changed
from satform.scenario.field_errors import field_sentence
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.parameter_values import Forms, as_declared
from satform_nodes.runtime.start_parameters import START_PARAMETERS


class ParameterError(ValueError):
    """A parameter was given a value at the start that it cannot have; the message says why."""


ONE_FOR_ALL = "one number stands for all"
"""How the description of a parameter of several numbers says that one will do."""


def declare_fixed(node: Node, name: str, default: Any, description: str) -> Any:
    """Declare a parameter that is given at the start and never changes; returns its value."""
    _prepare_override(node, Parameter(name, value=default), Forms())
    descriptor = ParameterDescriptor(read_only=True, description=description)
    return node.declare_parameter(name, default, descriptor).value


def declare_start(node: Node, name: str) -> Any:
    """Declare one of the parameters that programs are given at their start; returns its value."""
    parameter = START_PARAMETERS[name]
    return declare_fixed(node, name, parameter.default, parameter.description)


def declare_rate(node: Node) -> float:
    """Declare how a node keeps time; returns simulated seconds in each second of the wall clock."""
    return float(declare_start(node, "rate"))


def declare_spec(node: FormationNode, prefix: str, spec: Spec) -> None:
    """Declare every field of a specification as `<prefix>.<field>`, with its bounds and description.

    Numbers become doubles and triples arrays of doubles, which may change in flight. Choices and flags
    make another law of it: they become strings and bools that are read-only. A specification within it
    gives parameters with one more dot in their names; lists of such are no parameters.

    Raises:
        ParameterError: a value that was given at the start is not allowed, or may not change at all.
    """
    for name, field in type(spec).model_fields.items():
        inner = getattr(spec, name)
        if isinstance(inner, Spec):
            declare_spec(node, f"{prefix}.{name}", inner)
            continue
        value = _to_parameter(inner)
        if value is None:
            continue
        bounds = _bounds(field)
        lone = one_for_all(field)
        angle = next((function for function in validators(field) if function in PATTERNS), None)
        forms = node.forms[f"{prefix}.{name}"] = Forms(lone, angle)
        _prepare_override(node, Parameter(f"{prefix}.{name}", value=value), forms)
        _check_override(node, prefix, spec, name, value)
        descriptor = ParameterDescriptor(
            description=(field_description(type(spec), name) or f"{name} of {prefix}").strip(),
            read_only=isinstance(value, bool | str),
            additional_constraints=_in_words(bounds, one_for_all=lone),
        )
        limits = _limits(bounds)
        if isinstance(value, float) and limits is not None:
            descriptor.floating_point_range = [limits]
        node.declare_parameter(f"{prefix}.{name}", value, descriptor)


def _prepare_override(node: Node, declared: Parameter, forms: Forms) -> None:
    """Have the value that a parameter was given at the start in its declared type.

    Raises:
        ParameterError: it is of another type.
    """
    overrides = node._parameter_overrides
    if declared.name in overrides:
        try:
            given = as_declared(overrides[declared.name], declared, forms)
        except ValueError as error:
            raise ParameterError(str(error)) from None
        overrides[declared.name] = given


def _check_override(node: Node, prefix: str, spec: Spec, name: str, value: Any) -> None:
    """Validate the value that a parameter was given at the start as a change in flight is validated.

    Raises:
        ParameterError: it is not allowed, or the parameter may not change.
    """
    override = node._parameter_overrides.get(f"{prefix}.{name}")
    if override is None:
        return
    given = _from_parameter(override.value)
    if isinstance(value, bool | str):
        if given != value:
            raise ParameterError(
                f"{prefix}.{name}: found {given!r}; the scenario has {value!r}, which cannot be "
                "changed by a parameter: change it in the scenario"
            )
        return
    try:
        changed(spec, {name: given})
    except ValidationError as error:
        raise ParameterError(_sentences(error, prefix)) from None


def known_before_flight(node: Node, prefix: str, spec: Spec) -> dict[str, Any]:
    """Values set at a node's start for a specification whose fields it has declared.

    Args:
        node: whose parameters were declared by `declare_spec`.
        prefix: as declared.
        spec: as the scenario has it.

    Returns:
        Fields by their names after the prefix, of those that are other than in the scenario.

    Raises:
        ParameterError: there is no such field.
    """
    declared = _shown(node, prefix)
    names = [name for name in node._parameter_overrides if name.startswith(f"{prefix}.")]
    overrides: dict[str, Any] = {}
    for name in names:
        field = name.removeprefix(f"{prefix}.")
        if field not in declared:
            near = difflib.get_close_matches(field, declared, 1)
            hint = f"; did you mean {prefix}.{near[0]}?" if near else ""
            raise ParameterError(f"{name}: there is no such parameter{hint}")
        if declared[field] != _value_of(spec, field):
            overrides[field] = declared[field]
    return overrides


def show_spec(node: FormationNode, prefix: str, spec: Spec, overrides: dict[str, Any]) -> None:
    """Have the parameters of a specification show its values again.

    Args:
        node: whose parameters were declared by `declare_spec`.
        prefix: as declared.
        spec: as the scenario has it.
        overrides: fields that have another value, by their names after the prefix.
    """
    again = []
    for field, shown in _shown(node, prefix).items():
        value = overrides.get(field, _value_of(spec, field))
        if not isinstance(value, bool | str) and shown != value:
            again.append(Parameter(f"{prefix}.{field}", value=value))
    if again:
        node.set_parameters(again)


def _shown(node: Node, prefix: str) -> dict[str, Any]:
    """The values that the parameters of a specification show, by their names after the prefix."""
    fields = node.get_parameters_by_prefix(prefix)
    return {field: _from_parameter(node.get_parameter(f"{prefix}.{field}").value) for field in fields}


def _value_of(spec: Spec, field: str) -> Any:
    """The value of a field as a parameter has it, which may be of a specification within another one."""
    value: Any = spec
    for part in field.split("."):
        value = getattr(value, part)
    return _to_parameter(value)


def on_spec_change(
    node: FormationNode,
    prefix: str,
    current: Callable[[], Spec],
    accept: Callable[[Spec, dict[str, Any]], str],
) -> None:
    """Let `ros2 param set` and its kin change a specification in flight.

    Args:
        node: whose parameters were declared by `declare_spec`.
        prefix: as declared.
        current: the specification in force.
        accept: takes the changed specification and the changed fields; returns a sentence for the
            reply, or raises ValueError with the sentence why not.
    """

    def _changed(parameters: Sequence[Parameter]) -> SetParametersResult:
        fields = {
            parameter.name.removeprefix(f"{prefix}."): _from_parameter(parameter.value)
            for parameter in parameters
            if parameter.name.startswith(f"{prefix}.")
        }
        if not fields:
            return SetParametersResult(successful=True)
        try:
            spec = changed(current(), fields)
            node.sentence = accept(spec, fields)
            return SetParametersResult(successful=True)
        except ValidationError as error:
            return SetParametersResult(successful=False, reason=_sentences(error, prefix))
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))

    node.add_on_set_parameters_callback(_changed)


def _sentences(error: ValidationError, prefix: str) -> str:
    lines = []
    for details in error.errors(include_url=False):
        lines.append(f"{prefix}{'.' if details['loc'] else ': '}{field_sentence(details)}")
    return "; ".join(lines)


def _to_parameter(value: Any) -> Any:
    if isinstance(value, tuple):
        numbers = bool(value) and all(isinstance(item, int | float) for item in value)
        return [float(number) for number in value] if numbers else None
    if isinstance(value, bool | str):
        return value
    return float(value) if isinstance(value, int | float) else None


def _from_parameter(value: Any) -> Any:
    return value if isinstance(value, bool | str | int | float) or value is None else list(value)


def _bounds(field: FieldInfo) -> list[Any]:
    """Bounds of a number, or of each number of a triple."""
    found = list(field.metadata)
    for inner in get_args(field.annotation)[:1]:
        for item in getattr(inner, "__metadata__", ()):
            found += getattr(item, "metadata", [item])
    return [item for item in found if isinstance(item, Ge | Gt | Le | Lt)]


def _in_words(bounds: Sequence[Any], *, one_for_all: bool) -> str:
    forms = {Ge: ">= {0.ge:g}", Gt: "> {0.gt:g}", Le: "<= {0.le:g}", Lt: "< {0.lt:g}"}
    allowed = "each number " + " and ".join(forms[type(item)].format(item) for item in bounds)
    parts = [*([allowed] if bounds else []), *([ONE_FOR_ALL] if one_for_all else [])]
    return "; ".join(parts)


def _limits(metadata: Sequence[Any]) -> FloatingPointRange | None:
    low, high = -1e15, 1e15
    found = False
    for item in metadata:
        if isinstance(item, Ge | Gt):
            low, found = float(getattr(item, "ge", getattr(item, "gt", low))), True
        if isinstance(item, Le | Lt):
            high, found = float(getattr(item, "le", getattr(item, "lt", high))), True
    return FloatingPointRange(from_value=low, to_value=high, step=0.0) if found else None
