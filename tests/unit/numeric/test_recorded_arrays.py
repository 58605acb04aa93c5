# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Formulas over arrays that are recorded and repeated on floats have the bits of numpy's own arithmetic."""

import math
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from satform.numeric.elementwise import (
    arctan2,
    blank,
    column,
    constant,
    cross,
    dot,
    joined,
    norm,
    over_arrays,
)
from satform.numeric.recorded_arrays import Recorded, Recording, elements
from satform.numeric.recording import NotRecordableError
from satform.numeric.straight_line import Program, program

Array = NDArray[np.float64]
Formula = Callable[[Any, Any, Any], Any]


def bits(values: Any) -> bytes:
    flat = np.ravel(values).astype(np.float64).tolist()
    return struct.pack(f"{len(flat)}d", *flat)


def recording_of(formula: Formula, first: Array, second: Array) -> tuple[Program, int]:
    """A program that gives a formula of the step's number and two arrays, which it carries unchanged."""
    recording = Recording()
    step = recording.inputs(np.asarray(3))
    given = [recording.inputs(first), recording.inputs(second)]
    result = formula(*given, step)
    carried = [(number, number) for array in given for number in elements(array)]
    return program(recording, elements(step)[0], carried, elements(result)), result.size


def repeated(formula: Formula, first: Array, second: Array, *, step: int = 3, end: int = 4) -> Any:
    """What a program of a formula, recorded with other numbers, gives of these."""
    generator = np.random.default_rng(7)
    own, _ = recording_of(
        formula, generator.uniform(0.5, 1.0, first.shape), generator.uniform(0.5, 1.0, second.shape)
    )
    rows: list[float] = []
    reached, _ = own.run(step, end, [*first.ravel().tolist(), *second.ravel().tolist()], rows)
    return rows if reached == end else reached


def chosen(a: Any, b: Any) -> Any:
    return np.where((a > b) & ~(a < 0.1) | (b == a), np.abs(a) * 2.0, -b)


def divided(a: Any, b: Any) -> Any:
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0.0)


def largest(a: Any) -> Any:
    index = np.argmax(a * 0.0 + [[0.0, 2.0, 2.0]], axis=-1)
    return np.take_along_axis(a, index[..., None], axis=-1)


def in_place(a: Any) -> Any:
    image = 2.0 * a
    part = image[..., :2]
    part += 3.0 * a[..., 1::-1]
    image[..., 2] = 1.0
    image -= 0.25
    return image


FORMULAS: dict[str, Formula] = {
    "arithmetic": lambda a, b, k: (a + 1.1 * b - a / b) * -a,
    "step": lambda a, b, k: a + (k + 1) * 0.1,
    "functions": lambda a, b, k: np.sqrt(np.abs(a)) + np.sin(a) * np.cos(b) + np.rint(3.0 * a),
    "slow functions": lambda a, b, k: np.exp(a) + np.tanh(b) + np.cbrt(a) + np.arctan(b),
    "larger and smaller": lambda a, b, k: np.minimum(np.maximum(a, b), 0.3) * np.sign(a - b),
    "choice": lambda a, b, k: chosen(a, b),
    "guarded division": lambda a, b, k: divided(a, b),
    "vectors": lambda a, b, k: cross(a, b) * column(dot(a, b) / norm(a + b)),
    "angles": lambda a, b, k: arctan2(a, b) + over_arrays(math.expm1)(a),
    "largest": lambda a, b, k: largest(a) + b,
    "one number": lambda a, b, k: constant(a.shape, 0.5 * k) - constant(a.shape, 2),
    "shapes": lambda a, b, k: np.concatenate((np.stack((a, b)), np.swapaxes(joined(a, b), 0, -1)), axis=0),
    "in place": lambda a, b, k: in_place(a) + in_place(b),
    "one after another": lambda a, b, k: np.add.accumulate(a * b, axis=-1)[..., -1],
    "extremes": lambda a, b, k: np.min(a, axis=-1, keepdims=True) - b.max(),
    "counts": lambda a, b, k: (a > b).astype(np.float64) + np.any(a > 0.9 * b, axis=-1)[..., None],
    "constants": lambda a, b, k: a + np.full_like(b, 2.0) * np.ones_like(a) + 0.0,
}  # fmt: skip


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("seed", range(3))
def test_a_program_of_a_formula_has_its_bits(name: str, seed: int) -> None:
    if name == "shapes":
        first, second = np.random.default_rng(seed).uniform(-2.0, 2.0, (2, 2, 2))
    else:
        first, second = np.random.default_rng(seed).uniform(-2.0, 2.0, (2, 5, 3))
    formula = FORMULAS[name]
    assert bits(repeated(formula, first, second)) == bits(formula(first, second, 3))


@pytest.mark.parametrize("name", ["larger and smaller", "choice", "functions", "constants"])
def test_zeros_keep_their_sign_and_infinity_passes(name: str) -> None:
    values = np.array([0.0, -0.0, 0.5, -0.5, 1.5, 2.5])
    first, second = (grid.ravel() for grid in np.meshgrid(values, values))
    formula = FORMULAS[name]
    assert bits(repeated(formula, first, second)) == bits(formula(first, second, 3))


def test_a_program_carries_numbers_from_step_to_step() -> None:
    recording = Recording()
    step = recording.inputs(np.asarray(0))
    position, velocity = recording.inputs(np.asarray(1.0)), recording.inputs(np.asarray(0.0))
    faster = velocity - 0.01 * position
    further = position + 0.01 * faster
    pairs = [(elements(position)[0], elements(further)[0]), (elements(velocity)[0], elements(faster)[0])]
    own = program(recording, elements(step)[0], pairs, elements(position))
    rows: list[float] = []
    reached, (x, v) = own.run(0, 1000, (1.0, 0.0), rows)
    assert reached == len(rows) == 1000
    # Symplectic Euler's method keeps x^2 + v^2 - h x v of the oscillator.
    assert math.isclose(x * x + v * v - 0.01 * x * v, 1.0, rel_tol=1e-12)


def test_a_program_stops_before_the_step_with_another_branch() -> None:
    def formula(a: Any, b: Any, k: Any) -> Any:
        return a if k < 6 else b

    assert repeated(formula, np.ones(1), np.ones(1), step=3, end=10) == 6


def test_a_program_stops_where_numpy_goes_on_with_infinity() -> None:
    assert repeated(lambda a, b, k: a / b, np.ones(1), np.zeros(1)) == 3
    assert repeated(lambda a, b, k: np.sqrt(a), -np.ones(1), np.ones(1)) == 3


def test_a_function_of_the_step_is_called_as_it_is() -> None:
    table = np.random.default_rng(1).uniform(size=(20, 3))

    def row(step: int) -> Array:
        return table[step]

    def formula(a: Any, b: Any, k: Any) -> Any:
        return a + 2.0 * (k.called(row) if isinstance(k, Recorded) else row(k)) + 3.0 * b

    found = repeated(formula, np.ones(3), np.ones(3), step=5, end=7)
    assert bits(found) == bits([1.0 + 2.0 * table[5] + 3.0, 1.0 + 2.0 * table[6] + 3.0])


@pytest.mark.parametrize(
    "formula",
    [
        lambda a, b, k: a + float(b[0, 0]),
        lambda a, b, k: a[k],
        lambda a, b, k: a * np.sum(b),
        lambda a, b, k: a @ b.T,
        lambda a, b, k: np.argsort(a),
        lambda a, b, k: a * (2.0 if (a > b) else 1.0),
        lambda a, b, k: np.linalg.norm(a),
        lambda a, b, k: np.array(a, dtype=np.float64),
        lambda a, b, k: np.vdot(a, b),
    ],
)
def test_what_is_no_list_of_operations_is_not_recorded(formula: Formula) -> None:
    with pytest.raises(NotRecordableError):
        recording_of(formula, np.ones((2, 3)), np.ones((2, 3)))


def test_results_are_not_written_into_plain_arrays() -> None:
    def formula(a: Any, b: Any, k: Any) -> Any:
        whole = np.zeros(3)
        whole += a
        return whole

    with pytest.raises(NotRecordableError):
        recording_of(formula, np.ones(3), np.ones(3))
    assert type(blank((2,), np.float64(1.0), np.zeros(2))) is np.ndarray
