# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Describes types, defaults and bounds of the fields of a specification as Markdown."""

import types
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BeforeValidator
from pydantic.fields import FieldInfo

from satform.campaign.scenario_file import NamedScenario
from satform.common.angle_text import OR_DEGREES, OR_DEGREES_PER_SECOND, OR_EITHER_ANGLE
from satform.common.spec import Plugin, Spec, choices, specs
from satform.files.named_file import NamedFile
from satform.scenario.parts import SatelliteFields, SatelliteSpec

GROUPS = {
    "satform.dynamics": "Truth models",
    "satform.perturbations": "Perturbations",
    "satform.topologies": "Topologies",
    "satform.consensus": "Consensus laws",
    "satform.curves": "Curves",
    "satform.controllers": "Controllers",
    "satform.sensors": "Sensors",
    "satform.navigation": "Navigation filters",
    "satform.faults": "Faults",
    "satform.metrics": "Metrics",
}
"""Entry point groups by the headings of their sections, in the order of the page of scenarios."""

CAMPAIGN_GROUPS = {
    "satform.sampling": "Sampling",
    "satform.distributions": "Distributions",
    "satform.campaign_expectations": "Campaign expectations",
}
"""The same of the page of campaigns."""

_EVERY_GROUP = {**GROUPS, **CAMPAIGN_GROUPS}

_WIDEST = 1e15
"""Magnitude that no number of a scenario exceeds."""


def type_text(field: FieldInfo) -> str:
    """What a field may hold."""
    metadata = _annotations(field.annotation, *field.metadata)
    units = [parts for validator, parts in _ANGLES.items() if validator in metadata]
    return " or ".join([_type_of(field.annotation, list(field.metadata)), *units])


_ANGLES = {
    OR_DEGREES: '`"45 deg"`',
    OR_DEGREES_PER_SECOND: '`"0.06 deg/s"`',
    OR_EITHER_ANGLE: "an angle or rate as text",
}


def _annotations(*parts: Any) -> list[Any]:
    """All that a type is annotated with, also within it."""
    found: list[Any] = []
    for part in parts:
        inner = (*get_args(part), *getattr(part, "__metadata__", ()))
        found += [part, *_annotations(*inner)]
    return found


def _type_of(annotation: Any, metadata: list[Any]) -> str:
    group = plugin(metadata)
    if group:
        return f"one of the {_anchored(_EVERY_GROUP[group])}"
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type_of(parts[0], [*metadata, *parts[1:]])
    if origin in (Union, types.UnionType):
        return " or ".join(_type_of(part, metadata) for part in parts if part is not type(None))
    if origin is Literal:
        return " or ".join(f"`{part}`" for part in parts)
    if origin is dict:
        return "mapping of fields"
    if origin is tuple:
        return _tuple_type(annotation, parts, metadata)
    if isinstance(annotation, type) and issubclass(annotation, Spec):
        return _link(annotation)
    texts = {
        float: "number",
        int: "whole number",
        bool: "true or false",
        str: "text",
        datetime: "date and time",
        Path: "path of a file",
        NamedFile: "path of a file",
        NamedScenario: "path of a file, or name of a scenario",
    }
    return texts.get(annotation) or str(annotation)


def _tuple_type(annotation: Any, parts: tuple[Any, ...], metadata: list[Any]) -> str:
    if parts[-1] is ...:
        return f"list of {_type_of(parts[0], []).removeprefix('one of the ')}"
    count = numbers(annotation)
    if any(isinstance(item, BeforeValidator) and item not in _ANGLES for item in metadata):
        return "number for all axes, or [x, y, z]"
    if count:
        return "[x, y, z]" if count == 3 else f"{count} numbers"
    return f"[{', '.join(_type_of(part, []) for part in parts)}]"


def default_text(field: FieldInfo) -> str:
    """What a field is when it is left out; empty when it has to be given."""
    if field.is_required():
        return ""
    value = field.get_default(call_default_factory=True, validated_data={})
    return _value(value)


def _value(value: Any) -> str:
    if value is None or value in ((), {}):
        return "none"
    if isinstance(value, Spec):
        kind = getattr(value, "kind", None)
        return f"`{kind}`" if kind else "its defaults"
    if isinstance(value, tuple):
        if len(set(map(str, value))) == 1 and not isinstance(value[0], Spec):
            return _value(value[0])
        return ", ".join(_value(item) for item in value)
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.15g}" if isinstance(value, float) else f"{value}"


def bounds_text(field: FieldInfo) -> str:
    """In parts; those that all numbers have are left out."""
    found = list(dict.fromkeys(_metadata(field.annotation, list(field.metadata))))
    unit = "letters" if str in choices(field.annotation) else "items"
    parts: list[str] = []
    for item in found:
        match item:
            case Ge(ge) if ge != -_WIDEST:
                parts.append(f"≥ {_limit(ge)}")
            case Gt(gt):
                parts.append(f"> {_limit(gt)}")
            case Le(le) if le != _WIDEST:
                parts.append(f"≤ {_limit(le)}")
            case Lt(lt):
                parts.append(f"< {_limit(lt)}")
            case MinLen(length):
                parts.append(f"at least {length} {unit}" if length > 1 else f"at least one {unit[:-1]}")
            case MaxLen(length):
                parts.append(f"at most {length} {unit}")
            case _:
                pattern = getattr(item, "pattern", None)
                parts += [f"`{pattern}`".replace("|", "\\|")] if pattern else []
    return ", ".join(parts)


def _metadata(annotation: Any, metadata: list[Any]) -> Iterator[Any]:
    for item in metadata:
        if isinstance(item, FieldInfo):
            yield from item.metadata
        elif isinstance(item, Ge | Gt | Le | Lt | MinLen | MaxLen) or hasattr(item, "pattern"):
            yield item
    for part in get_args(annotation):
        if get_origin(annotation) is Annotated and part is not get_args(annotation)[0]:
            yield from _metadata(None, [part])
        elif get_origin(annotation) is not Literal:
            yield from _metadata(part, [])


def _limit(value: Any) -> str:
    return str(value) if isinstance(value, int) else f"{value:.6g}"


def title(spec: type[Spec]) -> str:
    """A class's name as parts, without what all of them end with."""
    name = spec.__name__.removesuffix("Spec")
    parts = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name)
    return parts.strip().capitalize()


def _link(spec: type[Spec]) -> str:
    registered = next(
        (kind for group in _EVERY_GROUP for kind, own in specs(group).items() if own is spec), None
    )
    if registered:
        return f"`{registered}`"
    if spec is SatelliteFields:
        return f"{_link(SatelliteSpec)} without `name`"
    return _anchored(title(spec))


def _anchored(heading: str) -> str:
    return f"[{heading.lower()}](#{heading.lower().replace(' ', '-')})"


def is_registered(spec: type[Spec]) -> bool:
    """Whether a scenario chooses this by name, from an entry point group."""
    return any(spec in specs(group).values() for group in _EVERY_GROUP)


def is_number(annotation: Any) -> bool:
    """Whether an annotation is that of a number."""
    return annotation in (int, float)


def numbers(annotation: Any) -> int:
    """How many numbers a tuple holds; 0 when it is none, or one of something else."""
    parts = [choice for part in get_args(annotation) if part is not ... for choice in choices(part)]
    if get_origin(annotation) is not tuple or not all(is_number(part) for part in parts):
        return 0
    return len(parts)


def plugin(metadata: Iterable[Any]) -> str:
    """The entry point group from which a field is filled; empty when there is none."""
    return next((item.group for item in metadata if isinstance(item, Plugin)), "")
