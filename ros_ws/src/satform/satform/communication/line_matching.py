# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An antenna at the end of a lossless line: reflection, input impedance, and the stubs that match it.

All formulas are closed (Pozar, Microwave Engineering, 4th ed., sections 2.3, 2.4 and 5.2). Lengths are in
wavelengths on the line.
"""

import cmath
import math
from dataclasses import dataclass

_MATCHED = 1e-12
"""Magnitude of a reflection coefficient below which a load counts as matched; one that is nearer to 1 than
this counts as 1. Coefficients nearer to 1 than this have an infinite impedance."""


@dataclass(frozen=True)
class Stub:
    """A line across the main line, short-circuited or open at its end, that matches the load.

    Attributes:
        position: distance from the load, wavelengths, in [0, 0.5).
        susceptance: of the stub, times the characteristic impedance.
        short: length of a short-circuited stub, wavelengths, in (0, 0.5).
        open: length of an open stub, wavelengths, in (0, 0.5).
    """

    position: float
    susceptance: float
    short: float
    open: float


@dataclass(frozen=True)
class Line:
    """A lossless line with a load at its end.

    Attributes:
        load: impedance of the load, ohm.
        characteristic: impedance of the line, ohm.
        length: of the line, wavelengths.
    """

    load: complex
    characteristic: float
    length: float

    def __post_init__(self) -> None:
        """Refuse what is no passive load on a line.

        Raises:
            ValueError: it is not.
        """
        if not (math.isfinite(self.characteristic) and self.characteristic > 0.0):
            raise ValueError(f"the characteristic impedance is {self.characteristic:g} ohm; it is positive")
        if not (cmath.isfinite(self.load) and self.load.real >= 0.0):
            raise ValueError(f"the load is {impedance_text(self.load)} ohm; its resistance is not negative")
        if not (math.isfinite(self.length) and self.length >= 0.0):
            raise ValueError(f"the line has {self.length:g} wavelengths; it has zero or more")

    @property
    def reflection(self) -> complex:
        """Voltage reflection coefficient at the load."""
        return (self.load - self.characteristic) / (self.load + self.characteristic)

    def reflection_at(self, distance: float) -> complex:
        """Voltage reflection coefficient at a distance from the load in wavelengths."""
        return self.reflection * cmath.exp(-2j * math.tau * math.fmod(distance, 0.5))

    def impedance_at(self, distance: float) -> complex:
        """Impedance towards the load at a distance from it in wavelengths, ohm; may be infinite."""
        reflection = self.reflection_at(distance)
        if abs(1.0 - reflection) < _MATCHED:
            return complex(math.inf)
        found = self.characteristic * (1.0 + reflection) / (1.0 - reflection)
        # Where all is reflected, rounding leaves a resistance of either sign.
        return complex(max(0.0, found.real) if self.load.real else 0.0, found.imag)

    @property
    def takes_power(self) -> bool:
        """Whether the load takes any power, and can be matched; false for a reactance."""
        return abs(self.reflection) < 1.0 - _MATCHED

    @property
    def input_impedance(self) -> complex:
        """Impedance at the input of the line, ohm."""
        return self.impedance_at(self.length)

    @property
    def standing_wave_ratio(self) -> float:
        """Largest voltage along the line divided by the smallest; infinite where all is reflected."""
        magnitude = self._magnitude
        return math.inf if magnitude == 1.0 else (1.0 + magnitude) / (1.0 - magnitude)

    @property
    def return_loss(self) -> float:
        """Incident power over reflected power, dB; infinite for a matched load."""
        magnitude = self._magnitude
        return math.inf if magnitude == 0.0 else max(0.0, -20.0 * math.log10(magnitude))

    @property
    def mismatch_loss(self) -> float:
        """Incident power over the power that the load takes, dB; infinite where all is reflected."""
        return mismatch_loss(self._magnitude)

    @property
    def _magnitude(self) -> float:
        """Of the reflection coefficient: 1 without rounding for a reactance."""
        return min(abs(self.reflection), 1.0) if self.load.real else 1.0

    def stubs(self) -> tuple[Stub, ...]:
        """Both places at which a shunt stub matches the load; none where the load is matched already.

        The stub has the line's characteristic impedance. It stands where the normalised admittance is 1 + jb,
        and has the susceptance -b (Pozar, section 5.2).

        Raises:
            ValueError: the load takes no power, so that nothing matches it.
        """
        magnitude, angle = cmath.polar(self.reflection)
        if magnitude < _MATCHED:
            return ()
        if not self.takes_power:
            raise ValueError(
                f"the load of {impedance_text(self.load)} ohm takes no power, so that no stub matches it"
            )
        # Where g = 1, the real part of the reflection coefficient is minus its squared magnitude.
        turned = math.acos(-magnitude)
        found = []
        for sign in (1.0, -1.0):
            position = ((angle - sign * turned) / (2.0 * math.tau)) % 0.5
            susceptance = sign * 2.0 * magnitude / math.sqrt((1.0 - magnitude) * (1.0 + magnitude))
            short = (math.atan2(-1.0, susceptance) / math.tau) % 0.5
            found.append(Stub(position, susceptance, short, (math.atan(susceptance) / math.tau) % 0.5))
        first, second = sorted(found, key=lambda stub: stub.position)
        return first, second


def mismatch_loss(reflection: complex) -> float:
    """Power on a line over the power that crosses a reflection, dB; infinite where all is reflected.

    Args:
        reflection: voltage reflection coefficient.
    """
    magnitude = abs(reflection)
    passed = (1.0 - magnitude) * (1.0 + magnitude)
    return math.inf if passed <= 0.0 else max(0.0, -10.0 * math.log10(passed))


def impedance_text(impedance: complex) -> str:
    """An impedance as it is written on the command line."""
    if not cmath.isfinite(impedance):
        return "infinite"
    return f"{impedance.real:.6g}{impedance.imag:+.6g}j"


def parse_impedance(text: str) -> complex:
    """An impedance from text such as `25-40j`, `25-j40` or `75`.

    Raises:
        ValueError: the text is none, or is not finite.
    """
    plain = text.replace(" ", "").lower().replace("i", "j")
    # Engineers also write the unit in front of the reactance.
    for sign in "+-":
        before, found, after = plain.rpartition(f"{sign}j")
        if found and after:
            plain = f"{before}{sign}{after}j"
    if plain.startswith("j") and len(plain) > 1:
        plain = f"{plain[1:]}j"
    value = complex(plain)
    if not cmath.isfinite(value):
        raise ValueError(f"{text} is not finite")
    return value
