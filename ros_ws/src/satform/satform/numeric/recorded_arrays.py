# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays that record the element-wise operations on them, number by number.

A formula that is written over arrays is called once with recorded arrays, and leaves the list of the
operations on single numbers that it consists of: a `Recording`, from which `straight_line` makes a program on
floats. The formula stays the only one there is. A number that decides a branch is recorded as a condition,
under which alone the recording holds. What depends on the numbers in any other way raises
`NotRecordableError`.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from satform.numeric.array_trees import with_arrays
from satform.numeric.elementwise import Array
from satform.numeric.recording import (
    BOUND,
    FLOAT,
    WHERE,
    NotRecordableError,
    Number,
    NumberRecording,
    alike,
)

T = TypeVar("T")


_SLACK = 1.0 + 1e-12
"""By which a sum of squares is larger in a comparison, so that the order of its terms cannot matter."""


class Recording(NumberRecording):
    """A recording of operations on arrays."""

    def inputs(self, values: Array) -> "Recorded":
        """Numbers that are given to the program, in the shape of an array."""
        return recorded([self.input(value) for value in np.ravel(values).tolist()], np.shape(values))

    def inputs_of(self, value: T) -> T:
        """A dataclass, tuple or array with inputs as its numbers; the same ones for the same array."""
        known: dict[int, Recorded] = {}
        return with_arrays(value, lambda array: known.setdefault(id(array), self.inputs(array)))


def _changing(function: np.ufunc) -> Callable[[Any, Any], Any]:
    def changed(values: Any, other: Any) -> Any:
        return function(values, other) if values.ndim == 0 else function(values, other, out=(values,))

    return changed


class Recorded(np.ndarray[Any, Any]):
    """An array of numbers of a recording and constants; its operations are recorded."""

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Any, out: tuple[Any, ...] | None = None, **options: Any
    ) -> Any:
        if method == "__call__" and out is not None and set(options) == {"where"}:
            result = _where(options["where"], _elementwise(ufunc, inputs), out[0])
        elif method == "__call__" and not options and ufunc.nout == 1 and ufunc.signature is None:
            result = _elementwise(_LOGICAL.get(ufunc, ufunc), inputs)
        elif method == "accumulate" and ufunc is np.add:
            result = _accumulated(inputs[0], options.get("axis", 0))
        elif method == "reduce" and ufunc in _ASSOCIATIVE:
            result = _reduced(ufunc, inputs[0], options.get("axis", 0))
        else:
            raise NotRecordableError(f"numpy.{ufunc.__name__} in the form {method} is not recorded")
        if out is None:
            return result
        if not isinstance(out[0], Recorded):
            raise NotRecordableError("a recorded result is written into an array that is not recorded")
        out[0].view(np.ndarray)[...] = result.view(np.ndarray)
        return out[0]

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if func in _FUNCTIONS:
            return _FUNCTIONS[func](*args, **kwargs)
        if func in _MOVING:
            moved = func(*_plain(args), **kwargs)
            return moved.view(Recorded) if isinstance(moved, np.ndarray) else moved
        raise NotRecordableError(f"numpy.{func.__name__} is not recorded")

    def __getitem__(self, key: Any) -> Any:
        if _has_recorded(key):
            raise NotRecordableError("a recorded number is used as an index")
        found = self.view(np.ndarray)[key]
        return found.view(Recorded) if isinstance(found, np.ndarray) else recorded([found], ())

    def __setitem__(self, key: Any, value: Any) -> None:
        if _has_recorded(key):
            raise NotRecordableError("a recorded number is used as an index")
        if isinstance(value, Recorded):
            value = value.view(np.ndarray) if value.ndim else _element(value)
        self.view(np.ndarray)[key] = value

    def __bool__(self) -> bool:
        return bool(_element(self))

    def called(self, function: Callable[[int], Array]) -> "Recorded":
        """What a function of this whole number gives; see `NumberRecording.call`."""
        number = _single(self)
        values = np.asarray(function(number.value))
        return recorded(number.recording.call(function, number, values.ravel().tolist()), values.shape)

    def called_with(
        self, function: Callable[[int, Sequence[float]], list[float]], values: "Recorded"
    ) -> list[Number]:
        """What a function of this whole number and of others gives; see `NumberRecording.call_with`."""
        number = _single(self)
        return number.recording.call_with(function, number, elements(values))

    def all(self, *args: Any, **options: Any) -> Any:
        """Whether all are true, over an axis or the whole array."""
        return _reduced(np.logical_and, self, _axis(args, options))

    def any(self, *args: Any, **options: Any) -> Any:
        """Whether one is true, over an axis or the whole array."""
        return _reduced(np.logical_or, self, _axis(args, options))

    def min(self, *args: Any, **options: Any) -> Any:
        """The smallest, over an axis or the whole array."""
        return _reduced(np.minimum, self, _axis(args, options))

    def max(self, *args: Any, **options: Any) -> Any:
        """The largest, over an axis or the whole array."""
        return _reduced(np.maximum, self, _axis(args, options))

    def _as_floats(self, dtype: Any, **_: Any) -> Any:
        """The same numbers as floats; no other type is recorded."""
        if np.dtype(dtype) != np.float64:
            raise NotRecordableError(f"numbers are changed to {dtype}")
        return _elementwise(FLOAT, (self,))

    def _not_recorded(self, *_: Any, **__: Any) -> Any:
        """Not recorded: raises `NotRecordableError`."""
        raise NotRecordableError("a method that is not recorded is asked for")

    astype: Any = _as_floats
    # A single number is a new one after `+=`, as a float of Python is.
    __iadd__: Any = _changing(np.add)
    __isub__: Any = _changing(np.subtract)
    __imul__: Any = _changing(np.multiply)
    __itruediv__: Any = _changing(np.true_divide)
    sum = prod = mean = std = var = dot = cumsum = argmin = argmax = argsort = sort = round = _not_recorded
    clip = tolist = item = tobytes = searchsorted = nonzero = _not_recorded
    __float__ = __int__ = __index__ = _not_recorded


def paired(inputs: Sequence[list[Any]], after: Sequence[Any]) -> tuple[list[tuple[Number, Any]], list[int]]:
    """Inputs of a recording with what they become after a step.

    Args:
        inputs: numbers of each array before the step; several arrays may be the same inputs.
        after: the same arrays after it.

    Returns:
        Each input once with the number or constant that follows, and for each number of all arrays, one
        after another, the index of its input in that list.

    Raises:
        NotRecordableError: arrays have another shape after the step, or are no longer the same.
    """
    indices: dict[int, int] = {}
    carried: list[tuple[Number, Any]] = []
    of_arrays: list[int] = []
    following = [elements(array) for array in after]
    if list(map(len, inputs)) != list(map(len, following)):
        raise NotRecordableError("arrays have another shape after a step")
    for one, two in zip(
        (n for own in inputs for n in own), (n for own in following for n in own), strict=True
    ):
        index = indices.setdefault(one.index, len(carried))
        if index == len(carried):
            carried.append((one, two))
        elif not alike(carried[index][1], two):
            raise NotRecordableError("parts of the state are one array, and are no longer after a step")
        of_arrays.append(index)
    return carried, of_arrays


def recorded(numbers: Sequence[Any], shape: tuple[int, ...]) -> Recorded:
    """An array of numbers of a recording or constants.

    Args:
        numbers: all of them, the last axis fastest.
        shape: of the array.
    """
    flat = np.empty(len(numbers), dtype=object)
    for index, number in enumerate(numbers):
        flat[index] = number
    return flat.reshape(shape).view(Recorded)


def elements(values: Any) -> list[Any]:
    """Numbers and constants of an array, the last axis fastest."""
    return [item if type(item) is Number else _number(item) for item in np.asarray(values).ravel().tolist()]


def _number(item: Any) -> Any:
    """An element of an array as a number or a constant of Python."""
    if isinstance(item, Recorded):
        return _element(item)
    return item.item() if isinstance(item, np.generic) else item


def _element(values: Any) -> Any:
    if values.size != 1:
        raise NotRecordableError("an array decides a branch")
    return elements(values)[0]


def _single(values: Recorded) -> Number:
    number = _element(values)
    if type(number) is not Number:
        raise NotRecordableError("a constant is given to a call")
    return number


def _recording_of(flat: Sequence[list[Any]]) -> NumberRecording | None:
    for values in flat:
        for value in values:
            if type(value) is Number:
                return value.recording
    return None


def _elementwise(kind: Any, inputs: Sequence[Any]) -> Recorded:
    arrays = np.broadcast_arrays(*(np.asarray(item) for item in _plain(inputs)))
    flat = [elements(array) for array in arrays]
    recording = _recording_of(flat) or NumberRecording()
    return recorded([recording.operate(kind, own) for own in zip(*flat, strict=True)], arrays[0].shape)


def _accumulated(values: Any, axis: int) -> Recorded:
    rows = np.moveaxis(np.asarray(values), axis, 0)
    sums = [rows[0].view(Recorded)] if isinstance(rows[0], np.ndarray) else [recorded([rows[0]], ())]
    for row in rows[1:]:
        sums.append(_elementwise(np.add, (sums[-1], row)))
    return np.moveaxis(np.stack([part.view(np.ndarray) for part in sums]), 0, axis).view(Recorded)


def _reduced(kind: Any, values: Any, axis: Any, *, keepdims: bool = False) -> Any:
    plain = np.asarray(values)
    rows = np.moveaxis(plain, axis, 0) if axis is not None else plain.ravel()
    total: Any = rows[0]
    for row in rows[1:]:
        total = _elementwise(_LOGICAL.get(kind, kind), (total, row))
    if keepdims:
        shape = [1] * plain.ndim if axis is None else [*plain.shape]
        if axis is not None:
            shape[axis] = 1
        total = np.reshape(np.asarray(total), shape)
    return total.view(Recorded) if isinstance(total, np.ndarray) else recorded([total], ())


def _largest(values: Any, axis: int) -> Any:
    """Index of the largest number along an axis, which is a condition of the recording."""
    rows = np.moveaxis(np.asarray(values), axis, -1)
    found = np.empty(rows.shape[:-1], dtype=np.int64)
    for index in np.ndindex(found.shape):
        own = elements(rows[index])
        best = int(np.argmax([getattr(item, "value", item) for item in own]))
        for other, item in enumerate(own):
            before = np.greater if other < best else np.greater_equal
            if other != best and not bool(_elementwise(before, (_single_of(own[best]), _single_of(item)))):
                raise NotRecordableError("a number that is not one is compared")
        found[index] = best
    return found


def _single_of(item: Any) -> Recorded:
    return recorded([item], ())


def _where(condition: Any, first: Any, second: Any) -> Recorded:
    return _elementwise(WHERE, (condition, first, second))


def _squared_length(first: Any, second: Any) -> Recorded:
    """An upper bound of the scalar product of an array with itself, only to be compared with a limit."""
    if first is not second:
        raise NotRecordableError("numpy.vdot of different arrays is not recorded")
    squares = elements(_elementwise(np.multiply, (first, first)))
    total: Any = 0.0
    recording = _recording_of([squares]) or NumberRecording()
    for square in squares:
        total = recording.operate(np.add, (total, square))
    return recorded([recording.operate(BOUND, (total, _SLACK))], ())


def _like(fill: float | None) -> Callable[..., Recorded]:
    def made(values: Any, *values_of_all: Any, shape: Any = None, **_: Any) -> Recorded:
        whole = np.empty(np.shape(values) if shape is None else shape, dtype=object)
        value = values_of_all[0] if fill is None else fill
        whole[...] = np.asarray(value) if isinstance(value, Recorded) else value
        return whole.view(Recorded)

    return made


def _has_recorded(key: Any) -> bool:
    return isinstance(key, Recorded) or (isinstance(key, tuple) and any(isinstance(k, Recorded) for k in key))


def _plain(arguments: Any) -> Any:
    if isinstance(arguments, Recorded):
        return arguments.view(np.ndarray)
    if isinstance(arguments, tuple | list):
        return type(arguments)(_plain(item) for item in arguments)
    return arguments


def _axis(arguments: Any, options: Any) -> Any:
    return arguments[0] if arguments else options.get("axis")


_LOGICAL = {np.bitwise_and: np.logical_and, np.bitwise_or: np.logical_or, np.invert: np.logical_not}
_ASSOCIATIVE = (np.logical_and, np.logical_or, np.minimum, np.maximum)

_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.where: _where,
    np.vdot: _squared_length,
    np.zeros_like: _like(0.0),
    np.empty_like: _like(np.nan),
    np.ones_like: _like(1.0),
    np.full_like: _like(None),
    np.all: lambda values, axis=None: _reduced(np.logical_and, values, axis),
    np.any: lambda values, axis=None: _reduced(np.logical_or, values, axis),
    np.min: lambda values, axis=None, **options: _reduced(np.minimum, values, axis, **options),
    np.max: lambda values, axis=None, **options: _reduced(np.maximum, values, axis, **options),
    np.argmax: _largest,
    np.shape: lambda values: values.shape,
    np.ndim: lambda values: values.ndim,
    np.size: lambda values: values.size,
}

_MOVING = {
    np.stack, np.concatenate, np.moveaxis, np.swapaxes, np.reshape, np.ravel, np.broadcast_to, np.expand_dims,
    np.transpose, np.take, np.atleast_1d, np.atleast_2d, np.copy, np.squeeze, np.tile, np.repeat, np.roll,
    np.take_along_axis, np.vstack, np.hstack,
}  # fmt: skip
