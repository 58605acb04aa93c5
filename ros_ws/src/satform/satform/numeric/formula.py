# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Formulas that are given as text: arithmetic, a few functions, and names of quantities.

Nothing else of Python is in them. They are evaluated by element-wise operations in a fixed order, so that the
same numbers give the same bits for one satellite and for a thousand.
"""

import ast
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.numeric.elementwise import Array, arctan2

LONGEST = 1000
"""Characters of a formula."""

DEEPEST = 100
"""Operations of a formula one inside another; a sum of N terms without parentheses has N - 1."""

_LARGEST_POWER = 12.0

_FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "abs": (1, np.abs),
    "atan2": (2, arctan2),
    "cos": (1, np.cos),
    "exp": (1, np.exp),
    "max": (2, np.maximum),
    "min": (2, np.minimum),
    "sign": (1, np.sign),
    "sin": (1, np.sin),
    "sqrt": (1, np.sqrt),
    "tanh": (1, np.tanh),
}
"""Number of arguments of each function, and what computes it."""

FUNCTIONS = tuple(_FUNCTIONS)
"""Names of the functions."""

_OPERATORS: dict[type[ast.AST], tuple[int, Callable[..., Any]]] = {
    ast.Add: (2, np.add),
    ast.Sub: (2, np.subtract),
    ast.Mult: (2, np.multiply),
    ast.Div: (2, np.divide),
    ast.USub: (1, np.negative),
    ast.UAdd: (1, np.positive),
}


@dataclass(frozen=True)
class Formula:
    """A formula, ready to be evaluated.

    Attributes:
        operations: in the order in which they are done: a number, the name of a quantity, or a count of
            arguments, taken from the results before, with the function that is applied to them.
    """

    operations: tuple[float | str | tuple[int, Callable[..., Any]], ...]

    def __call__(self, quantities: Mapping[str, Any]) -> Array:
        """The value for given quantities.

        Args:
            quantities: numbers or arrays of one shape, by name.

        Returns:
            That shape, or that of a number; not finite where the formula is not defined.
        """
        results: list[Any] = []
        with np.errstate(all="ignore"):
            for operation in self.operations:
                if isinstance(operation, str):
                    results.append(quantities[operation])
                elif isinstance(operation, float):
                    results.append(np.float64(operation))
                else:
                    count, function = operation
                    arguments = results[-count:]
                    del results[-count:]
                    results.append(function(*arguments))
        value: Array = results[0]
        return value


def parse_formula(text: str, names: Collection[str], constants: Mapping[str, float]) -> Formula:
    """A formula from its text.

    Args:
        text: with + - * / **, parentheses, numbers, names, and the functions of `FUNCTIONS`. Exponents are
            numbers, whole or half, up to 12. At most `DEEPEST` operations are one inside another.
        names: of the quantities that it may depend on.
        constants: numbers by name.

    Returns:
        The formula.

    Raises:
        ValueError: it is no such formula; the message is a sentence.
    """
    if len(text) > LONGEST:
        raise ValueError(f"a formula has at most {LONGEST} characters, this one {len(text)}")
    try:
        tree = _parsed(text.strip())
        if _deeper(tree.body, DEEPEST):
            raise ValueError(
                f"a formula has at most {DEEPEST} operations one inside another, as a sum of {DEEPEST + 1} "
                "terms has; divide longer sums by parentheses"
            )
        operations = tuple(_operations(tree.body, names, constants))
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError(f"'{text}' is not a formula such as -0.2*vx + 0.4*sin(1.5*vx)") from None
    return Formula(operations)


def _parsed(text: str) -> ast.Expression:
    """The syntax tree; what Python only warns of, as 1or x, is a SyntaxError."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return ast.parse(text, mode="eval")


def _deeper(node: ast.expr, levels: int) -> bool:
    """Whether a tree has operations at more than some levels, numbers and names not counted."""
    level: list[ast.AST] = [node]
    for _ in range(levels):
        level = [
            child
            for above in level
            for child in ast.iter_child_nodes(above)
            if isinstance(child, ast.expr) and not isinstance(child, ast.Constant | ast.Name)
        ]
    return bool(level)


def _operations(node: ast.expr, names: Collection[str], constants: Mapping[str, float]) -> list[Any]:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return [_number(value)]
        case ast.Name(id=name) if name in constants:
            return [float(constants[name])]
        case ast.Name(id=name) if name in names:
            return [name]
        case ast.Name(id=name):
            known = ", ".join([*names, *constants])
            raise ValueError(f"there is no quantity '{name}'; there are {known}")
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
            return [*_operations(operand, names, constants), _OPERATORS[type(op)]]
        case ast.BinOp(left=base, op=ast.Pow(), right=exponent):
            return [*_operations(base, names, constants), (1, _Power(_exponent(exponent)))]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            both = [*_operations(left, names, constants), *_operations(right, names, constants)]
            return [*both, _OPERATORS[type(op)]]
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            return _called(name, arguments, names, constants)
    raise ValueError(f"'{ast.unparse(node)}' is not allowed in a formula")


def _number(value: float) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = np.inf
    if not np.isfinite(number):
        raise ValueError("a number in a formula is too large")
    return number


def _called(
    name: str, arguments: list[ast.expr], names: Collection[str], constants: Mapping[str, float]
) -> list[Any]:
    if name not in _FUNCTIONS:
        raise ValueError(f"there is no function '{name}'; there are {', '.join(FUNCTIONS)}")
    count, function = _FUNCTIONS[name]
    if len(arguments) != count:
        raise ValueError(f"{name} takes {count} argument{'s' if count > 1 else ''}, not {len(arguments)}")
    inner = [step for argument in arguments for step in _operations(argument, names, constants)]
    return [*inner, (count, function)]


def _exponent(node: ast.expr) -> float:
    match node:
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=ast.Constant(value=number)):
            factor = -1.0 if isinstance(sign, ast.USub) else 1.0
        case ast.Constant(value=number):
            factor = 1.0
        case _:
            number, factor = None, 1.0
    value = np.inf
    if isinstance(number, int | float) and not isinstance(number, bool) and number <= _LARGEST_POWER:
        value = factor * float(number)
    if not (abs(value) <= _LARGEST_POWER and 2.0 * value == round(2.0 * value)):
        raise ValueError(
            f"an exponent is a whole or half number from {-_LARGEST_POWER:g} to {_LARGEST_POWER:g}, "
            f"not '{ast.unparse(node)}'"
        )
    return value


@dataclass(frozen=True)
class _Power:
    """A power by products and a square root: numpy's own has other bits for numbers than for arrays.

    Attributes:
        exponent: whole or half.
    """

    exponent: float

    def __call__(self, base: Any) -> Any:
        whole = int(abs(self.exponent))
        result = np.sqrt(base) if abs(self.exponent) != whole else None
        for _ in range(whole):
            result = base if result is None else result * base
        result = np.ones_like(base) if result is None else result
        return 1.0 / result if self.exponent < 0.0 else result
