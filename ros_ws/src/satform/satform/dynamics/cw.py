# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Clohessy-Wiltshire motion about a circular orbit: acceleration, coast, exact step with held input.

Frame: LVLH of the chief (x radial outward, y along-track, z orbit normal). Every map of the
Clohessy-Wiltshire solution from a vector to a vector couples x with y and leaves z alone, so it is
kept as a factor per axis and a factor for the exchanged in-plane component.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from satform.numeric.elementwise import Array, blank

_SERIES_LIMIT = 2.0
_SERIES_TERMS = 11


@dataclass(frozen=True)
class InPlaneCoupling:
    """A linear map of the form (own_x x + swapped_x y, own_y y + swapped_y x, own_z z).

    Attributes:
        own: factor of each component in its own row, shape (..., 3).
        swapped: factor of y in the row of x and of x in the row of y, shape (..., 2).
    """

    own: Array
    swapped: Array

    def __call__(self, vector: Array) -> Array:
        """The image of `vector`, shape (..., 3), in the unit that the factors make of it."""
        image: Array = self.own * vector
        in_plane = image[..., :2]
        in_plane += self.swapped * vector[..., 1::-1]
        return image

    def matrix(self) -> Array:
        """The same map as a matrix, shape (..., 3, 3)."""
        matrix = np.zeros((*self.own.shape, 3))
        for axis in range(3):
            matrix[..., axis, axis] = self.own[..., axis]
        matrix[..., 0, 1] = self.swapped[..., 0]
        matrix[..., 1, 0] = self.swapped[..., 1]
        return matrix


@dataclass(frozen=True)
class NaturalAcceleration:
    """The Clohessy-Wiltshire acceleration with its coefficients worked out once.

    Attributes:
        gradient: (3 n^2, 0, -n^2), 1/s^2, shape (..., 3).
        coriolis: (2 n, -2 n), 1/s, shape (..., 2), of the exchanged in-plane velocities.
    """

    gradient: Array
    coriolis: Array

    def at(self, position: Array, velocity: Array) -> Array:
        """Acceleration of a free satellite.

        Args:
            position: m, LVLH, shape (..., 3).
            velocity: m/s, in the rotating frame, shape (..., 3).

        Returns:
            m/s^2, in the rotating frame, shape (..., 3).
        """
        total: Array = self.gradient * position
        in_plane = total[..., :2]
        in_plane += self.coriolis * velocity[..., 1::-1]
        return total


def natural_acceleration(mean_motion: float | Array) -> NaturalAcceleration:
    """The free motion's acceleration as a function, for a given chief.

    Args:
        mean_motion: of the chief's circular orbit, rad/s, shape (...).

    Returns:
        Coefficients of shape (..., 3) and (..., 2).

    Source: Clohessy & Wiltshire 1960; Schaub & Junkins, ch. 14.
    """
    n = np.asarray(mean_motion, dtype=np.float64)
    gradient = np.stack((3.0 * n * n, np.zeros_like(n), -(n * n)), axis=-1)
    return NaturalAcceleration(gradient=gradient, coriolis=np.stack((2.0 * n, -2.0 * n), axis=-1))


def acceleration(position: Array, velocity: Array, mean_motion: float | Array) -> Array:
    """Acceleration of a free satellite near a circular orbit.

    Args:
        position: m, LVLH, shape (..., 3).
        velocity: m/s, in the rotating frame, shape (..., 3).
        mean_motion: of the chief, rad/s, shape (...).

    Returns:
        m/s^2, in the rotating frame, shape (..., 3).

    Source: Clohessy & Wiltshire 1960; Schaub & Junkins, ch. 14.
    """
    return natural_acceleration(mean_motion).at(position, velocity)


@dataclass(frozen=True)
class FreeMotion:
    """The exact free motion over a fixed duration.

    Attributes:
        position_from_position: dimensionless.
        position_from_velocity: s.
        velocity_from_position: 1/s.
        velocity_from_velocity: dimensionless.
    """

    position_from_position: InPlaneCoupling
    position_from_velocity: InPlaneCoupling
    velocity_from_position: InPlaneCoupling
    velocity_from_velocity: InPlaneCoupling

    @classmethod
    def over(cls, mean_motion: float | Array, duration: float | Array) -> "FreeMotion":
        """The motion over `duration` (s, shape (...)) about a chief of `mean_motion` (rad/s).

        No digits are lost where the chief turns by a tiny angle, nor at mean motion zero.

        Source: Clohessy & Wiltshire 1960; Schaub & Junkins, ch. 14.
        """
        n, t, sine, cosine, versine, lag = _orbit_terms(mean_motion, duration)
        zero, one = np.zeros_like(t), np.ones_like(t)
        sine_over_n = t * sinc(n * t)
        versine_over_n = 0.5 * n * t * t * sinc(0.5 * n * t) ** 2
        return cls(
            position_from_position=_coupling((1.0 + 3.0 * versine, one, cosine), (zero, -6.0 * lag)),
            position_from_velocity=_coupling(
                (sine_over_n, t * (1.0 - 4.0 * (n * t) ** 2 * sine_remainder(n * t)), sine_over_n),
                (2.0 * versine_over_n, -2.0 * versine_over_n),
            ),
            velocity_from_position=_coupling((3.0 * n * sine, zero, -n * sine), (zero, -6.0 * n * versine)),
            velocity_from_velocity=_coupling(
                (cosine, 1.0 - 4.0 * versine, cosine), (2.0 * sine, -2.0 * sine)
            ),
        )

    def advance(self, position: Array, velocity: Array) -> tuple[Array, Array]:
        """Position (m) and velocity (m/s) at the end, shape (..., 3), from those at the start."""
        return (
            self.position_from_position(position) + self.position_from_velocity(velocity),
            self.velocity_from_position(position) + self.velocity_from_velocity(velocity),
        )


@dataclass(frozen=True)
class HeldInputStep:
    """The exact motion over one control period with the commanded acceleration held.

    Attributes:
        coast: the free part.
        position_from_input: s^2.
        velocity_from_input: s.
    """

    coast: FreeMotion
    position_from_input: InPlaneCoupling
    velocity_from_input: InPlaneCoupling

    @classmethod
    def over(cls, mean_motion: float | Array, duration: float | Array) -> "HeldInputStep":
        """The step over `duration` (s, shape (...)) about a chief of `mean_motion` (rad/s)."""
        n, t, *_ = _orbit_terms(mean_motion, duration)
        sine_over_n = t * sinc(n * t)
        versine_over_n = 0.5 * n * t * t * sinc(0.5 * n * t) ** 2
        versine_over_n2 = 0.5 * t * t * sinc(0.5 * n * t) ** 2
        lag_over_n2 = n * t**3 * sine_remainder(n * t)
        return cls(
            coast=FreeMotion.over(mean_motion, duration),
            position_from_input=_coupling(
                (versine_over_n2, 4.0 * versine_over_n2 - 1.5 * t * t, versine_over_n2),
                (2.0 * lag_over_n2, -2.0 * lag_over_n2),
            ),
            velocity_from_input=_coupling(
                (sine_over_n, 4.0 * sine_over_n - 3.0 * t, sine_over_n),
                (2.0 * versine_over_n, -2.0 * versine_over_n),
            ),
        )

    def advance(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """State at the end of the step.

        Args:
            position: m, LVLH, at the start, shape (..., 3).
            velocity: m/s, in the rotating frame, at the start, shape (..., 3).
            acceleration: held over the step, m/s^2, shape (..., 3).

        Returns:
            Position (m) and velocity (m/s) at the end, each of shape (..., 3).
        """
        coasted_position, coasted_velocity = self.coast.advance(position, velocity)
        return (
            coasted_position + self.position_from_input(acceleration),
            coasted_velocity + self.velocity_from_input(acceleration),
        )


@dataclass(frozen=True)
class DisturbedStep:
    """A step with held input and a disturbance that varies smoothly within it.

    The convolution of the disturbance with the free motion is integrated by three-point
    Gauss-Legendre quadrature, so the error falls as the seventh power of the step.

    Attributes:
        held: the part due to state and held input.
        nodes: offsets from the start of the step at which the disturbance is wanted, s, shape (3,).
        position_from_disturbance: of each node, weight included, s^2, leading shape (3, 1).
        velocity_from_disturbance: of each node, weight included, s, leading shape (3, 1).
    """

    held: HeldInputStep
    nodes: Array
    position_from_disturbance: InPlaneCoupling
    velocity_from_disturbance: InPlaneCoupling

    @classmethod
    def over(cls, mean_motion: float, duration: float) -> "DisturbedStep":
        """The step over `duration` (s) about a chief of `mean_motion` (rad/s)."""
        abscissae, weights = np.polynomial.legendre.leggauss(3)
        nodes = 0.5 * duration * (1.0 + abscissae)
        response = FreeMotion.over(mean_motion, (duration - nodes)[:, None])
        weight = 0.5 * duration * weights[:, None, None]
        return cls(
            held=HeldInputStep.over(mean_motion, duration),
            nodes=nodes,
            position_from_disturbance=_scaled(response.position_from_velocity, weight),
            velocity_from_disturbance=_scaled(response.velocity_from_velocity, weight),
        )

    def advance(
        self, position: Array, velocity: Array, acceleration: Array, disturbance_at_nodes: Array
    ) -> tuple[Array, Array]:
        """State at the end of the step.

        Args:
            position: m, LVLH, at the start, shape (N, 3).
            velocity: m/s, in the rotating frame, at the start, shape (N, 3).
            acceleration: held over the step, m/s^2, shape (N, 3).
            disturbance_at_nodes: disturbing acceleration at each of `nodes`, m/s^2, shape (3, N, 3).

        Returns:
            Position (m) and velocity (m/s) at the end, each of shape (N, 3).
        """
        vectors = blank((6, *position.shape), position)
        vectors[0], vectors[1], vectors[2] = position, velocity, acceleration
        vectors[3:] = disturbance_at_nodes
        moved = self._of_all(vectors)
        undisturbed = moved[:, 0] + moved[:, 1] + moved[:, 2]
        end = undisturbed + (moved[:, 3] + moved[:, 4] + moved[:, 5])
        return end[0], end[1]

    def undisturbed(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """State at the end of a step without disturbance; arguments and result as in `advance`."""
        vectors = blank((3, *position.shape), position)
        vectors[0], vectors[1], vectors[2] = position, velocity, acceleration
        moved = self._of_state_and_input(vectors)
        end = moved[:, 0] + moved[:, 1] + moved[:, 2]
        return end[0], end[1]

    @cached_property
    def _of_state_and_input(self) -> InPlaneCoupling:
        """Factors of shape (2, 3, 1, 3): what position and velocity have from each of the first three."""
        held, coast = self.held, self.held.coast
        rows = (
            (coast.position_from_position, coast.position_from_velocity, held.position_from_input),
            (coast.velocity_from_position, coast.velocity_from_velocity, held.velocity_from_input),
        )
        return InPlaneCoupling(
            own=np.array([[part.own for part in row] for row in rows])[:, :, None],
            swapped=np.array([[part.swapped for part in row] for row in rows])[:, :, None],
        )

    @cached_property
    def _of_all(self) -> InPlaneCoupling:
        """The same with the disturbance at each node, shape (2, 6, 1, 3)."""
        first = self._of_state_and_input
        rows = (self.position_from_disturbance, self.velocity_from_disturbance)
        return InPlaneCoupling(
            own=np.concatenate((first.own, np.array([part.own for part in rows])), axis=1),
            swapped=np.concatenate((first.swapped, np.array([part.swapped for part in rows])), axis=1),
        )


def propagate(
    position: Array, velocity: Array, mean_motion: float | Array, duration: float | Array
) -> tuple[Array, Array]:
    """Free motion over a time span.

    Args:
        position: m, LVLH, at the start, shape (..., 3).
        velocity: m/s, in the rotating frame, at the start, shape (..., 3).
        mean_motion: of the chief, rad/s, shape (...).
        duration: s, may be negative, shape (...).

    Returns:
        Position (m) and velocity (m/s) at the end, each of shape (..., 3).

    Source: Clohessy & Wiltshire 1960; Schaub & Junkins, ch. 14.
    """
    return FreeMotion.over(mean_motion, duration).advance(position, velocity)


def transition_matrix(mean_motion: float, duration: float) -> Array:
    """State transition matrix of the state (position, velocity).

    Args:
        mean_motion: of the chief, rad/s.
        duration: s, may be negative.

    Returns:
        Shape (6, 6), in m, m/s, s.

    Source: Clohessy & Wiltshire 1960; Schaub & Junkins, ch. 14.
    """
    coast = FreeMotion.over(mean_motion, duration)
    return np.block(
        [
            [coast.position_from_position.matrix(), coast.position_from_velocity.matrix()],
            [coast.velocity_from_position.matrix(), coast.velocity_from_velocity.matrix()],
        ]
    )


def input_matrix(mean_motion: float, duration: float) -> Array:
    """Effect on the state (position, velocity) of an acceleration held over a time span, exact.

    Args:
        mean_motion: of the chief, rad/s.
        duration: s.

    Returns:
        Shape (6, 3): s^2 for the position rows, s for the velocity rows.
    """
    step = HeldInputStep.over(mean_motion, duration)
    return np.vstack((step.position_from_input.matrix(), step.velocity_from_input.matrix()))


def system_matrices(mean_motion: float) -> tuple[Array, Array]:
    """The continuous-time model d(state)/dt = A state + B acceleration.

    Args:
        mean_motion: of the chief, rad/s.

    Returns:
        A of shape (6, 6) and B of shape (6, 3), for the state (position, velocity).

    Source: Clohessy & Wiltshire 1960; Schaub & Junkins, ch. 14.
    """
    natural = natural_acceleration(mean_motion)
    coriolis = InPlaneCoupling(own=np.zeros(3), swapped=natural.coriolis).matrix()
    zero, identity = np.zeros((3, 3)), np.eye(3)
    return (
        np.block([[zero, identity], [np.diag(natural.gradient), coriolis]]),
        np.vstack((zero, identity)),
    )


def _coupling(own: tuple[Array, Array, Array], swapped: tuple[Array, Array]) -> InPlaneCoupling:
    return InPlaneCoupling(own=np.stack(own, axis=-1), swapped=np.stack(swapped, axis=-1))


def _scaled(coupling: InPlaneCoupling, factor: Array) -> InPlaneCoupling:
    return InPlaneCoupling(own=factor * coupling.own, swapped=factor * coupling.swapped)


def _orbit_terms(
    mean_motion: float | Array, duration: float | Array
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """n, t, sin nt, cos nt, 1 - cos nt and nt - sin nt, the last two without cancellation."""
    n = np.asarray(mean_motion, dtype=np.float64)
    n, t = np.broadcast_arrays(n, np.asarray(duration, dtype=np.float64))
    angle = n * t
    half_sine = np.sin(0.5 * angle)
    lag = angle**3 * sine_remainder(angle)
    return n, t, np.sin(angle), np.cos(angle), 2.0 * half_sine * half_sine, lag


def sinc(angle: Array) -> Array:
    """sin(angle) / angle, one at zero."""
    safe = np.where(angle == 0.0, 1.0, angle)
    quotient: Array = np.where(angle == 0.0, 1.0, np.sin(safe) / safe)
    return quotient


def sine_remainder(angle: Array) -> Array:
    """(angle - sin(angle)) / angle^3, by its Taylor series where the difference would cancel."""
    large = np.abs(angle) > _SERIES_LIMIT
    safe = np.where(large, angle, 1.0)
    square = np.where(large, 0.0, angle * angle)
    series = np.zeros_like(square)
    for order in range(_SERIES_TERMS, 0, -1):
        series = (1.0 - square * series) / ((2 * order) * (2 * order + 1))
    remainder: Array = np.where(large, (safe - np.sin(safe)) / safe**3, series)
    return remainder
