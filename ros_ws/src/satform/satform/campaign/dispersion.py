# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What differs from case to case: fields of the scenario, their values, and which draws are correlated."""

import json
import re
from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ModelWrapValidatorHandler, PrivateAttr, model_validator

from satform.campaign.distributions import ChoiceSpec, Distribution, Quantity, Value
from satform.campaign.exact_arithmetic import linear_points, logarithmic_points
from satform.campaign.paths import Target
from satform.common.angle_text import DEGREES, DEGREES_PER_SECOND, is_angle
from satform.common.spec import Plugin, Spec
from satform.scenario.parts import Name

_POSITIVE_DEFINITE = 1e-10
"""Least eigenvalue of a correlation matrix; below it a Cholesky factor is mostly rounding."""


class Grid(Spec):
    """Values that a sampling goes through: a list of them, or evenly spaced ones."""

    values: Annotated[tuple[Value, ...], Field(min_length=1, max_length=100_000)] | None = None
    """The values; numbers in the unit of the field, text, or true and false."""
    first: Annotated[Quantity, Field()] | None = None
    """First of evenly spaced values; needs `last` and `count`."""
    last: Annotated[Quantity, Field()] | None = None
    """Last of them."""
    count: Annotated[int, Field(ge=2, le=100_000)] | None = None
    """How many there are, both ends included."""
    spacing: Literal["linear", "logarithmic"] = "linear"
    """Whether neighbouring values have the same difference or the same ratio."""

    @model_validator(mode="after")
    def _either(self) -> "Grid":
        spaced = (self.first, self.last, self.count)
        if (self.values is None) == all(value is None for value in spaced):
            raise ValueError("give either values, or first, last and count")
        if self.values is None and any(value is None for value in spaced):
            raise ValueError("evenly spaced values need first, last and count")
        if self.values is not None and self.spacing == "logarithmic":
            raise ValueError("listed values have no spacing")
        if self.spacing == "logarithmic" and not (self.first or 0.0) * (self.last or 0.0) > 0.0:
            raise ValueError("logarithmic spacing needs a first and last of the same sign, neither zero")
        return self

    @cached_property
    def points(self) -> tuple[Value, ...]:
        """All values in order."""
        if self.values is not None:
            return self.values
        assert self.first is not None  # noqa: S101 - the validator has seen to it
        assert self.last is not None  # noqa: S101 - likewise
        assert self.count is not None  # noqa: S101 - likewise
        spaced = linear_points if self.spacing == "linear" else logarithmic_points
        return spaced(self.first, self.last, self.count)


class Dispersion(Spec):
    """A field of the scenario that differs from case to case, or this field of several entries of a list."""

    path: Annotated[str, Field(min_length=1, max_length=500)]
    """The field, as messages print it: fields with dots between them, and for an entry of a list its index,
    its name, or `*` for all entries, such as `satellites[*].position_error[0]`."""
    name: Name | None = None
    """A name of its own, by which `correlated` and reports name it; the path when left out."""
    distribution: Annotated[Distribution, Plugin("satform.distributions")] | None = None
    """From which its values are drawn. Either this or `grid` is given."""
    grid: Grid | None = None
    """Values that are gone through, for the samplings `grid` and `one_at_a_time`."""
    applied: Literal["replace", "add", "scale"] = "replace"
    """Whether a value replaces that of the scenario, is added to it, or multiplies it."""
    shared: bool = False
    """Whether all fields of a wildcard have the same draw; otherwise each has an independent one."""

    _angles: tuple[str, ...] = PrivateAttr(())

    @model_validator(mode="wrap")
    @classmethod
    def _with_angles(cls, data: Any, handler: ModelWrapValidatorHandler["Dispersion"]) -> "Dispersion":
        """Remember which numbers were written as angles, in a unit that the field has to have."""
        made = handler(data)
        if isinstance(data, dict):
            made._angles = tuple(_angle_texts([data.get("distribution"), data.get("grid")]))
        return made

    @model_validator(mode="after")
    def _one_of_two(self) -> "Dispersion":
        if (self.distribution is None) == (self.grid is None):
            raise ValueError("give exactly one of distribution and grid")
        return self

    @property
    def label(self) -> str:
        """The name, or the path without one."""
        return self.name or self.path

    def values(self) -> tuple[Value, ...]:
        """All values that are listed one by one; none of a continuous distribution."""
        if self.grid is not None:
            return self.grid.points
        return self.distribution.values if isinstance(self.distribution, ChoiceSpec) else ()

    def misplaced_angle(self, pattern: str) -> str:
        """The first text that was written for an angle or a rate and is none of a pattern; empty for none."""
        return next((text for text in self._angles if not (pattern and re.match(pattern, text))), "")


class Correlated(Spec):
    """Dispersions whose draws depend on each other, by a Gaussian copula.

    The quantiles of the group are those of normal variables with the given correlations. Normal distributions
    have these correlations themselves; others have their rank correlation, 6 / pi * asin(r / 2).
    """

    of: Annotated[tuple[str, ...], Field(min_length=2)]
    """Names or paths of dispersions. Either each has one draw, or all have equally many: then the first draw
    of each belongs to the first of the others, the second to the second, and so on."""
    matrix: Annotated[tuple[tuple[Annotated[float, Field(ge=-1.0, le=1.0)], ...], ...], Field(min_length=1)]
    """Correlations of the normal variables: symmetric, ones on the diagonal, positive definite."""

    @model_validator(mode="after")
    def _is_correlation(self) -> "Correlated":
        count = len(self.of)
        if any(len(row) != count for row in self.matrix) or len(self.matrix) != count:
            raise ValueError(f"the matrix of {count} dispersions has {count} rows of {count} numbers")
        matrix = np.array(self.matrix)
        if not np.array_equal(matrix, matrix.T):
            raise ValueError("the matrix is not symmetric")
        if not np.all(np.diag(matrix) == 1.0):
            raise ValueError("each dispersion has the correlation 1 with itself, on the matrix's diagonal")
        least = float(np.linalg.eigvalsh(matrix)[0])
        if least < _POSITIVE_DEFINITE:
            raise ValueError(
                f"the matrix is not positive definite (its least eigenvalue is {least:.3g}): no variables "
                "have these correlations"
            )
        if len(set(self.of)) != count:
            raise ValueError("a dispersion is named twice")
        return self


def value_complaints(dispersion: Dispersion, found: Sequence[Target]) -> list[str]:
    """Why values of a dispersion do not fit the fields that it means; the first reason of the first field.

    Args:
        dispersion: of a campaign.
        found: fields that its path means.
    """
    for target in found:
        sentence = (
            _type_complaint(dispersion, target)
            or _angle_complaint(dispersion, target)
            or _applied_complaint(dispersion, target)
        )
        if sentence:
            return [sentence]
    return []


def _type_complaint(dispersion: Dispersion, target: Target) -> str:
    listed_values = dispersion.values()
    if not listed_values:
        if target.is_number:
            return ""
        holds = "true or false" if bool in target.types else "text"
        return f"{target.text} holds {holds}: disperse it by a choice of these"
    for value in listed_values:
        wanted = set(target.types) | ({int} if float in target.types else set())
        if isinstance(value, str) and target.angle and re.match(target.angle, value):
            continue
        whole = isinstance(value, float) and value.is_integer() and target.is_whole
        if type(value) not in wanted and not whole:
            names = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
            holds = " or ".join(names[kind] for kind in (float, int, bool, str) if kind in target.types)
            return f"found {json.dumps(value)} among the values; {target.text} holds {holds}"
    return ""


def _angle_complaint(dispersion: Dispersion, target: Target) -> str:
    text = dispersion.misplaced_angle(target.angle)
    if not text:
        return ""
    unit = {DEGREES: "an angle in rad", DEGREES_PER_SECOND: "a rate in rad/s"}.get(target.angle, "no angle")
    return f"found {text!r} among the values; {target.text} holds {unit}"


def _applied_complaint(dispersion: Dispersion, target: Target) -> str:
    if dispersion.applied == "replace":
        return ""
    what = "added to" if dispersion.applied == "add" else "multiplied with"
    values = dispersion.values()
    if not target.is_number or any(isinstance(value, bool | str) for value in values):
        return f"only numbers can be {what} {target.text}"
    if target.value is None:
        return f"{target.text} is not given in the scenario, so that nothing can be {what} it: give it by set"
    if dispersion.applied == "scale" and target.value == 0:
        return f"{target.text} is 0 in the scenario, and so is every multiple of it: use applied: add"
    return ""


def _angle_texts(data: Any) -> list[str]:
    """Texts anywhere in plain data that stand for an angle or a rate."""
    if isinstance(data, dict | list | tuple):
        parts = data.values() if isinstance(data, dict) else data
        return [text for part in parts for text in _angle_texts(part)]
    return [data] if is_angle(data) else []
