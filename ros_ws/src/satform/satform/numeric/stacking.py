# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Many satellites' objects as one: dataclasses of arrays, stacked along a leading axis."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Indices

T = TypeVar("T")


def stack(items: Sequence[T]) -> T:
    """One dataclass whose arrays carry a leading satellite axis, from one per satellite.

    Arrays belong to a satellite and are stacked, 0-d ones too; nested dataclasses are stacked field
    by field; anything else (a plain number, a mode's name, None) belongs to the whole formation and
    has to be the same in all of them.

    Args:
        items: at least one instance, all of the same dataclass.

    Returns:
        An instance of the same dataclass; a field of shape (...) becomes (len(items), ...).

    Raises:
        ValueError: the items cannot fly as one, because a field differs in kind.
    """
    first = items[0]
    if any(type(item) is not type(first) for item in items):
        kinds = sorted({type(item).__name__ for item in items})
        raise ValueError(f"cannot stack different kinds: {', '.join(kinds)}")
    if not dataclasses.is_dataclass(first) or isinstance(first, type):
        raise ValueError(f"cannot stack {type(first).__name__}: it is not a dataclass")
    stacked: dict[str, Any] = {}
    for field in dataclasses.fields(first):
        values = [getattr(item, field.name) for item in items]
        stacked[field.name] = _stack_values(values, f"{type(first).__name__}.{field.name}")
    return dataclasses.replace(first, **stacked)


def item(stacked: T, row: int) -> T:
    """What one satellite has of a stack: the inverse of `stack` for one row.

    Args:
        stacked: dataclass, tuple or array whose arrays carry a leading satellite axis.
        row: index of the satellite on that axis.

    Returns:
        The same with every array's row; what is no array belongs to all and is passed on.
    """
    picked: Any = stacked
    if dataclasses.is_dataclass(stacked) and not isinstance(stacked, type):
        parts = {field.name: item(getattr(stacked, field.name), row) for field in dataclasses.fields(stacked)}
        picked = dataclasses.replace(stacked, **parts)
    elif isinstance(stacked, tuple):
        picked = tuple(item(part, row) for part in stacked)
    elif isinstance(stacked, np.ndarray):
        # A copy: the row would keep the whole stack alive.
        picked = stacked[row].copy()
    return cast(T, picked)


def select(condition: NDArray[np.bool_], first: T, second: T) -> T:
    """The first of two objects for the satellites of which a condition holds, the second for the others.

    Args:
        condition: of each satellite, shape (...).
        first: dataclass whose arrays carry the satellites' axes in front; the rest is the same in both.
        second: another one of the same kind and shape.

    Returns:
        A dataclass of the same kind.
    """
    picked: Any = first
    if dataclasses.is_dataclass(first) and not isinstance(first, type):
        parts = {
            field.name: select(condition, getattr(first, field.name), getattr(second, field.name))
            for field in dataclasses.fields(first)
        }
        picked = dataclasses.replace(first, **parts)
    elif isinstance(first, tuple):
        picked = tuple(select(condition, a, b) for a, b in zip(first, cast(Any, second), strict=True))
    elif isinstance(first, np.ndarray | np.generic):
        further = np.ndim(first) - np.ndim(condition)
        picked = np.where(
            np.reshape(condition, (*np.shape(condition), *(1,) * further)), first, cast(Any, second)
        )
    return cast(T, picked)


def component_major(stacked: T) -> T:
    """The same numbers in another order of memory: a component of all satellites is in one piece.

    Element-wise operations on many satellites keep this order and are several times as fast in it where a
    number of each satellite meets its vectors. No value changes, nor a shape.

    Args:
        stacked: dataclass, tuple or array whose arrays carry a leading satellite axis.
    """
    return _with_arrays(stacked, np.asfortranarray)


def take(stacked: T, rows: Indices) -> T:
    """What some satellites have of a stack, in component-major order of memory.

    Args:
        stacked: dataclass, tuple or array whose arrays carry a leading satellite axis.
        rows: indices of the satellites on that axis.

    Returns:
        The same with these rows of every array; what is no array belongs to all and is passed on.
    """

    def taken(values: NDArray[Any]) -> NDArray[Any]:
        return values.T.take(rows, axis=-1).T

    return _with_arrays(stacked, taken)


def kind(item: Any) -> Any:
    """What has to be the same in objects for `stack` to stack them.

    Args:
        item: of one satellite: dataclass, array or anything else.

    Returns:
        A hashable value: equal for two objects if they can be stacked.
    """
    if dataclasses.is_dataclass(item) and not isinstance(item, type):
        fields = tuple(kind(getattr(item, field.name)) for field in dataclasses.fields(item))
        return (type(item), fields)
    if isinstance(item, np.ndarray | np.generic):
        return (np.ndarray, item.shape)
    if isinstance(item, tuple):
        return tuple(kind(part) for part in item)
    try:
        hash(item)
    except TypeError:
        return repr(item)
    return item


def _with_arrays(stacked: T, change: Callable[[NDArray[Any]], NDArray[Any]]) -> T:
    changed: Any = stacked
    if dataclasses.is_dataclass(stacked) and not isinstance(stacked, type):
        parts = {
            field.name: _with_arrays(getattr(stacked, field.name), change)
            for field in dataclasses.fields(stacked)
        }
        changed = dataclasses.replace(stacked, **parts)
    elif isinstance(stacked, tuple):
        changed = tuple(_with_arrays(part, change) for part in stacked)
    elif isinstance(stacked, np.ndarray):
        changed = change(stacked)
    return cast(T, changed)


def _stack_values(values: list[Any], name: str) -> Any:
    sample = values[0]
    if dataclasses.is_dataclass(sample) and not isinstance(sample, type):
        return stack(values)
    arrays = [isinstance(value, np.ndarray | np.generic) for value in values]
    if all(arrays):
        if any(value.shape != sample.shape for value in values):
            raise ValueError(f"cannot stack {name}: its shape differs between satellites")
        return np.stack(values)
    if any(arrays) or any(value != sample for value in values):
        raise ValueError(f"cannot stack {name}: it differs between satellites")
    return sample
