# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Distance keeping to one neighbour by an artificial potential, with adaptation to unknown dynamics.

Each satellite of a directed cycle keeps a set distance to the one that it follows, from the relative
position and velocity of that neighbour and from its own velocity. A potential that is infinite at the
safe distance gives the wanted velocity. A fuzzy approximation and a disturbance bound, both adapted in
flight, compensate unknown dynamics and disturbances.

Equations: docs/controllers/adaptive_formation.md.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from pydantic import model_validator

from satform.common.spec import NonNegative, Positive, Vector
from satform.control.anti_windup import Saturation
from satform.control.protocol import (
    Action,
    ControllerSpec,
    ControlStep,
    FlightSetting,
    Gap,
    Motion,
    RelativeNeighbour,
)
from satform.control.sampled_stability import neighbour_loop
from satform.numeric.elementwise import Array, dot, norm
from satform.orbits.path_reference import Reference

_STEEPEST = 1e4
"""Largest slope of the wanted velocity over the position, in speed limits per safe distance."""

_SMALLEST = 1e-9
"""Least difference of the two distances, width, boundary and speed that a law can be built of, SI units."""


@dataclass(frozen=True)
class Guidance:
    """Wanted velocity and how it changes.

    Attributes:
        velocity: m/s, shape (..., 3).
        acceleration: its time derivative, m/s^2, shape (..., 3).
    """

    velocity: Array
    acceleration: Array


@dataclass(frozen=True)
class DistanceField:
    """Velocity field that leads to a set distance to the neighbour and away from the safe distance.

    Attributes:
        distance: to be kept, m, shape (...).
        safe_distance: lower bound of the distance, m, shape (...).
        slope: velocity per unit of the potential's gradient, 1/s, shape (...).
        speed_limit: bound on the velocity towards or away from the neighbour, m/s, shape (...).
        common_velocity: of the whole formation, LVLH, m/s, shape (..., 3).
        barrier: whether the potential is infinite at the safe distance, or finite everywhere.
    """

    distance: Array
    safe_distance: Array
    slope: Array
    speed_limit: Array
    common_velocity: Array
    barrier: bool

    def potential(self, relative_position: Array) -> Array:
        """Zero at the set distance; with the barrier, infinite at the safe distance.

        Args:
            relative_position: own minus the neighbour's, m, shape (..., 3).

        Returns:
            m^2, shape (...).

        Source: Zhu, Du & Wang for a potential of this kind; this form was chosen here.
        """
        margin, wanted = self._margins(relative_position)
        missing = margin - wanted
        squared = missing * missing
        value: Array = squared / margin if self.barrier else 0.5 * squared / wanted
        return value

    def guidance(self, neighbour: RelativeNeighbour) -> Guidance:
        """Velocity down the potential, bounded smoothly, with its analytic derivative.

        Args:
            neighbour: relative position and velocity.

        Returns:
            Wanted velocity and acceleration. Inside the safe distance, where the potential is not
            defined, the velocity leads outward at nearly the speed limit, and falls to zero within about
            1e-4 of the safe distance from the neighbour, where there is no direction outward.

        Source: Zhu, Du & Wang: backstepping on a collision-free potential.
        """
        apart, closing = neighbour.position, neighbour.velocity
        margin, wanted = self._margins(apart)
        if self.barrier:
            fraction = wanted / margin
            ratio = fraction * fraction
            stretch, bend = 1.0 - ratio, 4.0 * ratio / margin
            # Inside the safe distance the velocity is at its limit anyway; it is to turn round at the
            # neighbour's own position at a finite rate.
            steepest = -_STEEPEST * self.speed_limit / (2.0 * self.slope * self.safe_distance)
            bend = np.where(stretch < steepest, 0.0, bend)
            stretch = np.maximum(stretch, steepest)
        else:
            stretch, bend = margin / wanted - 1.0, 2.0 / wanted
        stretch = (2.0 * self.slope * stretch)[..., None]
        gradient = stretch * apart
        gradient_rate = stretch * closing + (2.0 * self.slope * bend * dot(apart, closing))[..., None] * apart
        limit = self.speed_limit * self.speed_limit
        growth = np.sqrt(1.0 + dot(gradient, gradient) / limit)
        shrink = (dot(gradient, gradient_rate) / (limit * growth * growth * growth))[..., None]
        velocity = self.common_velocity - gradient / growth[..., None]
        return Guidance(velocity, gradient * shrink - gradient_rate / growth[..., None])

    def _margins(self, relative_position: Array) -> tuple[Array, Array]:
        """Squared distances beyond the safe one: now (kept positive) and wanted, m^2."""
        safe = self.safe_distance * self.safe_distance
        wanted = self.distance * self.distance - safe
        now = dot(relative_position, relative_position) - safe
        return np.maximum(now, 1e-6 * wanted) if self.barrier else now, wanted


@dataclass(frozen=True)
class Adaptation:
    """Memory of the law: the adapted estimates.

    Attributes:
        weights: of the fuzzy approximation of the unknown acceleration, m/s^2, shape (..., 3, 7).
        disturbance: estimated bound on what the approximation leaves, m/s^2, shape (..., 3).
    """

    weights: Array
    disturbance: Array


@dataclass(frozen=True)
class ArtificialPotential:
    """Adaptive backstepping law on a distance field.

    Attributes:
        field: velocity field that is followed.
        surface_gain: decay rate of the velocity error, 1/s, shape (...).
        weight_rate: adaptation rate of the weights, 1/s, shape (...).
        disturbance_rate: adaptation rate of the disturbance bound, 1/s, shape (...).
        boundary: velocity error over which the disturbance's counteraction is smoothed, m/s, (...).
        centres: velocities at which the membership functions peak, m/s, shape (..., 7).
        width: offset from the peak at which the membership has fallen to 1/e, m/s, shape (...).
        step: control period, s, shape (...).
        leakage: decay rate of the estimates, 1/s, or 1/m if it is multiplied by the magnitude of the
            velocity error, shape (...); 0 for none.
        leaks_with_error: whether the leakage is multiplied by the magnitude of the velocity error.
        saturation: detects that the thrusters did not apply the last command.
    """

    field: DistanceField
    surface_gain: Array
    weight_rate: Array
    disturbance_rate: Array
    boundary: Array
    centres: Array
    width: Array
    step: Array
    leakage: Array
    leaks_with_error: bool
    saturation: Saturation

    def start(self, motion: Motion) -> Adaptation:
        """Estimates of zero."""
        shape = motion.velocity.shape
        return Adaptation(np.zeros((*shape, self.centres.shape[-1])), np.zeros(shape))

    def resume(self, memory: Adaptation, gap: Gap) -> Adaptation:
        """The estimates are kept: they describe the satellite's dynamics. They are not adapted in the gap."""
        return memory

    def act(
        self, motion: Motion, neighbour: RelativeNeighbour, memory: Adaptation, step: ControlStep
    ) -> Action:
        """Command of one step, and the adapted estimates.

        The estimates are not adapted on an axis on which saturated thrusters did not apply the last command:
        the velocity error there comes from the saturation, not from unknown dynamics.

        Args:
            motion: own velocity, LVLH; the position is not used.
            neighbour: relative position and velocity of the neighbour.
            memory: the estimates.
            step: with the acceleration that was applied instead of the last command.

        Returns:
            Commanded acceleration, the velocity error as sliding variable, the next memory.

        Source: Ioannou & Sun, Robust Adaptive Control, ch. 8.4-8.5: adaptation that is switched off where
        its error says nothing of the parameters.
        """
        acceleration, surface, rate = self.evaluate(motion.velocity, neighbour, memory)
        duration = self.step[..., None]
        follows = self.saturation.shortfall(motion, step) == 0.0
        weights = memory.weights + np.where(follows, duration, 0.0)[..., None] * rate.weights
        disturbance = memory.disturbance + np.where(follows, duration, 0.0) * rate.disturbance
        return Action(acceleration, surface, Adaptation(weights, disturbance))

    def reference(self, motion: Motion, neighbour: RelativeNeighbour) -> Reference:
        """The nearest position at the set distance, and the common velocity of the formation.

        Args:
            motion: own position and velocity, LVLH.
            neighbour: relative position and velocity of the neighbour.

        Returns:
            Position and velocity; the acceleration is zero.
        """
        apart = neighbour.position
        stretch = (self.field.distance / np.maximum(norm(apart), 1e-12) - 1.0)[..., None]
        velocity = self.field.common_velocity + 0.0 * apart
        return Reference(motion.position + stretch * apart, velocity, np.zeros_like(apart))

    def evaluate(
        self, velocity: Array, neighbour: RelativeNeighbour, learnt: Adaptation
    ) -> tuple[Array, Array, Adaptation]:
        """The law in continuous time.

        Args:
            velocity: own, LVLH, m/s, shape (..., 3).
            neighbour: relative position and velocity of the neighbour.
            learnt: the estimates.

        Returns:
            Commanded acceleration (m/s^2, shape (..., 3)), velocity error to the field (m/s, shape
            (..., 3)) and time derivative of the estimates.

        Source: Zhu, Du & Wang: adaptive fuzzy backstepping; the adaptation laws were reconstructed here.
        Leakage: Ioannou & Kokotovic 1984 (sigma-modification: at a constant rate), Narendra & Annaswamy 1987
        (e-modification: at a rate proportional to the error, so that estimates do not decay without error).
        """
        guidance = self.field.guidance(neighbour)
        surface = velocity - guidance.velocity
        basis = fuzzy_basis(velocity, self.centres, self.width)
        sign = np.tanh(surface / self.boundary[..., None])
        acceleration: Array = (
            guidance.acceleration
            - self.surface_gain[..., None] * surface
            - _weighted(learnt.weights, basis)
            - learnt.disturbance * sign
        )
        weight_rate = (self.weight_rate[..., None] * surface)[..., None] * basis
        disturbance_rate = self.disturbance_rate[..., None] * surface * sign
        leakage = self.leakage[..., None]
        leak = leakage * np.abs(surface) if self.leaks_with_error else leakage + np.zeros_like(surface)
        rate = Adaptation(
            weight_rate - leak[..., None] * learnt.weights,
            disturbance_rate - leak * learnt.disturbance,
        )
        return acceleration, surface, rate


def fuzzy_basis(value: Array, centres: Array, width: Array) -> Array:
    """Normalised Gaussian membership of each component in each fuzzy set.

    Args:
        value: shape (..., 3).
        centres: of the sets, in the unit of `value`, shape (..., m).
        width: offset at which the membership has fallen to 1/e, same unit, shape (...).

    Returns:
        Shape (..., 3, m), each row of sum one.

    Source: Wang & Mendel 1992: fuzzy basis functions.
    """
    offset = (value[..., None] - centres[..., None, :]) / width[..., None, None]
    squared = offset * offset
    membership = np.exp(np.min(squared, axis=-1, keepdims=True) - squared)
    total = membership[..., 0]
    for index in range(1, membership.shape[-1]):
        total = total + membership[..., index]
    basis: Array = membership / total[..., None]
    return basis


def _weighted(weights: Array, basis: Array) -> Array:
    product = weights * basis
    total: Array = product[..., 0]
    for index in range(1, product.shape[-1]):
        total = total + product[..., index]
    return total


Centres = tuple[float, float, float, float, float, float, float]


class ArtificialPotentialSpec(ControllerSpec):
    """Adaptive collision-free distance keeping to the satellite's one in-neighbour."""

    follows: ClassVar[Literal["reference", "neighbour"]] = "neighbour"

    kind: Literal["artificial_potential"] = "artificial_potential"
    distance: Positive = 100.0
    """Distance to the neighbour that is kept, m."""
    safe_distance: Positive = 10.0
    """Distance at which the potential is infinite, m."""
    slope: Positive = 0.01
    """Velocity per unit of the potential's gradient, 1/s."""
    speed_limit: Positive = 3.0
    """Bound on the velocity towards or away from the neighbour, m/s."""
    common_velocity: Vector = (0.0, 0.0, 0.0)
    """Velocity of the whole formation, LVLH, m/s."""
    barrier: bool = True
    """Whether the potential is infinite at the safe distance. Without it satellites may collide."""
    surface_gain: Positive = 1.0
    """Decay rate of the velocity error, 1/s."""
    weight_rate: NonNegative = 2.0
    """Adaptation rate of the fuzzy weights, 1/s; zero for none."""
    disturbance_rate: NonNegative = 0.5
    """Adaptation rate of the disturbance bound, 1/s; zero for none."""
    boundary: Positive = 0.05
    """Velocity error over which the sign in the disturbance term is smoothed, m/s. Held commands are stable
    while the step is well below this divided by the estimated disturbance bound."""
    centres: Centres = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
    """Velocities at which the fuzzy sets peak, m/s."""
    leakage: Literal["none", "sigma_modification", "e_modification"] = "none"
    """Leakage of the estimates, which keeps them bounded under noise and persistent disturbances: none, as in
    the source; at `leakage_rate` (sigma-modification); or at `leakage_rate` times the magnitude of the
    velocity error (e-modification)."""
    leakage_rate: NonNegative = 0.01
    """Rate of the leakage, 1/s for sigma_modification, 1/m for e_modification."""
    width: Positive = 1.0
    """Offset from a fuzzy set's peak at which its membership has fallen to 1/e, m/s."""

    @model_validator(mode="after")
    def _distances_in_order(self) -> "ArtificialPotentialSpec":
        if not self.safe_distance < self.distance:
            raise ValueError(
                f"safe_distance ({self.safe_distance:g} m) has to be below distance ({self.distance:g} m)"
            )
        parts = {
            "safe_distance": self.safe_distance,
            "distance less safe_distance": self.distance - self.safe_distance,
            "speed_limit": self.speed_limit,
            "boundary": self.boundary,
            "width": self.width,
        }
        for name, value in parts.items():
            if value < _SMALLEST:
                raise ValueError(f"{name} is {value:g}; it has to be at least {_SMALLEST:g}")
        return self

    def linearisation(self, setting: FlightSetting) -> Array:
        """The loop of a satellite at the set distance from a neighbour that moves with the formation."""
        return neighbour_loop(self.build(setting), self.distance, np.array(self.common_velocity), setting)

    def build(self, setting: FlightSetting) -> ArtificialPotential:
        """The law, ready to fly.

        Raises:
            ValueError: the step is too long for the velocity error's decay.
        """
        if self.surface_gain * setting.step >= 1.0:
            raise ValueError(
                f"adaptive_distance: surface_gain {self.surface_gain:g} 1/s needs a step below "
                f"{1.0 / self.surface_gain:g} s, got {setting.step:g} s"
            )
        field = DistanceField(
            distance=np.asarray(self.distance),
            safe_distance=np.asarray(self.safe_distance),
            slope=np.asarray(self.slope),
            speed_limit=np.asarray(self.speed_limit),
            common_velocity=np.array(self.common_velocity),
            barrier=self.barrier,
        )
        return ArtificialPotential(
            field=field,
            surface_gain=np.asarray(self.surface_gain),
            weight_rate=np.asarray(self.weight_rate),
            disturbance_rate=np.asarray(self.disturbance_rate),
            boundary=np.asarray(self.boundary),
            centres=np.array(self.centres),
            width=np.asarray(self.width),
            step=np.asarray(setting.step, dtype=np.float64),
            leakage=np.asarray(0.0 if self.leakage == "none" else self.leakage_rate),
            leaks_with_error=self.leakage == "e_modification",
            saturation=Saturation.of(setting),
        )
