# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Antennas: gain in a direction of the body axes, of a single antenna or of an array of elements."""

import math
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field, model_validator

from satform.common.physical_constants import SPEED_OF_LIGHT
from satform.common.spec import NonNegative, Number, Positive, Spec, Vector
from satform.communication.line_matching import Line, mismatch_loss
from satform.numeric.directions import require_direction, unit
from satform.numeric.elementwise import Array, dot

_MOST_ELEMENTS = 1024

MOST_DECIBELS = 300.0
"""Magnitude that gains and losses may have at most, dB."""

Gain: TypeAlias = Annotated[float, Field(ge=-MOST_DECIBELS, le=MOST_DECIBELS)]


class AntennaSpec(Spec):
    """What all antennas have: how they are matched to their line."""

    impedance: tuple[NonNegative, Number] | None = None
    """Resistance and reactance of the antenna at the carrier's frequency, ohm; matched when left out."""
    line_impedance: Positive = 50.0
    """Characteristic impedance of the lossless line to the antenna, ohm."""

    @property
    def mismatch_loss(self) -> float:
        """Power on the line over power that the antenna takes, dB; infinite where it takes none."""
        if self.impedance is None:
            return 0.0
        return mismatch_loss(Line(complex(*self.impedance), self.line_impedance, 0.0).reflection)

    @model_validator(mode="after")
    def _takes_power(self) -> "AntennaSpec":
        if math.isinf(self.mismatch_loss):
            raise ValueError("impedance: an antenna without resistance takes no power")
        return self

    def gain(self, direction: Array, frequency: float) -> Array:
        """Gain relative to an isotropic antenna, as a factor, without the mismatch.

        Args:
            direction: of the other satellite, unit vectors in body axes, shape (..., 3).
            frequency: Hz.

        Returns:
            Shape (...).
        """
        raise NotImplementedError


class IsotropicSpec(AntennaSpec):
    """The same gain in all directions."""

    kind: Literal["isotropic"] = "isotropic"
    peak_gain: Gain = 0.0
    """dBi."""

    def gain(self, direction: Array, frequency: float) -> Array:
        """As of every antenna."""
        return np.full(direction.shape[:-1], factor(self.peak_gain))


class BeamSpec(AntennaSpec):
    """One beam that is fixed to the body: a horn, patch or dish.

    The gain falls by 12 dB times the squared angle in beamwidths, down to a floor.
    """

    kind: Literal["beam"] = "beam"
    peak_gain: Gain
    """Along the boresight, dBi."""
    beamwidth: Annotated[float, Field(gt=0.0, le=2.0 * math.pi)]
    """Full angle between the directions of half the gain, rad."""
    boresight: Vector = (1.0, 0.0, 0.0)
    """Direction in body axes; its length does not matter."""
    floor: Gain = -20.0
    """Gain in all directions far from the boresight, dBi."""

    @model_validator(mode="after")
    def _points(self) -> "BeamSpec":
        require_direction(self.boresight, "boresight")
        if self.floor > self.peak_gain:
            raise ValueError(f"floor {self.floor:g} dBi is above peak_gain {self.peak_gain:g} dBi")
        return self

    def gain(self, direction: Array, frequency: float) -> Array:
        """As of every antenna."""
        cosine = np.clip(dot(direction, unit(self.boresight)), -1.0, 1.0)
        ratio = np.arccos(cosine) / self.beamwidth
        decay = np.exp(-1.2 * math.log(10.0) * (ratio * ratio))
        return np.maximum(factor(self.peak_gain) * decay, factor(self.floor))


class ArraySpec(AntennaSpec):
    """A phased array of equal elements: one beam follows the other satellite, or several beams are fixed.

    The pattern is that of an element times the array factor, for equal amplitudes and phases that add up in
    the direction of the beam. Coupling between elements is neglected. Of several beams, the one with the
    largest gain is used.
    """

    kind: Literal["array"] = "array"
    elements: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=_MOST_ELEMENTS)]
    """Positions of the elements in body axes, m."""
    boresight: Vector = (1.0, 0.0, 0.0)
    """Direction in body axes in which an element has its largest gain; its length does not matter."""
    element_exponent: Annotated[float, Field(ge=0.0, le=100.0)] = 1.0
    """q of an element's gain 2 (q + 1) cos(angle)^q in front of the array; behind it the gain is zero."""
    beams: tuple[Vector, ...] = ()
    """Directions of fixed beams in body axes; when left out, one beam follows the other satellite."""
    scan_limit: Annotated[float, Field(gt=0.0, le=0.5 * math.pi)] = 0.5 * math.pi
    """Largest angle of a following beam from the boresight, rad; beyond it the gain is zero."""

    @model_validator(mode="after")
    def _points(self) -> "ArraySpec":
        require_direction(self.boresight, "boresight")
        for beam in self.beams:
            require_direction(beam, "beams")
        if len(set(self.elements)) < len(self.elements):
            same = next(place for place in self.elements if self.elements.count(place) > 1)
            raise ValueError(f"elements: two are at {list(same)}; each needs a position of its own")
        return self

    def gain(self, direction: Array, frequency: float) -> Array:
        """As of every antenna."""
        cosine = np.clip(dot(direction, unit(self.boresight)), -1.0, 1.0)
        element = 2.0 * (self.element_exponent + 1.0) * power(np.maximum(cosine, 0.0), self.element_exponent)
        element = np.where(cosine > 0.0, element, 0.0)
        count = len(self.elements)
        if not self.beams:
            return np.where(np.arccos(cosine) <= self.scan_limit, element * count, 0.0)
        wave_number = math.tau * frequency / SPEED_OF_LIGHT
        beams = [self._array_factor(direction, unit(beam), wave_number) for beam in self.beams]
        return np.asarray(element * np.max(beams, axis=0))

    def _array_factor(self, direction: Array, beam: Array, wave_number: float) -> Array:
        """Power of the array over that of one element with the same total input, shape (...)."""
        difference = direction - beam
        real, imaginary = np.zeros(direction.shape[:-1]), np.zeros(direction.shape[:-1])
        # In the order of the elements, so that the sum has the same bits for any number of links.
        for element in self.elements:
            phase = wave_number * dot(difference, np.asarray(element))
            real += np.cos(phase)
            imaginary += np.sin(phase)
        return np.asarray((real * real + imaginary * imaginary) / len(self.elements))


Antenna: TypeAlias = Annotated[IsotropicSpec | BeamSpec | ArraySpec, Field(discriminator="kind")]


def factor(decibels: float) -> float:
    """A ratio of powers from decibels."""
    return float(10.0 ** (0.1 * decibels))


def power(base: Array, exponent: float) -> Array:
    """A power of non-negative numbers by logarithm, with the same bits for any shape."""
    # Zero to the power zero is one here, and what is behind an array is dealt with by the caller.
    return np.asarray(np.exp(exponent * np.log(np.maximum(base, 1e-300))))
