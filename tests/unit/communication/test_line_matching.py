# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reflection on a line and matching stubs, against textbook examples and chain matrices."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from satform.communication.line_matching import Line, mismatch_loss, parse_impedance

# Chain (ABCD) matrices: an independent algebra of two-ports (Pozar, 4th ed., table 4.1).


def chain_of_line(z0: float, length: float) -> np.ndarray:
    angle = math.tau * length
    return np.array(
        [[math.cos(angle), 1j * z0 * math.sin(angle)], [1j / z0 * math.sin(angle), math.cos(angle)]]
    )


def impedance_into(chain: np.ndarray, load: complex) -> complex:
    voltage, current = chain @ np.array([load, 1.0])
    return complex(voltage / current)


def shunt(admittance: complex) -> np.ndarray:
    return np.array([[1.0, 0.0], [admittance, 1.0]])


def test_pozar_example_2_2() -> None:
    # D. M. Pozar, Microwave Engineering, 4th ed., example 2.2: 40 + j70 ohm on 100 ohm, 0.3 wavelengths.
    line = Line(40.0 + 70.0j, 100.0, 0.3)
    assert abs(line.reflection) == pytest.approx(0.59, abs=5e-3)
    assert line.standing_wave_ratio == pytest.approx(3.87, abs=5e-3)
    assert line.return_loss == pytest.approx(4.6, abs=5e-2)
    assert line.mismatch_loss == pytest.approx(-10.0 * math.log10(1.0 - abs(line.reflection) ** 2))
    expected = (
        100.0
        * (line.load + 100j * math.tan(math.tau * 0.3))
        / (100.0 + 1j * line.load * math.tan(math.tau * 0.3))
    )
    assert line.input_impedance == pytest.approx(expected, rel=1e-12)


def test_pozar_problem_5_3() -> None:
    # Problem 5.3 of the same book, open shunt stubs for 100 + j80 ohm on 75 ohm, as worked out in MATLAB at
    # https://jgb2012.wixsite.com/microwave-eng-matlab.
    first, second = Line(100.0 + 80.0j, 75.0, 0.0).stubs()
    assert (first.position, first.open) == pytest.approx((0.227640974365225, 0.377602825442528), abs=1e-12)
    assert (second.position, second.open) == pytest.approx((0.405911259087935, 0.122397174557472), abs=1e-12)


@given(st.floats(0.01, 1e4), st.floats(-1e4, 1e4), st.floats(1.0, 600.0), st.floats(0.0, 3.0))
def test_line_and_stubs_agree_with_chain_matrices(
    resistance: float, reactance: float, z0: float, length: float
) -> None:
    line = Line(complex(resistance, reactance), z0, length)
    entry = impedance_into(chain_of_line(z0, length), line.load)
    # Compared as reflections: impedances become arbitrarily large.
    assert abs((entry - z0) / (entry + z0) - line.reflection_at(length)) < 1e-9
    for stub in line.stubs():
        for susceptance in (-1.0 / math.tan(math.tau * stub.short), math.tan(math.tau * stub.open)):
            matched = impedance_into(
                shunt(1j * susceptance / z0) @ chain_of_line(z0, stub.position), line.load
            )
            # The susceptance of a stub is known as well as its length: to about its square times an ulp.
            assert abs((matched - z0) / (matched + z0)) < 1e-12 * (10.0 + susceptance**2)


def test_a_matched_load_needs_no_stub_and_a_reactance_has_none() -> None:
    assert Line(50.0 + 0.0j, 50.0, 0.3).stubs() == ()
    assert Line(50.0 + 0.0j, 50.0, 0.3).return_loss == math.inf
    with pytest.raises(ValueError, match=r"the load of 0\+25j ohm takes no power"):
        Line(25j, 50.0, 0.0).stubs()
    assert Line(25j, 50.0, 0.0).standing_wave_ratio == pytest.approx(math.inf, abs=1e15)
    assert mismatch_loss(1.0) == math.inf


def test_a_quarter_wavelength_makes_an_open_end_of_a_short_circuit() -> None:
    for turns in range(20):
        assert not cmath.isfinite(Line(0j, 50.0, 0.25 + 0.5 * turns).input_impedance)
    assert Line(20.0 + 0j, 50.0, 0.25).input_impedance == pytest.approx(125.0)


@given(st.floats(-1e6, 1e6), st.floats(1.0, 600.0), st.floats(0.0, 3.0))
def test_a_reactance_reflects_all_and_stays_a_reactance(reactance: float, z0: float, length: float) -> None:
    line = Line(complex(0.0, reactance), z0, length)
    assert not line.takes_power
    assert (line.standing_wave_ratio, line.mismatch_loss) == (math.inf, math.inf)
    assert str(line.return_loss) == "0.0"
    entry = line.input_impedance
    assert entry.real == 0.0 or not cmath.isfinite(entry)
    assert str(Line(complex(z0, 0.0), z0, length).mismatch_loss) == "0.0"


@pytest.mark.parametrize(
    ("load", "z0", "length", "words"),
    [
        (-1.0 + 0j, 50.0, 0.0, "its resistance is not negative"),
        (50.0 + 0j, 0.0, 0.0, "it is positive"),
        (50.0 + 0j, 50.0, -0.1, "it has zero or more"),
        (complex(math.inf, 0.0), 50.0, 0.0, "the load is infinite ohm"),
    ],
)
def test_what_is_no_passive_load_on_a_line_is_rejected(
    load: complex, z0: float, length: float, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        Line(load, z0, length)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("25-40j", 25 - 40j),
        ("25-j40", 25 - 40j),
        ("75", 75 + 0j),
        ("-j12.5", -12.5j),
        ("j3", 3j),
        ("1e2+1e-1j", 100 + 0.1j),
        ("50 + 20i", 50 + 20j),
    ],
)
def test_an_impedance_is_read_as_engineers_write_it(text: str, value: complex) -> None:
    assert parse_impedance(text) == value


@pytest.mark.parametrize("text", ["", "abc", "25-40", "25-40j5", "inf", "nanj"])
def test_what_is_no_impedance_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"malformed|not finite"):
        parse_impedance(text)
