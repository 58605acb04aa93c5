# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of everything that a scenario may say, from the one declaration that also checks it."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, get_args, get_origin

from satform.attitude.mrp_tracking import AttitudeTrackingSpec
from satform.common.spec import Spec, choices, field_description, specs
from satform.control.protocol import ControllerSpec
from satform.orbits.curve_specs import CurveSpec
from satform.scenario import Scenario
from satform.scenario.parts import SatelliteFields, SatelliteSpec
from satform_tools.describe.field_text import (
    GROUPS,
    bounds_text,
    default_text,
    is_number,
    is_registered,
    numbers,
    plugin,
    title,
    type_text,
)

_INTRODUCTION = """# Scenario reference

Every field of a scenario file, as it is declared in the code, by which files are checked and editors complete
them. Made by `./tools/satform schema --markdown > docs/scenario_reference.md`; `ros2 param describe` says
the same of those fields that are ROS parameters.

- Quantities are in SI units and radians; frame LVLH has x radial outward, y along-track, z orbit normal.
- No number is infinite. Where no bounds are given, it lies between -1e15 and 1e15.
- A *number for all axes, or [x, y, z]* may be written either way. A field without a default is required;
  one with the default *none* is optional.
- The column **parameter** has the name of the ROS parameter of the satellite's node. It can be changed in
  flight, with effect from the step that the reply names, unless it is *fixed* for the flight. A field whose
  value is *none* is not a parameter. A `kind` is a fixed parameter.
- A `kind` is a name under which a package has registered a part ([entry
  points](../ros_ws/src/satform/README.md#entry-points)). This page has the kinds of the project itself.
"""

_PREFIXES: dict[type[Spec], str] = {
    ControllerSpec: "controller",
    CurveSpec: "curve",
    AttitudeTrackingSpec: "attitude_controller",
}
"""How the names of the parameters of a specification begin."""

_ELSEWHERE = {(SatelliteFields, "phase_offset"): "phase.offset"}
"""Parameters that have a specification of their own in flight, by the field from which they come."""


def text() -> str:
    """The text of `docs/scenario_reference.md`."""
    return page(_INTRODUCTION, Scenario, "Scenario", GROUPS)


def page(introduction: str, root: type[Spec], heading: str, groups: Mapping[str, str]) -> str:
    """A page of all fields of a file.

    Args:
        introduction: Markdown above the fields.
        root: specification of the whole file.
        heading: of its section.
        groups: entry point groups with a section on this page, and their headings.
    """
    parts = [introduction, *_section(root, f"## {heading}")]
    seen: set[type[Spec]] = {root}
    parts += _sections(_within([root]), seen)
    for group, title_of_group in groups.items():
        parts.append(f"## {title_of_group}\n")
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
    held = choices(annotation)
    if any(_specs_of(choice) and get_origin(choice) is not tuple for choice in held):
        return f"{prefix}.{name}.", False
    if all(is_number(choice) or numbers(choice) for choice in held):
        return f"{prefix}.{name}", True
    if all(choice in (str, bool) or get_origin(choice) is Literal for choice in held):
        return f"{prefix}.{name}", False
    return "", False


def _sections(found: Iterable[type[Spec]], seen: set[type[Spec]]) -> Iterator[str]:
    """Sections of specifications that are no one's choice by name, and of those within them."""
    for spec in found:
        if spec in seen or is_registered(spec):
            continue
        seen.add(spec)
        yield from _section(spec, f"### {title(spec)}")
        yield from _sections(_within([spec]), seen)


def _section(spec: type[Spec], heading: str, names: Iterable[str] | None = None) -> Iterator[str]:
    yield f"{heading}\n"
    yield f"{_summary(spec)}\n"
    shown = [
        name
        for name in (spec.model_fields if names is None else names)
        if name != "kind" or not is_registered(spec)
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
        cells = [
            f"`{name}`",
            type_text(field),
            default_text(field),
            bounds_text(field),
            _description_text(field_description(spec, name)),
        ]
        if with_parameters:
            cells.append(_parameter_text(own, changes=changes))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _parameter_text(name: str, *, changes: bool) -> str:
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
            name in other.model_fields
            and repr(other.model_fields[name]) == repr(field)
            and field_description(other, name) == field_description(first, name)
            for other in others
        )
    ]


def _summary(spec: type[Spec]) -> str:
    return " ".join((spec.__doc__ or "").strip().partition("\n\n")[0].split())


def _description_text(description: str | None) -> str:
    return " ".join((description or "").split()).replace("|", "\\|")


def _specs_of(annotation: Any) -> list[type[Spec]]:
    """Specifications anywhere within an annotation that no entry point stands for."""
    if isinstance(annotation, type) and issubclass(annotation, Spec):
        return [annotation]
    if plugin(get_args(annotation)):
        return []
    return [spec for part in get_args(annotation) for spec in _specs_of(part)]


def _within(found: Iterable[type[Spec]]) -> list[type[Spec]]:
    inner = [
        spec
        for own in found
        for field in own.model_fields.values()
        if not plugin(field.metadata)
        for spec in _specs_of(field.annotation)
    ]
    return list(dict.fromkeys(SatelliteSpec if spec is SatelliteFields else spec for spec in inner))
