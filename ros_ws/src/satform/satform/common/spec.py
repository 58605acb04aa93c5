# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Specifications: typed, bounded data from which the parts of a formation are built.

A part that a scenario chooses by name (a controller, a curve, a perturbation, a consensus law, a
topology) is declared once, as a `Spec`: a pydantic model with a literal `kind`, bounded fields
with units in their descriptions, and a `build` method that returns the part itself. The scenario's
JSON Schema, the ROS parameters and the documentation all come from that one declaration.
Specs are found through Python entry points, so that a package outside this one adds its own.
"""

import ast
import functools
import inspect
import itertools
import re
import sys
import types
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationInfo,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, PydanticKnownError, core_schema

FieldPath = tuple[int | str, ...]
"""Names of fields and indices in lists, from the top of a scenario or of a specification."""

Complaint = tuple[FieldPath, str]
"""Path of a field and what is wrong with it."""


class Spec(BaseModel):
    """Base of all data in a scenario: immutable, nothing unknown accepted, no infinities."""

    # Validators are made of what is validated first: to make those of all kinds takes as long as all imports.
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    def model_post_init(self, _context: Any) -> None:
        """Count `kind` as given: without it what was built in Python could not be read again."""
        if "kind" in type(self).model_fields:
            self.model_fields_set.add("kind")

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """The model's JSON Schema, with the docstrings of its fields as their descriptions."""
        made = handler(core_schema)
        model = handler.resolve_ref_schema(made)
        for name, schema in model.get("properties", {}).items():
            description = field_description(cls, name)
            if description:
                model["properties"][name] = {**schema, "description": description}
        return made


def field_description(spec: type[BaseModel], name: str) -> str:
    """What the docstring below a field says.

    It is read from the source when it is asked for: a flight needs none, and pydantic's own way would read
    the source of every specification at each start of the program.

    Args:
        spec: the model.
        name: of one of its fields.

    Returns:
        The description that the field itself declares, else the docstring; empty where there is neither.
    """
    declared = spec.model_fields[name].description
    if declared:
        return declared
    owner = next((base for base in spec.__mro__ if name in inspect.get_annotations(base)), None)
    return "" if owner is None else _docstrings(owner).get(name, "")


@functools.cache
def _docstrings(owner: type) -> dict[str, str]:
    """The docstrings of a class's annotated fields; none where it has no source."""
    try:
        source = inspect.getsource(sys.modules[owner.__module__])
        tree = _parsed(source, owner.__qualname__.partition(".")[0])
    except (KeyError, OSError, TypeError):
        return {}
    # A class within another one, or within a function.
    for name in owner.__qualname__.replace("<locals>.", "").split("."):
        tree = next((node for node in ast.walk(tree) if node is not tree and _name(node) == name), tree)
    return dict(_field_docstrings(tree))


def _parsed(source: str, name: str) -> ast.AST:
    """A module, only as far as it defines a name where its lines tell: a whole one takes long to parse."""
    lines = source.splitlines()
    begins = re.compile(rf"(class|def|async def) {re.escape(name)}\b")
    first = next((number for number, line in enumerate(lines) if begins.match(line)), 0)
    following = (number for number in range(first + 1, len(lines)) if re.match(r"[\w@]", lines[number]))
    try:
        return ast.parse("\n".join(lines[first : next(following, len(lines))]))
    except SyntaxError:
        # A text over several lines looked like the next statement.
        return ast.parse(source)


def _name(node: ast.AST) -> str:
    return str(getattr(node, "name", ""))


def _field_docstrings(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Name and docstring of all annotated fields of a class."""
    for own, following in itertools.pairwise(ast.iter_child_nodes(node)):
        match own, following:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                yield name, inspect.cleandoc(text)


def require_consistent(complaints: Sequence[Complaint]) -> None:
    """Refuse fields that do not fit each other; to be called by a validator of the whole.

    Args:
        complaints: that were found; none where everything fits.

    Raises:
        PydanticCustomError: there are some. A loader makes a problem with a line of its own of each.
    """
    if complaints:
        summary = "; ".join(sentence for _, sentence in complaints)
        raise PydanticCustomError("inconsistent", "{summary}", {"summary": summary, "complaints": complaints})


def _three(value: Any) -> Any:
    """A lone number stands for the same value on each axis."""
    return (value, value, value) if isinstance(value, int | float) else value


def one_for_all(field: FieldInfo) -> bool:
    """Whether one number may stand for all components of a field."""
    return _three in validators(field)


def validators(field: FieldInfo) -> list[Any]:
    """The functions that take a field's value before it is validated, also those of types within its type."""
    parts = _with_parts(field.annotation, *field.metadata)
    return [part.func for part in parts if isinstance(part, BeforeValidator)]


def _with_parts(*parts: Any) -> list[Any]:
    """Types and what they are annotated with, and all that they are made of."""
    return [inner for part in parts for inner in (part, *_with_parts(*_within(part)))]


def choices(annotation: Any) -> list[Any]:
    """The types that a field may hold, without None and annotations."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return choices(get_args(annotation)[0])
    if origin in (Union, types.UnionType):
        return [choice for part in get_args(annotation) for choice in choices(part)]
    return [] if annotation is type(None) else [annotation]


def _within(annotation: Any) -> tuple[Any, ...]:
    """What a type is made of, and what it is annotated with."""
    return (*get_args(annotation), *getattr(annotation, "__metadata__", ()))


Number = Annotated[float, Field(ge=-1e15, le=1e15)]
NonNegative = Annotated[float, Field(ge=0.0, le=1e15)]
Positive = Annotated[float, Field(gt=0.0, le=1e15)]
Vector = tuple[Number, Number, Number]
PerAxis = Annotated[tuple[Number, Number, Number], BeforeValidator(_three)]
PositivePerAxis = Annotated[tuple[Positive, Positive, Positive], BeforeValidator(_three)]
NonNegativePerAxis = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(_three)]

LEAST_DEVIATION = 1e-12
"""Least standard deviation that a filter assumes, SI units: squares of smaller ones are lost in rounding."""

Deviation = Annotated[float, Field(ge=LEAST_DEVIATION, le=1e15)]
DeviationPerAxis = Annotated[tuple[Deviation, Deviation, Deviation], BeforeValidator(_three)]
Density = Annotated[float, Field(ge=1e-30, le=1e15)]
DensityPerAxis = Annotated[tuple[Density, Density, Density], BeforeValidator(_three)]


@functools.cache
def installed_entry_points() -> Any:
    """Those of all installed packages, whose descriptions are read once for all groups."""
    return entry_points()


@functools.cache
def specs(group: str) -> dict[str, type[Spec]]:
    """The registered specifications of one group.

    Args:
        group: entry point group, for example `satform.controllers`.

    Returns:
        Specification classes by the name under which a scenario chooses them.

    Raises:
        TypeError: an entry point is not a `Spec`, its `kind` differs from its registered name, or two
            packages register the same name.
    """
    found: dict[str, type[Spec]] = {}
    for entry in sorted(installed_entry_points().select(group=group), key=lambda entry: entry.name):
        spec = entry.load()
        if not (isinstance(spec, type) and issubclass(spec, Spec)):
            raise TypeError(
                f"entry point {group}:{entry.name} ({entry.value}) is not a satform.common.spec.Spec"
            )
        kind = spec.model_fields["kind"].default if "kind" in spec.model_fields else None
        if kind != entry.name:
            raise TypeError(f"entry point {group}:{entry.name} ({entry.value}) declares kind {kind!r}")
        if found.get(entry.name, spec) is not spec:
            raise TypeError(f"entry point {group}:{entry.name} is registered twice, by {entry.value} too")
        found[entry.name] = spec
    return found


class Plugin:
    """Annotation of a field that holds any registered specification of one entry point group.

    A group with specifications of the library alone loads and builds a kind when it is first used, since most
    scenarios have few of all kinds. One with a specification of another package is checked as a whole.
    """

    def __init__(self, group: str) -> None:
        self.group = group

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        if _own_kinds(self.group):
            return core_schema.with_info_plain_validator_function(self._validated)
        return handler.generate_schema(self._union(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """All kinds, as the schema of a union that is told apart by them."""
        return handler(self._with_all_kinds(schema))

    def _with_all_kinds(self, schema: Any) -> Any:
        """A schema in which the union of all kinds stands in place of this plugin's validator.

        Further validators of the same field may be around it.
        """
        if schema["type"] in {"function-before", "function-after", "function-wrap"}:
            return {**schema, "schema": self._with_all_kinds(schema["schema"])}
        if schema["type"] != "function-plain":
            return schema
        return TypeAdapter(self._union(Spec)).core_schema

    def _union(self, source: Any) -> Any:
        """The type of all registered specifications."""
        choices = tuple(specs(self.group).values())
        if not choices:
            raise TypeError(f"no entry point is registered in the group {self.group}")
        for choice in choices:
            if not issubclass(choice, source):
                name = f"{choice.__module__}:{choice.__qualname__}"
                raise TypeError(f"{name} is registered in {self.group} but is not a {source.__name__}")
        return choices[0] if len(choices) == 1 else Annotated[Union[choices], Discriminator("kind")]  # noqa: UP007

    def _validated(self, value: Any, info: ValidationInfo) -> Any:
        """The specification of a kind, of which the value is either one or the fields."""
        kinds = _own_kinds(self.group)
        kind: Any
        if len(kinds) == 1:
            (kind,) = kinds
        elif isinstance(value, Mapping):
            kind = value.get("kind", _NO_KIND)
        elif isinstance(value, Spec):
            kind = getattr(value, "kind", _NO_KIND)
        else:
            raise PydanticKnownError("model_attributes_type")
        if kind is _NO_KIND:
            raise PydanticKnownError("union_tag_not_found", {"discriminator": "'kind'"})
        if not isinstance(kind, str) or kind not in kinds:
            expected = ", ".join(repr(name) for name in kinds)
            context = {"discriminator": "'kind'", "tag": str(kind), "expected_tags": expected}
            raise PydanticKnownError("union_tag_invalid", context)
        return kinds[kind].load().model_validate(value, context=info.context)


_NO_KIND = object()


@functools.cache
def _own_kinds(group: str) -> dict[str, EntryPoint]:
    """The entry points of a group by their names; none where another package has registered some."""
    found = sorted(installed_entry_points().select(group=group), key=lambda entry: entry.name)
    own = all(entry.value.startswith(f"{__package__.partition('.')[0]}.") for entry in found)
    return {entry.name: entry for entry in found} if own else {}
