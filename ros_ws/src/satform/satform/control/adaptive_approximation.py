# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Functions whose weighted sum approximates an unknown acceleration of velocity and time, for adaptation.

Equations: docs/controllers/adaptive_tracking.md.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

import numpy as np
from pydantic import Field, model_validator

from satform.common.angle_text import OR_DEGREES_PER_SECOND
from satform.common.spec import NonNegative, Positive, Spec
from satform.control.artificial_potential import Centres, fuzzy_basis
from satform.numeric.elementwise import Array, numbers

LEAST_PHASES = 3
"""Patches of a revolution below which two neighbours would overlap on both sides."""


class Approximator(Protocol):
    """Functions of the velocity along an axis, the phase of a periodic force, and the filtered error."""

    @property
    def rates(self) -> Array:
        """Adaptation rate of each weight, 1/s^2, shape (..., m)."""

    @property
    def functions(self) -> Array:
        """Numbers that tell these functions from all others, shape (..., k); k may differ between them."""

    def values(self, velocity: Array, phase: Array, filtered_error: Array) -> Array:
        """What the weights are multiplied by.

        Args:
            velocity: LVLH, m/s, shape (..., 3).
            phase: of the periodic force, rad, shape (...).
            filtered_error: of the law, m/s, shape (..., 3).

        Returns:
            Shape (..., 3, m): m functions on each axis.
        """

    def largest_square(self) -> float:
        """Upper bound on the sum of the functions' squares."""

    def largest_rate(self) -> float:
        """Upper bound on the sum over the functions of rate times squared value, 1/s^2."""


@dataclass(frozen=True)
class PartitionOfUnity:
    """Overlapping patches with weights that sum to one, and a constant or affine model on each.

    The acceleration is the sum of one of the velocity along the axis and one of the phase.

    Attributes:
        centres: of the patches of the velocity, evenly spaced, m/s, shape (..., M).
        phase_patches: of a revolution, evenly spaced; 0 for none.
        affine: whether the model of a patch has a slope.
        rate: of adaptation, 1/s^2, shape (...).
    """

    centres: Array
    phase_patches: int
    affine: bool
    rate: Array

    @property
    def count(self) -> int:
        """Weights of an axis."""
        return (int(self.centres.shape[-1]) + self.phase_patches) * (2 if self.affine else 1)

    @property
    def rates(self) -> Array:
        """Adaptation rate of each weight, 1/s^2, shape (..., m)."""
        return self.rate[..., None] + np.zeros(self.count)

    @property
    def functions(self) -> Array:
        """Centres, number of phase patches and order of the models; as in `Approximator.functions`."""
        kind = np.array([0.0, self.phase_patches, float(self.affine)])
        return np.concatenate((self.centres, np.broadcast_to(kind, (*self.rate.shape, 3))), axis=-1)

    def values(self, velocity: Array, phase: Array, filtered_error: Array) -> Array:
        """What the weights are multiplied by; as in `Approximator.values`.

        Source: Melenk & Babuska 1996, for a partition of unity that joins local models.
        """
        spacing = self.centres[..., 1] - self.centres[..., 0]
        low, high = self.centres[..., :1], self.centres[..., -1:]
        within = np.minimum(np.maximum(velocity, low), high)
        offset = (within[..., None] - self.centres[..., None, :]) / spacing[..., None, None]
        parts = self._models(offset)
        if self.phase_patches:
            width = math.tau / self.phase_patches
            turned = numbers(phase)[..., None] - width * np.arange(self.phase_patches)
            away = (np.remainder(turned + math.pi, math.tau) - math.pi) / width
            parts += [
                np.broadcast_to(part[..., None, :], (*velocity.shape, self.phase_patches))
                for part in self._models(away)
            ]
        return np.concatenate(parts, axis=-1)

    def largest_square(self) -> float:
        """Upper bound on the sum of the functions' squares: each partition adds at most one."""
        return 2.0 if self.phase_patches else 1.0

    def largest_rate(self) -> float:
        """Upper bound on the sum of rate times squared value, 1/s^2."""
        return float(self.rate) * self.largest_square()

    def _models(self, offset: Array) -> list[Array]:
        weight = patch_weight(offset)
        return [weight, weight * offset] if self.affine else [weight]


def patch_weight(offset: Array) -> Array:
    """Smooth weight of a patch; with patches one apart the weights sum to one.

    Args:
        offset: from its centre, in spacings, any shape.

    Returns:
        Same shape: 1 at the centre, 0 from one spacing on.
    """
    cosine = np.cos(0.5 * math.pi * np.minimum(np.abs(offset), 1.0))
    weight: Array = cosine * cosine
    return weight


@dataclass(frozen=True)
class FuzzySets:
    """The functions of `artificial_potential`: Gaussian fuzzy sets and a bound on the disturbance.

    With sets of the phase, the functions are the products of both: a grid.

    Attributes:
        centres: of the sets of the velocity, m/s, shape (..., 7).
        width: offset from a centre at which the membership has fallen to 1/e, m/s, shape (...).
        phase_sets: of a revolution, evenly spaced, as wide as their spacing; 0 for none.
        boundary: filtered error over which the sign of the bound is smoothed, m/s, shape (...).
        rate: of adaptation of the weights, 1/s^2, shape (...).
        disturbance_rate: of adaptation of the bound, 1/s^2, shape (...).
    """

    centres: Array
    width: Array
    phase_sets: int
    boundary: Array
    rate: Array
    disturbance_rate: Array

    @property
    def rates(self) -> Array:
        """Adaptation rate of each weight, 1/s^2, shape (..., m)."""
        sets = self.centres.shape[-1] * max(1, self.phase_sets)
        weights = self.rate[..., None] + np.zeros(sets)
        return np.concatenate((weights, self.disturbance_rate[..., None]), axis=-1)

    @property
    def functions(self) -> Array:
        """Centres, number of phase sets and both widths; as in `Approximator.functions`."""
        kind = np.broadcast_to(np.array([1.0, self.phase_sets]), (*self.rate.shape, 2))
        widths = (self.width[..., None], self.boundary[..., None])
        return np.concatenate((self.centres, kind, *widths), axis=-1)

    def values(self, velocity: Array, phase: Array, filtered_error: Array) -> Array:
        """What the weights are multiplied by; as in `Approximator.values`.

        Source: Wang & Mendel 1992: fuzzy basis functions.
        """
        basis = fuzzy_basis(velocity, self.centres, self.width)
        if self.phase_sets:
            width = math.tau / self.phase_sets
            turned = numbers(phase)[..., None] - width * np.arange(self.phase_sets)
            away = (np.remainder(turned + math.pi, math.tau) - math.pi) / width
            membership = np.exp(-(away * away))
            total = membership[..., 0]
            for index in range(1, self.phase_sets):
                total = total + membership[..., index]
            share = membership / total[..., None]
            grid = basis[..., None] * share[..., None, None, :]
            basis = grid.reshape(*velocity.shape, -1)
        sign = np.tanh(filtered_error / self.boundary[..., None])
        return np.concatenate((basis, sign[..., None]), axis=-1)

    def largest_square(self) -> float:
        """Upper bound on the sum of the functions' squares: one of the sets and one of the bound."""
        return 2.0

    def largest_rate(self) -> float:
        """Upper bound on the sum of rate times squared value, 1/s^2."""
        return float(self.rate) + float(self.disturbance_rate)


class PartitionOfUnitySpec(Spec):
    """A few overlapping patches of the velocity and of the phase, with a constant or affine model on each."""

    kind: Literal["partition_of_unity"] = "partition_of_unity"
    velocity_patches: Annotated[int, Field(ge=2, le=32)] = 3
    """Patches of the velocity along each axis, evenly from `-velocity_limit` to `velocity_limit`."""
    velocity_limit: Positive = 3.0
    """Velocity up to which the force is approximated, m/s; beyond it the approximation is constant."""
    phase_patches: Annotated[int, Field(ge=0, le=64)] = 3
    """Patches of the period of the force; 0 for a force that does not depend on time, else at least 3."""
    local_model: Literal["constant", "affine"] = "affine"
    """Model of the force on each patch."""

    @model_validator(mode="after")
    def _enough_phases(self) -> "PartitionOfUnitySpec":
        if 0 < self.phase_patches < LEAST_PHASES:
            raise ValueError(
                f"phase_patches is {self.phase_patches}; it has to be 0 or at least {LEAST_PHASES}"
            )
        return self

    def build(self, rate: float) -> PartitionOfUnity:
        """The functions, for weights that adapt at a rate in 1/s^2."""
        return PartitionOfUnity(
            centres=np.linspace(-self.velocity_limit, self.velocity_limit, self.velocity_patches),
            phase_patches=self.phase_patches,
            affine=self.local_model == "affine",
            rate=np.asarray(rate, dtype=np.float64),
        )


class FuzzySetsSpec(Spec):
    """The approximator of `artificial_potential`, for comparison: fuzzy sets and a disturbance bound."""

    kind: Literal["fuzzy_sets"] = "fuzzy_sets"
    centres: Centres = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
    """Velocities at which the fuzzy sets peak, m/s."""
    width: Annotated[Positive, Field(ge=1e-9)] = 1.0
    """Offset from a fuzzy set's peak at which its membership has fallen to 1/e, m/s."""
    phase_sets: Annotated[int, Field(ge=0, le=64)] = 0
    """Fuzzy sets of the period of the force, in a grid with those of the velocity; 0 for none."""
    disturbance_rate: NonNegative = 0.5
    """Adaptation rate of the disturbance bound, 1/s^2; zero for none."""
    boundary: Annotated[Positive, Field(ge=1e-9)] = 0.05
    """Filtered error over which the sign in the disturbance term is smoothed, m/s."""

    def build(self, rate: float) -> FuzzySets:
        """The functions, for weights that adapt at a rate in 1/s^2."""
        return FuzzySets(
            centres=np.array(self.centres),
            width=np.asarray(self.width),
            phase_sets=self.phase_sets,
            boundary=np.asarray(self.boundary),
            rate=np.asarray(rate, dtype=np.float64),
            disturbance_rate=np.asarray(self.disturbance_rate),
        )


ApproximationSpec = Annotated[PartitionOfUnitySpec | FuzzySetsSpec, Field(discriminator="kind")]

Frequency = Annotated[Positive, OR_DEGREES_PER_SECOND]
