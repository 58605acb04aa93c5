# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Programs on floats, made from recordings of formulas over arrays.

Python's arithmetic on floats is that of IEEE 754, operation by operation, as numpy's is. Functions whose
bits differ between Python's library and numpy are numpy's own, called on a float; which these are is found
once, on this machine.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.numeric.elementwise import FLOAT_FUNCTIONS
from satform.numeric.recording import BOUND, CALL, FLOAT, INPUT, PART, WHERE, Number, NumberRecording

_DEEPEST = 30
"""Operations one inside another in an expression of a program."""

_PROBES = 4096
"""Numbers on which a function of Python is compared with that of numpy."""

_TEMPLATES: dict[Any, str] = {
    np.add: "({0} + {1})",
    np.subtract: "({0} - {1})",
    np.multiply: "({0} * {1})",
    np.true_divide: "({0} / {1})",
    np.negative: "(-{0})",
    np.positive: "{0}",
    np.absolute: "abs({0})",
    np.sqrt: "sqrt({0})",
    np.less: "({0} < {1})",
    np.less_equal: "({0} <= {1})",
    np.greater: "({0} > {1})",
    np.greater_equal: "({0} >= {1})",
    np.equal: "({0} == {1})",
    np.not_equal: "({0} != {1})",
    np.logical_and: "(True if {0} and {1} else False)",
    np.logical_or: "(True if {0} or {1} else False)",
    np.logical_not: "(not {0})",
    np.isnan: "isnan({0})",
    np.isfinite: "isfinite({0})",
    WHERE: "({1} if {0} else {2})",
    FLOAT: "float({0})",
    BOUND: "({0} * {1})",
}

# Templates with an argument more than once: it has to be a name.
_REPEATING: dict[Any, str] = {
    np.maximum: "({0} if {0} > {1} or {0} != {0} else {1})",
    np.minimum: "({0} if {0} < {1} or {0} != {0} else {1})",
    np.sign: "(1.0 if {0} > 0.0 else (-1.0 if {0} < 0.0 else ({0} if {0} != {0} else 0.0)))",
    np.rint: "copysign(round({0}), {0})",
}

_MATHEMATICAL: dict[Any, Callable[[float], float]] = {
    np.sin: math.sin,
    np.cos: math.cos,
    np.tan: math.tan,
    np.exp: math.exp,
    np.tanh: math.tanh,
    np.arcsin: math.asin,
    np.arccos: math.acos,
    np.arctan: math.atan,
    np.log: math.log,
}


@dataclass(frozen=True)
class Program:
    """A step of a computation as a program on floats, which repeats it.

    Attributes:
        run: called with the number of the first step and of the step after the last, what is carried from
            step to step, and a list to which the results of each step are added. It gives the number of the
            step that comes next, and what is carried into it: before the end where a condition of the
            recording does not hold in a step, or the arithmetic of Python raises where that of numpy goes on
            with infinity or NaN.
        source: of the program.
    """

    run: Callable[[int, int, Sequence[float], list[float]], tuple[int, tuple[float, ...]]]
    source: str


def program(
    recording: NumberRecording, step: Number, carried: Sequence[tuple[Number, Any]], results: Sequence[Any]
) -> Program:
    """The program of a recorded step.

    Args:
        recording: of the step.
        step: the input that is its number.
        carried: each other input, with the number or constant that it is in the following step.
        results: numbers and constants that the step gives.
    """
    return _Writer(recording, step).program(carried, results)


class _Writer:
    """Writes a program."""

    def __init__(self, recording: NumberRecording, step: Number) -> None:
        self._recording = recording
        self._names: dict[int, str] = {step.index: "k"}
        self._space: dict[str, Any] = {
            name: getattr(math, name) for name in ("sqrt", "isnan", "isfinite", "copysign")
        }
        self._space |= {"nan": math.nan, "inf": math.inf}
        self._lines: list[str] = []
        self._expressions: dict[int, tuple[str, int]] = {}

    def program(self, carried: Sequence[tuple[Number, Any]], results: Sequence[Any]) -> Program:
        recording = self._recording
        following = [after for _, after in carried]
        conditions = [number for number, _, _ in recording.conditions]
        uses = self._uses([*following, *results, *conditions])
        for position, (number, _) in enumerate(carried):
            self._names[number.index] = f"c{position}"
        ahead = list(recording.conditions)
        for index, operation in enumerate(recording.operations):
            while ahead and ahead[0][2] <= index:
                self._condition(*ahead.pop(0)[:2])
            if uses.get(index) and operation.kind != INPUT:
                self._operation(index, operation.kind, operation.arguments, uses[index])
        for number, decided, _ in ahead:
            self._condition(number, decided)
        own = [self._names[number.index] for number, _ in carried]
        return self._finished(own, [self._name(item) for item in following], [self._name(r) for r in results])

    def _finished(self, own: list[str], following: list[str], results: list[str]) -> Program:
        names, values, after = ("".join(f"{item}, " for item in part) for part in (own, results, following))
        lines = [
            "def run(k, end, carried, rows):",
            f"    {names}= carried" if own else "    pass",
            "    try:",
            "        while k < end:",
            *(f"            {line}" for line in self._lines),
            f"            rows.extend(({values}))",
            f"            {names}= {after}" if own else "            pass",
            "            k += 1",
            "    except (ArithmeticError, ValueError):",
            "        pass",
            f"    return k, ({names})",
        ]
        source = "\n".join(lines) + "\n"
        exec(compile(source, "<recorded step>", "exec"), self._space)  # noqa: S102  written above
        return Program(self._space["run"], source)

    def _uses(self, wanted: Sequence[Any]) -> dict[int, int]:
        """How often each operation is used; those that nothing needs are not in it."""
        found: dict[int, int] = {}
        ahead = [item for item in wanted if type(item) is Number]
        for number in ahead:
            found[number.index] = found.get(number.index, 0) + 2
        for index in range(len(self._recording.operations) - 1, -1, -1):
            if index in found:
                for item in self._recording.operations[index].arguments:
                    if type(item) is Number:
                        found[item.index] = found.get(item.index, 0) + 1
        return found

    def _condition(self, number: Number, decided: bool) -> None:
        test = self._name(number)
        self._lines.append(f"if {'not ' if decided else ''}{test}: break")

    def _operation(self, index: int, kind: Any, arguments: Sequence[Any], uses: int) -> None:
        if kind == CALL:
            position, size, number, *given = arguments
            called = self._recording.calls[position]
            call = f"call{position}"
            self._space[call] = called if given else lambda step: np.asarray(called(step)).ravel().tolist()
            values = f", ({''.join(f'{self._name(item)}, ' for item in given)})" if given else ""
            names = [f"p{index}_{part}" for part in range(size)]
            self._lines.append(f"[{', '.join(names)}] = {call}({self._name(number)}{values})")
            return
        if kind == PART:
            whole, position = arguments
            self._names[index] = f"p{whole.index}_{position}"
            return
        text, depth = self._expression(kind, arguments)
        if uses == 1 and depth < _DEEPEST:
            self._expressions[index] = (text, depth)
            return
        self._names[index] = f"v{index}"
        self._lines.append(f"v{index} = {text}")

    def _expression(self, kind: Any, arguments: Sequence[Any]) -> tuple[str, int]:
        if kind in _REPEATING and _agrees(kind):
            return _REPEATING[kind].format(*(self._name(item) for item in arguments)), 1
        texts, depths = zip(*(self._text(item) for item in arguments), strict=True)
        depth = 1 + max(depths)
        if kind in _TEMPLATES:
            return _TEMPLATES[kind].format(*texts), depth
        own = FLOAT_FUNCTIONS.get(kind, kind).__name__
        name = f"f{'loat' if kind in FLOAT_FUNCTIONS else ''}_{own}"
        self._space[name], taken = _function(kind)
        return f"{name}({', '.join(texts)}){taken}", depth

    def _text(self, item: Any) -> tuple[str, int]:
        if type(item) is Number and item.index in self._expressions:
            return self._expressions.pop(item.index)
        return self._name(item), 0

    def _name(self, item: Any) -> str:
        """A name or a constant."""
        if type(item) is not Number:
            return f"({item!r})" if item < 0 else repr(item)
        if item.index not in self._names:
            text, _ = self._expressions.pop(item.index)
            self._names[item.index] = f"v{item.index}"
            self._lines.append(f"v{item.index} = {text}")
        return self._names[item.index]


def _function(kind: Any) -> tuple[Callable[..., Any], str]:
    """What computes a function of floats, and what is written after a call of it to have a float."""
    if kind in FLOAT_FUNCTIONS:
        return FLOAT_FUNCTIONS[kind], ""
    if kind in _MATHEMATICAL and _agrees(kind):
        return _MATHEMATICAL[kind], ""
    compiled = _compiled(kind.__name__) if kind.__name__ == "ellipeinc" else None
    return (kind, ".item()") if compiled is None else (compiled, "")


@functools.cache
def _agrees(kind: Any) -> bool:
    """Whether a function of Python has the bits of numpy's."""
    probes = np.random.default_rng(1).uniform(-1.0, 1.0, _PROBES)
    if kind in (np.maximum, np.minimum, np.sign, np.rint):
        space = {"copysign": math.copysign}
        own = eval(f"lambda a, b: {_REPEATING[kind].format('a', 'b')}", space)  # noqa: S307  a template above
        probes = np.concatenate((probes[:64], (0.0, -0.0, 0.5, -0.5, 1.5, -1.5, 0.25, -0.25)))
        if kind.nin == 1:
            return _same(kind(probes), [own(a, a) for a in probes.tolist()])
        first, second = (grid.ravel() for grid in np.meshgrid(probes, probes))
        pairs = zip(first.tolist(), second.tolist(), strict=True)
        return _same(kind(first, second), [own(a, b) for a, b in pairs])
    if kind in (np.sin, np.cos, np.tan):
        probes = 100.0 * probes
    elif kind is np.log:
        probes = np.abs(probes) + 1e-3
    return _same(kind(probes), [_MATHEMATICAL[kind](value) for value in probes.tolist()])


@functools.cache
def _compiled(name: str) -> Callable[..., float] | None:
    """A function of scipy in the form for single numbers, if it has the bits of the one for arrays."""
    from scipy import special  # noqa: PLC0415  slow to import, and only curves need it
    from scipy.special import cython_special  # noqa: PLC0415

    own: Callable[..., float] = getattr(cython_special, name)
    generator = np.random.default_rng(1)
    first, second = generator.uniform(-1.6, 1.6, _PROBES), -generator.exponential(3.0, _PROBES)
    values = [own(a, b) for a, b in zip(first.tolist(), second.tolist(), strict=True)]
    return own if _same(getattr(special, name)(first, second), values) else None


def _same(first: Any, second: list[float]) -> bool:
    return np.asarray(first, dtype=np.float64).tobytes() == np.asarray(second, dtype=np.float64).tobytes()
