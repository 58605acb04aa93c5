# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays in dataclasses and tuples, one after another in the order of their fields."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar, cast

import numpy as np

from satform.numeric.elementwise import Array

T = TypeVar("T")


def arrays_of(value: Any) -> list[Array]:
    """The arrays and single numbers of numpy in a dataclass, a tuple or an array."""
    found: list[Array] = []
    _add_arrays(value, found)
    return found


def others_of(value: Any) -> list[Any]:
    """What else is in a dataclass or a tuple: plain numbers, names, None."""
    if isinstance(value, np.ndarray | np.generic):
        return []
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [item for f in dataclasses.fields(value) for item in others_of(getattr(value, f.name))]
    if isinstance(value, tuple):
        return [len(value), *(item for part in value for item in others_of(part))]
    return [value]


def with_arrays(value: T, change: Callable[[Any], Any]) -> T:
    """The same dataclass, tuple or array with other arrays.

    Args:
        value: what `arrays_of` takes.
        change: gives for each of its arrays the one in its stead; called in their order.
    """
    changed: Any = value
    if isinstance(value, np.ndarray | np.generic):
        changed = change(value)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = {f.name: with_arrays(getattr(value, f.name), change) for f in dataclasses.fields(value)}
        changed = dataclasses.replace(value, **parts)
    elif isinstance(value, tuple):
        changed = tuple(with_arrays(part, change) for part in value)
    return cast(T, changed)


def filled(value: T, numbers: Sequence[float]) -> T:
    """The same dataclass, tuple or array with other numbers.

    Args:
        value: what `arrays_of` takes.
        numbers: of all its arrays one after another, of each the last axis fastest.
    """
    ahead = iter(numbers)
    return with_arrays(value, lambda array: _filled(array, ahead))


def numbers_of_arrays(arrays: Sequence[Any]) -> list[float]:
    """The numbers of arrays one after another, of each the last axis fastest."""
    return [number for array in arrays for number in np.ravel(array).tolist()]


def same_bits(first: Any, second: Any) -> bool:
    """Whether two lists of numbers are the same to the last bit; what is not a number is alike."""
    one, two = (np.asarray(values, dtype=np.float64) for values in (first, second))
    unequal = one.view(np.uint64) != two.view(np.uint64)
    return not bool((unequal & ~(np.isnan(one) & np.isnan(two))).any())


def _filled(array: Any, ahead: Iterator[float]) -> Any:
    own = [next(ahead) for _ in range(np.size(array))]
    if isinstance(array, np.generic):
        return type(array)(own[0])
    if array.dtype == object:
        # Of a recording.
        whole = np.empty_like(array)
        for index, number in zip(np.ndindex(array.shape), own, strict=True):
            whole[index] = number
        return whole
    return np.array(own, dtype=array.dtype).reshape(array.shape)


def _add_arrays(value: Any, found: list[Any]) -> None:
    if isinstance(value, np.ndarray | np.generic):
        found.append(value)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            _add_arrays(getattr(value, field.name), found)
    elif isinstance(value, tuple):
        for part in value:
            _add_arrays(part, found)
