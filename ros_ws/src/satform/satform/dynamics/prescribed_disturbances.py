# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Disturbing accelerations of the relative motion, in LVLH, bounded on each axis."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

import numpy as np

from satform.common.angle_text import OR_DEGREES, OR_DEGREES_PER_SECOND
from satform.common.spec import NonNegative, NonNegativePerAxis, Number, PerAxis, Spec
from satform.numeric.elementwise import Array, Indices
from satform.numeric.recorded_arrays import Recorded
from satform.numeric.seeded_numbers import SeededSigned
from satform.numeric.stacking import component_major, take


@dataclass(frozen=True)
class PerturbationSetting:
    """What a perturbation may know when it is built.

    Attributes:
        mean_motion: of the chief's circular orbit, rad/s.
        step: plant's step, s.
        satellite_count: number of satellites N.
        seed: of the scenario's random numbers.
        index: in the scenario's list of perturbations, so that two noises differ.
    """

    mean_motion: float
    step: float
    satellite_count: int
    seed: int
    index: int


class Perturbation(Protocol):
    """A disturbing acceleration on each of N satellites as a function of time."""

    def acceleration(self, step: int, offset: float) -> Array:
        """Disturbance `offset` seconds into a step.

        Args:
            step: number of the step, counted from 0.
            offset: s, from 0 to the length of a step.

        Returns:
            m/s^2, LVLH, shape (N, 3).
        """

    def bound(self) -> Array:
        """Largest magnitude on each axis, m/s^2, shape (N, 3)."""

    def centre(self) -> Array:
        """Middle between lower and upper bound on each axis, m/s^2, shape (N, 3)."""


@dataclass(frozen=True)
class Constant:
    """The same acceleration on every satellite at all times.

    Attributes:
        value: m/s^2, LVLH, shape (N, 3).
    """

    value: Array

    def acceleration(self, step: int, offset: float) -> Array:
        """The constant, m/s^2, shape (N, 3)."""
        return self.value

    def bound(self) -> Array:
        """Its magnitude, m/s^2, shape (N, 3)."""
        return np.abs(self.value)

    def centre(self) -> Array:
        """The constant itself, m/s^2, shape (N, 3)."""
        return self.value


@dataclass(frozen=True)
class Harmonic:
    """A sinusoid on each axis, shifted from satellite to satellite.

    Attributes:
        amplitude: m/s^2, LVLH, shape (N, 3).
        angular_frequency: rad/s; of satellites of many runs shape (N, 1).
        phase: rad, shape (N, 3).
        step: plant's step, s.
    """

    amplitude: Array
    angular_frequency: float | Array
    phase: Array
    step: float

    def acceleration(self, step: int, offset: float) -> Array:
        """The sinusoid amplitude sin(angular_frequency t + phase), m/s^2, shape (N, 3)."""
        time = step * self.step + offset
        wave: Array = self.amplitude * np.sin(self.angular_frequency * time + self.phase)
        return wave

    def bound(self) -> Array:
        """The amplitude's magnitude, m/s^2, shape (N, 3)."""
        return np.abs(self.amplitude)

    def centre(self) -> Array:
        """Zero, m/s^2, shape (N, 3)."""
        return np.zeros_like(self.amplitude)


class BoundedNoise:
    """Uniform noise, held over each step, reproducible and independent from satellite to satellite.

    Any step may be asked for at any time, and a satellite's noise is the same however many others fly.
    """

    def __init__(self, largest: Array, numbers: SeededSigned) -> None:
        """Noise with a given bound.

        Args:
            largest: bound on each axis, m/s^2, shape (N, 3).
            numbers: of the same satellites, three a step.
        """
        self._largest = largest
        self._numbers = numbers
        self._held: tuple[int, Array] = (-1, largest)

    def acceleration(self, step: int, offset: float) -> Array:
        """The value held over the step, m/s^2, shape (N, 3)."""
        if isinstance(step, Recorded):
            return self._largest * self._numbers.at(step)
        if self._held[0] != step:
            self._held = (step, self._largest * self._numbers.at(step))
        return self._held[1]

    def bound(self) -> Array:
        """The noise's bound, m/s^2, shape (N, 3)."""
        return self._largest

    def centre(self) -> Array:
        """Zero, m/s^2, shape (N, 3)."""
        return np.zeros_like(self._largest)

    @classmethod
    def stacked(cls, noises: "Sequence[BoundedNoise]") -> "BoundedNoise":
        """The noise of the satellites of many runs, one after another."""
        own = [noise._numbers for noise in noises]
        numbers = SeededSigned(
            [seed for part in own for seed in part.seeds],
            own[0].stream,
            [satellite for part in own for satellite in part.satellites],
            own[0].width,
        )
        return cls(component_major(np.concatenate([noise._largest for noise in noises])), numbers)

    def keep(self, rows: Indices) -> "BoundedNoise":
        """The noise of some of the satellites, by their indices here."""
        return BoundedNoise(take(self._largest, rows), self._numbers.keep(rows))


class PerturbationSpec(Spec):
    """Base of every perturbation's specification; subclasses set a literal `kind`."""

    def build(self, setting: PerturbationSetting) -> Perturbation:
        """The perturbation of all satellites of the setting."""
        raise NotImplementedError


class ConstantSpec(PerturbationSpec):
    """The same constant acceleration on every satellite."""

    kind: Literal["constant"] = "constant"
    acceleration: PerAxis
    """Disturbing acceleration in LVLH, m/s^2."""

    def build(self, setting: PerturbationSetting) -> Constant:
        """The constant for all satellites."""
        return Constant(np.tile(np.array(self.acceleration), (setting.satellite_count, 1)))


class HarmonicSpec(PerturbationSpec):
    """A sinusoid on each axis."""

    kind: Literal["harmonic"] = "harmonic"
    amplitude: PerAxis
    """Amplitude in LVLH, m/s^2."""
    angular_frequency: Annotated[NonNegative, OR_DEGREES_PER_SECOND] | None = None
    """Angular frequency, rad/s; the chief's mean motion when omitted."""
    phase: Annotated[PerAxis, OR_DEGREES] = (0.0, 0.0, 0.0)
    """Phase at time zero of satellite 0, rad."""
    phase_step: Annotated[Number, OR_DEGREES] = 0.0
    """Phase added from each satellite to the next, rad."""

    def build(self, setting: PerturbationSetting) -> Harmonic:
        """The sinusoids of all satellites."""
        count = setting.satellite_count
        own = self.angular_frequency
        shift = self.phase_step * np.arange(count, dtype=np.float64)[:, None]
        return Harmonic(
            amplitude=np.tile(np.array(self.amplitude), (count, 1)),
            angular_frequency=setting.mean_motion if own is None else own,
            phase=np.array(self.phase) + shift,
            step=setting.step,
        )


class BoundedNoiseSpec(PerturbationSpec):
    """Uniform noise on each axis, held over each step of the plant."""

    kind: Literal["bounded_noise"] = "bounded_noise"
    bound: NonNegativePerAxis
    """Largest magnitude in LVLH, m/s^2."""

    def build(self, setting: PerturbationSetting) -> BoundedNoise:
        """The noise of all satellites."""
        largest = np.tile(np.array(self.bound), (setting.satellite_count, 1))
        numbers = SeededSigned(setting.seed, setting.index, range(setting.satellite_count), 3)
        return BoundedNoise(largest, numbers)
