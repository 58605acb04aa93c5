"""The page of everything that a scenario may say, from the one declaration that also checks it."""

import types
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BeforeValidator
from pydantic.fields import FieldInfo

from satform.control.attitude import AttitudeTrackingSpec
from satform.control.protocol import ControllerSpec
from satform.curves import CurveSpec
from satform.scenario import Scenario
from satform.scenario.model import SatelliteFields, SatelliteSpec
from satform.spec import Plugin, Spec, specs

_INTRODUCTION = """# What a scenario may say

Every field of a scenario file, as it is declared in the code, by which files are checked and editors complete them.
Made by `./tools/satform schema --markdown > docs/reference.md`; `ros2 param describe` says the same of those fields
that are ROS parameters.

- Quantities are in SI units and radians; frame LVLH has x radial outward, y along-track, z orbit normal.
- No number is infinite. Where no bounds are given, it lies between -1e15 and 1e15.
- A *number for all axes, or [x, y, z]* may be written either way. A field without a default has to be given, one with
  the default *none* may be left out.
- What stands under **parameter** is a ROS parameter of the satellite's node with that name. It may change in flight,
  from the step on that the reply names, unless it is *fixed* for the flight. A field whose
  value is *none* is no parameter. A `kind` is one, too, and fixed.
- A `kind` is a name under which a package has registered a part
  ([entry points](../ros_ws/src/satform/README.md#entry-points)): this page has those that come with the project.
"""

_GROUPS = {
    "satform.dynamics": "Truth models",
    "satform.perturbations": "Perturbations",
    "satform.topologies": "Topologies",
    "satform.consensus": "Consensus laws",
    "satform.curves": "Curves",
    "satform.controllers": "Controllers",
    "satform.faults": "Faults",
    "satform.metrics": "Metrics",
}
"""Entry point groups by the headings of their sections, in the order of the page."""

_PREFIXES: dict[type[Spec], str] = {
    ControllerSpec: "controller",
    CurveSpec: "curve",
    AttitudeTrackingSpec: "attitude_controller",
}
"""How the names of the parameters of a specification begin."""

_ELSEWHERE = {(SatelliteFields, "phase_offset"): "phase.offset"}
"""Parameters that have a specification of their own in flight, by the field from which they come."""

_WIDEST = 1e15


def text() -> str:
    """The text of `docs/reference.md`."""
    parts = [_INTRODUCTION, *_section(Scenario, "## Scenario")]
    seen: set[type[Spec]] = {Scenario}
    waiting = _within([Scenario])
    parts += _sections(waiting, seen)
    for group, heading in _GROUPS.items():
        parts.append(f"## {heading}\n")
        kinds = specs(group)
        shared = _shared(kinds.values())
        if shared:
            names = ", ".join(f"`{name}`" for name in shared)
            parts.append(f"All have {names}:\n")
            parts.append(_table(next(iter(kinds.values())), shared))
        for kind, spec in kinds.items():
            parts += _section(spec, f"### {kind}", [name for name in spec.model_fields if name not in shared])
        parts += _sections(_within(kinds.values()), {*seen, *kinds.values()})
    return "\n".join(parts).rstrip("\n") + "\n"


def parameter(spec: type[Spec], name: str) -> tuple[str, bool]:
    """The ROS parameter that a field becomes.

    Args:
        spec: that has the field.
        name: of the field.

    Returns:
        Name of the parameter, or nothing when the field is none; and whether it may change in flight.
    """
    for (owner, field), elsewhere in _ELSEWHERE.items():
        if issubclass(spec, owner) and name == field:
            return elsewhere, True
    prefix = next((prefix for base, prefix in _PREFIXES.items() if issubclass(spec, base)), "")
    if not prefix:
        return "", False
    annotation = spec.model_fields[name].annotation
    choices = _choices(annotation)
    if any(_specs_of(choice) and get_origin(choice) is not tuple for choice in choices):
        return f"{prefix}.{name}.", False
    if all(_is_number(choice) or _numbers(choice) for choice in choices):
        return f"{prefix}.{name}", True
    if all(choice in (str, bool) or get_origin(choice) is Literal for choice in choices):
        return f"{prefix}.{name}", False
    return "", False


def _sections(found: Iterable[type[Spec]], seen: set[type[Spec]]) -> Iterator[str]:
    """Sections of specifications that are no one's choice by name, and of those within them."""
    for spec in found:
        if spec in seen or _is_registered(spec):
            continue
        seen.add(spec)
        yield from _section(spec, f"### {_title(spec)}")
        yield from _sections(_within([spec]), seen)


def _section(spec: type[Spec], heading: str, names: Iterable[str] | None = None) -> Iterator[str]:
    yield f"{heading}\n"
    yield f"{_summary(spec)}\n"
    shown = [
        name
        for name in (spec.model_fields if names is None else names)
        if name != "kind" or not _is_registered(spec)
    ]
    if shown:
        yield _table(spec, shown)


def _table(spec: type[Spec], names: Iterable[str]) -> str:
    rows = [(name, spec.model_fields[name], *parameter(spec, name)) for name in names]
    with_parameters = any(own for _, _, own, _ in rows)
    lines = ["| field | type | default | bounds | meaning |", "|---|---|---|---|---|"]
    if with_parameters:
        lines = [f"{lines[0]} parameter |", f"{lines[1]}---|"]
    for name, field, own, changes in rows:
        cells = [f"`{name}`", _type(field), _default(field), _bounds(field), _words(field.description)]
        if with_parameters:
            cells.append(_parameter_words(own, changes=changes))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _parameter_words(name: str, *, changes: bool) -> str:
    if name.endswith("."):
        return f"`{name}*`, its fields"
    return (f"`{name}`" if changes else f"`{name}`, fixed") if name else ""


def _shared(kinds: Iterable[type[Spec]]) -> list[str]:
    """Fields that all kinds have in the same form."""
    every = list(kinds)
    first, *others = every
    return [
        name
        for name, field in first.model_fields.items()
        if name != "kind"
        and others
        and all(
            name in other.model_fields and repr(other.model_fields[name]) == repr(field) for other in others
        )
    ]


def _summary(spec: type[Spec]) -> str:
    return " ".join((spec.__doc__ or "").strip().partition("\n\n")[0].split())


def _words(description: str | None) -> str:
    return " ".join((description or "").split()).replace("|", "\\|")


def _title(spec: type[Spec]) -> str:
    """A class's name as words, without what all of them end with."""
    name = spec.__name__.removesuffix("Spec")
    words = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name)
    return words.strip().capitalize()


def _link(spec: type[Spec]) -> str:
    registered = next((kind for group in _GROUPS for kind, own in specs(group).items() if own is spec), None)
    if registered:
        return f"`{registered}`"
    if spec is SatelliteFields:
        return f"{_link(SatelliteSpec)} without `name`"
    return _anchored(_title(spec))


def _anchored(heading: str) -> str:
    return f"[{heading.lower()}](#{heading.lower().replace(' ', '-')})"


def _is_registered(spec: type[Spec]) -> bool:
    return any(spec in specs(group).values() for group in _GROUPS)


def _choices(annotation: Any) -> list[Any]:
    """What a field may hold, without None and without what is said about it."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return _choices(get_args(annotation)[0])
    if origin in (Union, types.UnionType):
        return [choice for part in get_args(annotation) for choice in _choices(part)]
    return [] if annotation is type(None) else [annotation]


def _is_number(annotation: Any) -> bool:
    return annotation in (int, float)


def _numbers(annotation: Any) -> int:
    """How many numbers a tuple holds; 0 when it is none, or one of something else."""
    parts = [choice for part in get_args(annotation) if part is not ... for choice in _choices(part)]
    if get_origin(annotation) is not tuple or not all(_is_number(part) for part in parts):
        return 0
    return len(parts)


def _specs_of(annotation: Any) -> list[type[Spec]]:
    """Specifications anywhere within an annotation that no entry point stands for."""
    if isinstance(annotation, type) and issubclass(annotation, Spec):
        return [annotation]
    if _plugin(get_args(annotation)):
        return []
    return [spec for part in get_args(annotation) for spec in _specs_of(part)]


def _within(found: Iterable[type[Spec]]) -> list[type[Spec]]:
    inner = [
        spec
        for own in found
        for field in own.model_fields.values()
        if not _plugin(field.metadata)
        for spec in _specs_of(field.annotation)
    ]
    return list(dict.fromkeys(SatelliteSpec if spec is SatelliteFields else spec for spec in inner))


def _plugin(metadata: Iterable[Any]) -> str:
    return next((item.group for item in metadata if isinstance(item, Plugin)), "")


def _type(field: FieldInfo) -> str:
    return _type_of(field.annotation, list(field.metadata))


def _type_of(annotation: Any, metadata: list[Any]) -> str:
    group = _plugin(metadata)
    if group:
        return f"one of the {_anchored(_GROUPS[group])}"
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type_of(parts[0], [*metadata, *parts[1:]])
    if origin in (Union, types.UnionType):
        return " or ".join(_type_of(part, metadata) for part in parts if part is not type(None))
    if origin is Literal:
        return " or ".join(f"`{part}`" for part in parts)
    if origin is tuple:
        return _tuple_type(annotation, parts, metadata)
    if isinstance(annotation, type) and issubclass(annotation, Spec):
        return _link(annotation)
    words = {float: "number", int: "whole number", bool: "true or false", str: "text", datetime: "date and time", Path: "path of a file"}
    return words.get(annotation) or str(annotation)


def _tuple_type(annotation: Any, parts: tuple[Any, ...], metadata: list[Any]) -> str:
    if parts[-1] is ...:
        return f"list of {_type_of(parts[0], []).removeprefix('one of the ')}"
    count = _numbers(annotation)
    if any(isinstance(item, BeforeValidator) for item in metadata):
        return "number for all axes, or [x, y, z]"
    if count:
        return "[x, y, z]" if count == 3 else f"{count} numbers"
    return f"[{', '.join(_type_of(part, []) for part in parts)}]"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return ""
    value = field.get_default(call_default_factory=True, validated_data={})
    return _value(value)


def _value(value: Any) -> str:
    if value is None or value == ():
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


def _bounds(field: FieldInfo) -> str:
    """In words; those that all numbers have are left out."""
    found = list(dict.fromkeys(_metadata(field.annotation, list(field.metadata))))
    unit = "letters" if str in _choices(field.annotation) else "items"
    words: list[str] = []
    for item in found:
        match item:
            case Ge(ge) if ge != -_WIDEST:
                words.append(f"≥ {_limit(ge)}")
            case Gt(gt):
                words.append(f"> {_limit(gt)}")
            case Le(le) if le != _WIDEST:
                words.append(f"≤ {_limit(le)}")
            case Lt(lt):
                words.append(f"< {_limit(lt)}")
            case MinLen(length):
                words.append(f"at least {length} {unit}" if length > 1 else f"at least one {unit[:-1]}")
            case MaxLen(length):
                words.append(f"at most {length} {unit}")
            case _:
                pattern = getattr(item, "pattern", None)
                words += [f"`{pattern}`".replace("|", "\\|")] if pattern else []
    return ", ".join(words)


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
