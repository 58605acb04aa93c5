# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Recording of the operations on single numbers that a computation consists of."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from satform.numeric.elementwise import FLOAT_FUNCTIONS


class NotRecordableError(Exception):
    """A computation is not a list of element-wise operations, so it is not recorded."""


WHERE = "where"
INPUT = "input"
CALL = "call"
PART = "part"
FLOAT = "float"
BOUND = "bound"


class Number:
    """A number of a recording.

    Attributes:
        recording: that it belongs to.
        index: of the operation that gives it.
        value: that it has in the step that is recorded.
    """

    __slots__ = ("index", "recording", "value")

    def __init__(self, recording: "NumberRecording", index: int, value: Any) -> None:
        self.recording = recording
        self.index = index
        self.value = value

    def __bool__(self) -> bool:
        return self.recording.decide(self)

    def __float__(self) -> float:
        raise NotRecordableError("a number of it is asked for as a float")

    def __int__(self) -> int:
        raise NotRecordableError("a number of it is asked for as an integer")

    def __index__(self) -> int:
        raise NotRecordableError("a number of it is used as an index")


@dataclass(frozen=True)
class Operation:
    """One operation on numbers.

    Attributes:
        kind: a numpy or scipy function, or one of the names above.
        arguments: indices of operations (as `Number`), or constants.
    """

    kind: Any
    arguments: tuple[Any, ...]


@dataclass
class NumberRecording:
    """Operations in the order in which they are done.

    Attributes:
        operations: each gives one number; a `call` gives several, which `part` picks.
        conditions: index of a number, whether it has to be true, and how many operations come before.
        calls: functions of a whole number, such as that of a step, and perhaps of further numbers, which are
            called as they are.
    """

    operations: list[Operation] = field(default_factory=list)
    conditions: list[tuple[Number, bool, int]] = field(default_factory=list)
    calls: list[Callable[..., Any]] = field(default_factory=list)
    _known: dict[Any, Any] = field(default_factory=dict)

    def input(self, value: Any) -> Number:
        """A number that is given to the program, with its value in the step that is recorded."""
        return self._new(Operation(INPUT, (len(self.operations),)), value)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        """Say of a computation that fails that it is not recorded.

        A law may use anything of numpy, and what does not work on recorded arrays fails in any way.
        """
        failures = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
        if isinstance(error, failures):
            raise NotRecordableError(str(error)) from error

    def decide(self, number: Number) -> bool:
        """Record that the recording holds only where a number decides as it does now."""
        decided = bool(number.value)
        self.conditions.append((number, decided, len(self.operations)))
        return decided

    def call(self, function: Callable[[int], Any], number: Number, found: Sequence[float]) -> list[Number]:
        """Record a call of a function of a whole number.

        Args:
            function: a list of numbers or an array of a fixed shape, without side effects that matter.
            number: its argument.
            found: numbers that it gives in the step that is recorded.
        """
        own = (getattr(function, "__self__", None), getattr(function, "__func__", function))
        key = (CALL, *own, number.index)
        if key not in self._known:
            self._known[key] = self._called(function, (number,), len(found))
        return self._parts(self._known[key], found)

    def call_with(
        self, function: Callable[[int, Sequence[float]], list[float]], number: Number, further: Sequence[Any]
    ) -> list[Number]:
        """Record a call of a function of a whole number and of further numbers.

        Args:
            function: gives a list of a fixed length; may be called again, with the same result.
            number: its first argument.
            further: numbers or constants, its second argument.
        """
        found = function(number.value, [getattr(item, "value", item) for item in further])
        return self._parts(self._called(function, (number, *further), len(found)), found)

    def _called(self, function: Any, arguments: tuple[Any, ...], size: int) -> Number:
        self.calls.append(function)
        return self._new(Operation(CALL, (len(self.calls) - 1, size, *arguments)), 0.0)

    def _parts(self, whole: Number, found: Sequence[float]) -> list[Number]:
        return [self._once(PART, (whole, position), value) for position, value in enumerate(found)]

    def operate(self, kind: Any, arguments: Sequence[Any]) -> Any:
        """Record an operation; one on constants is done at once.

        Args:
            kind: as in `Operation`.
            arguments: numbers of this recording, or constants.

        Returns:
            A number, or a constant.
        """
        if kind == FLOAT and all(isinstance(getattr(item, "value", item), float) for item in arguments):
            return arguments[0]
        values = [item.value if type(item) is Number else item for item in arguments]
        value = _result(kind, values)
        if not any(type(item) is Number for item in arguments):
            return value
        return self._once(kind, tuple(arguments), value)

    def _once(self, kind: Any, arguments: tuple[Any, ...], value: Any) -> Number:
        """The number of an operation that has been recorded before, or is now."""
        key = (
            kind,
            *(item.index if type(item) is Number else (type(item), repr(item)) for item in arguments),
        )
        if key not in self._known:
            self._known[key] = self._new(Operation(kind, arguments), value)
        number: Number = self._known[key]
        return number

    def _new(self, operation: Operation, value: Any) -> Number:
        self.operations.append(operation)
        return Number(self, len(self.operations) - 1, value)


def is_own(part: Any) -> bool:
    """Whether an object and those in it are of this package, or plain data.

    A part of another package may do more than its result shows, such as count its calls: it is not recorded.
    """
    if isinstance(part, tuple | list):
        return all(map(is_own, part))
    package = type(part).__module__.split(".")[0]
    if dataclasses.is_dataclass(part):
        return package == "satform" and all(is_own(getattr(part, f.name)) for f in dataclasses.fields(part))
    return package in ("satform", "builtins", "numpy", "datetime")


def alike(one: Any, two: Any) -> bool:
    """Whether two numbers or constants are the same one."""
    if type(one) is Number or type(two) is Number:
        return type(one) is type(two) and one.index == two.index
    return repr(one) == repr(two)


def _result(kind: Any, values: Sequence[Any]) -> Any:
    """The value of an operation."""
    match kind:
        case "where":
            return values[1] if values[0] else values[2]
        case "float":
            return float(values[0])
        case "bound":
            return values[0] * values[1]
        case _ if kind in FLOAT_FUNCTIONS:
            return FLOAT_FUNCTIONS[kind](*values)
        case _:
            with np.errstate(all="ignore"):
                return kind(*values).item()
