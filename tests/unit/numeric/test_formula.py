# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Formulas given as text: their values against Python's own, and what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.numeric.formula import parse_formula

NAMES = ("x", "y", "t")
CONSTANTS = {"k": 0.25}


def python(text: str, **quantities: float) -> float:
    """What Python makes of the same text."""
    functions = {"abs": abs, "min": min, "max": max, "sign": lambda v: math.copysign(1.0, v) if v else 0.0}
    functions |= {name: getattr(math, name) for name in ("atan2", "cos", "exp", "sin", "sqrt", "tanh")}
    return float(eval(text, {"__builtins__": {}}, {**functions, **CONSTANTS, **quantities}))  # noqa: S307


TEXTS = [
    "0",
    "-k*x + 3e-2*y",
    "x - y - t",
    "x/(1 + y**2)/2",
    "-x**2",
    "2*-x**3 - +y",
    "(x*x + y*y + 1)**1.5",
    "(x*x + 1)**-0.5 + y**0",
    "(1 + x*x)**(-3)",
    "sin(1.5*x)*cos(t) + exp(-abs(y)) - tanh(x/10)",
    "atan2(y, x*x + 1) + sign(x)*min(x, y) - max(k, t)",
    "sqrt(abs(x)) / 7",
]


@pytest.mark.parametrize("text", TEXTS)
@settings(max_examples=20, deadline=None)
@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, 1e4))
def test_a_formula_has_the_value_that_python_gives_its_text(text, x, y, t):
    value = parse_formula(text, NAMES, CONSTANTS)({"x": np.array([x]), "y": np.array([y]), "t": t})
    assert np.ravel(value)[0] == pytest.approx(python(text, x=x, y=y, t=t), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("text", TEXTS)
def test_one_number_and_many_give_the_same_bits(text):
    formula = parse_formula(text, NAMES, CONSTANTS)
    x, y = np.random.default_rng(5).normal(0.0, 20.0, (2, 37))
    many = np.broadcast_to(formula({"x": x, "y": y, "t": 12.5}), (37,))
    for column in range(37):
        single = formula({"x": x[column : column + 1], "y": y[column : column + 1], "t": 12.5})
        assert np.array_equal(np.ravel(single)[0], many[column])


def test_a_formula_that_is_not_defined_gives_no_finite_number_and_no_warning():
    for text in ("1/x", "sqrt(-1)", "1/0", "x**-2", "exp(1000)"):
        with np.errstate(all="raise"):
            assert not np.all(np.isfinite(parse_formula(text, NAMES, {})({"x": np.zeros(2)})))


def test_the_deepest_formulas_have_a_value() -> None:
    sums = "+".join("x" * 101)
    for text, value in ((sums, 202.0), ("-" * 100 + "x", 2.0), ("abs(" * 100 + "x" + ")" * 100, 2.0)):
        assert parse_formula(text, NAMES, {})({"x": np.array([2.0])}) == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is not a formula"),
        ("x +", "is not a formula"),
        ("x = 1", "is not a formula"),
        ("(" * 400 + "x" + ")" * 400, "is not a formula"),
        ("x" * 1001, "at most 1000 characters"),
        ("q", "there is no quantity 'q'; there are x, y, t, k"),
        ("tan(x)", "there is no function 'tan'; there are abs, atan2, cos"),
        ("sin(x, y)", "sin takes 1 argument, not 2"),
        ("min(x)", "min takes 2 arguments, not 1"),
        ("x**y", "an exponent is a whole or half number from -12 to 12, not 'y'"),
        ("x**0.3", "not '0.3'"),
        ("x**99", "not '99'"),
        ("x**'3'", "an exponent is a whole or half number from -12 to 12, not ''3''"),
        ("x**b'3'", "not 'b'3''"),
        ("x**True", "not 'True'"),
        ("x**-True", "not '-True'"),
        ("x**--2", "not '--2'"),
        ("x**(1 + 2)", "not '1 + 2'"),
        ("x**2j", "not '2j'"),
        ("x**1" + "0" * 400, "an exponent is"),
        ("1or x", "is not a formula"),
        ("1if x else y", "is not a formula"),
        ("-" * 101 + "x", "a formula has at most 100 operations one inside another"),
        ("sin(" * 101 + "x" + ")" * 101, "a formula has at most 100 operations one inside another"),
        ("+".join("x" * 102), "as a sum of 101 terms has; divide longer sums by parentheses"),
        ("__import__('os')", "there is no function '__import__'"),
        ("x.real", "'x.real' is not allowed"),
        ("[x][0]", "is not allowed"),
        ("x if x else y", "is not allowed"),
        ("x < y", "is not allowed"),
        ("x // y", "is not allowed"),
        ("sin(x=1)", "is not allowed"),
        ("'x'", "is not allowed"),
        ("True", "is not allowed"),
        ("1e999", "too large"),
        ("1" + "0" * 400, "too large"),
        ("1j", "is not allowed"),
        ("lambda: 0", "is not allowed"),
    ],
)
def test_what_is_no_formula_is_refused_in_a_sentence(text, said):
    with pytest.raises(ValueError, match=r".") as caught:
        parse_formula(text, NAMES, CONSTANTS)
    assert said in str(caught.value)
