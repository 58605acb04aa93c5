# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Multiplicative extended Kalman filter of a satellite's attitude (`kind: multiplicative_extended`).

The gyro stands for a model of the rotation: its readings move the attitude on, and star trackers correct it.
The state is a small rotation from the estimated to the true body axes and the error of the gyro's estimated
bias. After each correction the rotation is put into the attitude and is zero again. A reading that arrives
late is worked in at the step at which it was taken, and all that came since is worked in again after it.
While no reading of the gyro is there, in an outage or because it is on its way, a filter with an
`acceleration_density` holds the estimated angular velocity but for the acceleration of the rigid body; the
error of this rate is then part of the state.

Equations: docs/attitude_estimation.md.
"""

from dataclasses import dataclass, replace

import numpy as np

from satform.attitude.held_rate import held_process, held_transition
from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array, dot
from satform.numeric.matrix_algebra import product, symmetric, transposed
from satform.numeric.modified_rodrigues import (
    composed_mrp,
    cross_matrix,
    mrp_of_rotation,
    relative_mrp,
    sine_quotient,
)
from satform.numeric.stacking import select

_UNIT = np.eye(3)

UNKNOWN_ATTITUDE = 1.0
"""Variance of each axis of an attitude of which nothing is known any more, rad^2."""

UNKNOWN_RATE = 0.01
"""Variance of each axis of an angular velocity of which nothing is known, rad^2/s^2."""

_SERIES = 0.05
"""Angle below which the third coefficient of a rotation is taken from its series, rad."""


@dataclass(frozen=True)
class AttitudeEstimate:
    """An attitude and a gyro bias with their covariance.

    Attributes:
        mrp: inertial to estimated body axes, of length at most one, shape (..., 3).
        bias: of the gyro, rad/s, body axes, shape (..., 3).
        rate: angular velocity that is held while the gyro gives none, rad/s, body axes, shape (..., 3); that
            of the start in a filter that holds none.
        covariance: of (rotation from estimated to true body axes, error of the bias), rad and rad/s, shape
            (..., 6, 6); with the error of the held rate after them in a filter that holds one, (..., 9, 9).
        innovation: normalised innovation squared of the newest reading of a star tracker, shape (...); 0 at
            first.
        rejected: readings so far that the gate rejected, shape (...).
        in_a_row: of these, the last ones without one between them that was worked in, shape (...).
    """

    mrp: Array
    bias: Array
    rate: Array
    covariance: Array
    innovation: Array
    rejected: Array
    in_a_row: Array

    @property
    def holds_rate(self) -> bool:
        """Whether the angular velocity is a part of the state."""
        return bool(self.covariance.shape[-1] == 9)


@dataclass(frozen=True)
class AttitudeMemory:
    """What the filter remembers between steps.

    Attributes:
        anchor: estimate at the oldest step of which readings may still arrive, without any of that step.
        oldest: the same with what has arrived of that step.
        rates: measured by the gyro over each of the steps since, rad/s, oldest first, shape (..., 3) each; in
            a filter that holds a rate not a number where no reading has arrived.
        accelerations: angular, that of the rigid body over each of the steps since, rad/s^2, shape (..., 3)
            each; none in a filter that holds no rate.
        readings: of the T star trackers, taken at the oldest step and at each one since; not a number where
            none has arrived, shape (..., T, 3) each.
        now: estimate at the present step.
        rate: newest reading of the gyro, rad/s, shape (..., 3).
        rate_age: time from the moment of the angular velocity to now, s, shape (...): from the middle of the
            gyro's integration; zero in a filter that holds a rate.
    """

    anchor: AttitudeEstimate
    oldest: AttitudeEstimate
    rates: tuple[Array, ...]
    accelerations: tuple[Array, ...]
    readings: tuple[Array, ...]
    now: AttitudeEstimate
    rate: Array
    rate_age: Array

    @property
    def angular_velocity(self) -> Array:
        """Estimated mean over the gyro's last integration, or that of now, rad/s, shape (..., 3)."""
        return self.now.rate if self.now.holds_rate else self.rate - self.now.bias


@dataclass(frozen=True)
class AttitudeFilter:
    """Multiplicative extended Kalman filter on a gyro and star trackers.

    Attributes:
        step: control period, s.
        gyro_column: of its first number among the satellite's readings.
        gyro_period: steps between two readings of the gyro.
        gyro_latency: steps from a reading of the gyro to its arrival.
        tracker_columns: likewise of each star tracker.
        tracker_latencies: steps from a reading to its arrival, of each star tracker.
        axes: of each star tracker, two across its boresight and the boresight, unit vectors in body axes,
            shape (..., T, 3, 3).
        variance: of a reading about each of these axes, rad^2, shape (..., T, 3).
        angle_density: power spectral density of the gyro's white noise, rad^2/s, shape (...).
        bias_density: that of the rate of its bias, rad^2/s^3, shape (...).
        acceleration_density: that of the angular acceleration beyond the rigid body's, for steps without a
            reading of the gyro, rad^2/s^3, shape (...); None for a filter that takes the newest reading until
            the next one has arrived.
        start: estimate before the first reading.
        gate: largest normalised innovation squared of a reading that is worked in, shape (...); infinite for
            no gate.
        max_consecutive_rejections: readings rejected in a row at the last of which the attitude is taken from
            that one, shape (...).

    Source: Lefferts, Markley & Shuster 1982, Kalman filtering for spacecraft attitude estimation; Markley &
    Crassidis 2014, Fundamentals of Spacecraft Attitude Determination and Control, ch. 6.2.
    """

    step: float
    gyro_column: int
    gyro_period: int
    gyro_latency: int
    tracker_columns: tuple[int, ...]
    tracker_latencies: tuple[int, ...]
    axes: Array
    variance: Array
    angle_density: Array
    bias_density: Array
    acceleration_density: Array | None
    start: AttitudeEstimate
    gate: Array
    max_consecutive_rejections: Array

    @property
    def holds_rate(self) -> bool:
        """Whether the angular velocity is a part of the state."""
        return self.acceleration_density is not None

    @property
    def depth(self) -> int:
        """Steps for which what was taken in may still change."""
        return max(self.gyro_latency + self.gyro_period - 1, *self.tracker_latencies)

    def first(self, values: Array, *, begins_again: bool = False) -> AttitudeMemory:
        """The memory at the first step.

        Args:
            values: all readings of the satellite that arrive at it, shape (..., W).
            begins_again: whether the step is a later one of the flight, of a satellite that remembers
                nothing: the attitude that it knows is that at step 0, so nothing is known of its error.
        """
        rate, start = self._gyro(values), self.start
        if begins_again:
            covariance = start.covariance.copy()
            covariance[..., :3, :3] = UNKNOWN_ATTITUDE * _UNIT
            start = replace(start, covariance=covariance)
        rate = np.where(np.isnan(rate), start.bias, rate)
        if self.holds_rate:
            start = replace(start, rate=rate - start.bias)
        readings = self._placed((), values)
        now = self._worked_in(start, readings[0])
        return AttitudeMemory(start, now, (), (), readings, now, rate, np.zeros(rate.shape[:-1]))

    def blank(self) -> AttitudeMemory:
        """A memory that has the form of every other one, with one rate and one set of readings."""
        columns = max(self.gyro_column, *self.tracker_columns) + 3
        shape = self.start.bias.shape
        memory = self.first(np.zeros((*shape[:-1], columns)))
        none = (np.zeros(shape),)
        return replace(memory, rates=none, accelerations=none if self.holds_rate else ())

    def observe(
        self, memory: AttitudeMemory, values: Array, acceleration: Array | float = 0.0
    ) -> AttitudeMemory:
        """The memory one step later.

        Args:
            memory: of the step before.
            values: all readings of the satellite that arrive at the step, not a number where there is none,
                shape (..., W).
            acceleration: angular, of the rigid body over the step between, rad/s^2, shape (..., 3); only a
                filter that holds a rate uses it.
        """
        accelerations = memory.accelerations
        if self.holds_rate:
            accelerations = (*accelerations, acceleration + np.zeros_like(memory.rate))
        rates, rate, age = self._rates(memory, values)
        readings, anchor = self._placed(memory.readings, values), memory.anchor
        if len(rates) > self.depth:
            anchor = self.predicted(memory.oldest, rates[0], *accelerations[:1])
            rates, accelerations, readings = rates[1:], accelerations[1:], readings[1:]
        now = oldest = self._worked_in(anchor, readings[0])
        for number, turned in enumerate(rates):
            predicted = self.predicted(now, turned, *accelerations[number : number + 1])
            now = self._worked_in(predicted, readings[number + 1])
        return AttitudeMemory(anchor, oldest, rates, accelerations, readings, now, rate, age)

    def resume(self, memory: AttitudeMemory, missed: int) -> AttitudeMemory:
        """The memory after steps without the flight software, up to the step before the next one.

        The attitude goes on at its last rate, and nothing is known of its error any more; the bias is still
        known but for its walk.

        Args:
            memory: of the last step before the gap.
            missed: steps in the gap, at least 1.
        """
        now, time = memory.now, missed * self.step
        turned = mrp_of_rotation(time * memory.angular_velocity)
        covariance = np.zeros_like(now.covariance)
        covariance[..., :3, :3] = UNKNOWN_ATTITUDE * _UNIT
        covariance[..., 3:6, 3:6] = (
            now.covariance[..., 3:6, 3:6] + (time * self.bias_density)[..., None, None] * _UNIT
        )
        if now.holds_rate:
            covariance[..., 6:, 6:] = UNKNOWN_RATE * _UNIT
        lost = replace(now, mrp=composed_mrp(turned, now.mrp), covariance=covariance)
        none = (np.full_like(memory.readings[0], np.nan),)
        age = memory.rate_age if self.holds_rate else memory.rate_age + time
        return AttitudeMemory(lost, lost, (), (), none, lost, memory.rate, age)

    def _gyro(self, values: Array) -> Array:
        return values[..., self.gyro_column : self.gyro_column + 3]

    def _rates(self, memory: AttitudeMemory, values: Array) -> tuple[tuple[Array, ...], Array, Array]:
        """Rates over all steps since the oldest one, the newest reading of the gyro and its age.

        A reading is the mean over the gyro's period, so it replaces what was held in its steps, which end its
        latency ago.
        """
        gyro, period, latency = self._gyro(values), self.gyro_period, self.gyro_latency
        rate, age, arrived = memory.rate, memory.rate_age + self.step, ~np.isnan(gyro[..., 0])
        rates = [*memory.rates, np.full_like(rate, np.nan) if self.holds_rate else rate]
        if np.any(arrived):
            rate = np.where(arrived[..., None], gyro, rate)
            age = np.where(arrived, 0.5 * period * self.step, age)
            end = len(rates) - latency
            for number in range(max(0, end - period), end):
                rates[number] = np.where(arrived[..., None], gyro, rates[number])
        return tuple(rates), rate, np.zeros_like(age) if self.holds_rate else age

    def _placed(self, earlier: tuple[Array, ...], values: Array) -> tuple[Array, ...]:
        """Readings of the star trackers by the steps at which they were taken."""
        count = len(self.tracker_columns)
        places = [*earlier, np.full((*values.shape[:-1], count, 3), np.nan)]
        for number, (column, latency) in enumerate(
            zip(self.tracker_columns, self.tracker_latencies, strict=True)
        ):
            arrived = values[..., column : column + 3]
            if latency < len(places) and not np.all(np.isnan(arrived)):
                taken = places[-1 - latency].copy()
                taken[..., number, :] = arrived
                places[-1 - latency] = taken
        return tuple(places)

    def predicted(
        self, estimate: AttitudeEstimate, rate: Array, acceleration: Array | float = 0.0
    ) -> AttitudeEstimate:
        """The estimate one step later.

        Args:
            estimate: at the start of the step.
            rate: measured by the gyro, mean over the step, rad/s, shape (..., 3); in a filter that holds a
                rate not a number where there is no reading.
            acceleration: as in `observe`.
        """
        turning, process = rate - estimate.bias, self.process()
        if self.acceleration_density is not None:
            measured = ~np.isnan(rate[..., 0])
            given, step = measured[..., None], self.step
            held = estimate.rate + 0.5 * step * acceleration
            later = np.where(
                given,
                turning + 0.5 * self.gyro_period * step * acceleration,
                estimate.rate + step * acceleration,
            )
            turning, estimate = np.where(given, turning, held), replace(estimate, rate=later)
        rotation = self.step * turning
        transition = error_transition(rotation, self.step)
        if self.acceleration_density is not None:
            transition = held_transition(transition, measured)
            process = held_process(
                process,
                measured,
                (self.step, self.gyro_period * self.step),
                (self.angle_density, self.bias_density, self.acceleration_density),
            )
        covariance = product(product(transition, estimate.covariance), transposed(transition))
        return replace(
            estimate,
            mrp=composed_mrp(mrp_of_rotation(rotation), estimate.mrp),
            covariance=symmetric(covariance + process),
        )

    def process(self) -> Array:
        """Covariance that the gyro's errors add over a step, shape (..., 6, 6).

        Source: Farrenkopf 1978, Analytic steady-state accuracy solutions for two common spacecraft attitude
        estimators; Markley & Crassidis 2014, eq. 6.93. The rotation within the step is left out of it.
        """
        step, angle, bias = self.step, self.angle_density, self.bias_density
        added = np.zeros((*angle.shape, 6, 6))
        for axis in range(3):
            added[..., axis, axis] = step * (angle + bias * (step * step / 3.0))
            added[..., axis, axis + 3] = added[..., axis + 3, axis] = -0.5 * step * step * bias
            added[..., axis + 3, axis + 3] = step * bias
        return added

    def _worked_in(self, estimate: AttitudeEstimate, taken: Array) -> AttitudeEstimate:
        """The estimate with the readings of all star trackers at its step, shape (..., T, 3)."""
        for number in range(len(self.tracker_columns)):
            reading = taken[..., number, :]
            given = ~np.isnan(reading[..., 0])
            if np.any(given):
                known = np.where(given[..., None], reading, estimate.mrp)
                estimate = select(given, self._observed(estimate, known, number), estimate)
        return estimate

    def _observed(self, estimate: AttitudeEstimate, reading: Array, number: int) -> AttitudeEstimate:
        """The estimate after a reading that is worked in, rejected, or taken for a new start."""
        updated, innovation = self.updated(estimate, reading, number)
        outlier = innovation > self.gate
        in_a_row = np.where(outlier, estimate.in_a_row + 1.0, 0.0)
        anew = outlier & (in_a_row >= self.max_consecutive_rejections)
        kept = select(outlier, select(anew, self._restarted(estimate, reading, number), estimate), updated)
        return replace(
            kept,
            innovation=innovation,
            rejected=estimate.rejected + outlier,
            in_a_row=np.where(anew, 0.0, in_a_row),
        )

    def updated(
        self, estimate: AttitudeEstimate, reading: Array, number: int
    ) -> tuple[AttitudeEstimate, Array]:
        """The estimate with a reading of a star tracker worked in.

        The errors about the three axes of the star tracker are independent, so they are worked in one after
        another and nothing has to be inverted; the covariance in Joseph's form, as in `KalmanFilter`.

        Args:
            estimate: of the step at which the reading was taken.
            reading: measured attitude, modified Rodrigues parameters, shape (..., 3).
            number: of the star tracker.

        Returns:
            The estimate, and the reading's normalised innovation squared, shape (...).
        """
        seen = small_rotation(reading, estimate.mrp)
        correction = np.zeros(estimate.covariance.shape[:-1])
        covariance, squared = estimate.covariance, np.zeros(seen.shape[:-1])
        for index in range(3):
            axis = np.broadcast_to(self.axes[..., number, index, :], seen.shape)
            variance = self.variance[..., number, index]
            column = multiply(covariance[..., :, :3], axis)
            innovation_variance = dot(column[..., :3], axis) + variance
            innovation = dot(seen - correction[..., :3], axis)
            squared = squared + innovation * innovation / innovation_variance
            gain = column / innovation_variance[..., None]
            correction = correction + gain * innovation[..., None]
            # (I - k h) P (I - k h)' + k r k', with h the axis, and zero for bias and held rate.
            left = covariance - gain[..., :, None] * column[..., None, :]
            both = left - multiply(left[..., :, :3], axis)[..., :, None] * gain[..., None, :]
            noise = np.asarray(variance)[..., None, None]
            covariance = both + noise * (gain[..., :, None] * gain[..., None, :])
        turned = replace(
            estimate,
            mrp=composed_mrp(0.25 * correction[..., :3], estimate.mrp),
            bias=estimate.bias + correction[..., 3:6],
            rate=estimate.rate + correction[..., 6:] if estimate.holds_rate else estimate.rate,
            covariance=symmetric(covariance),
        )
        return turned, squared

    def _restarted(self, estimate: AttitudeEstimate, reading: Array, number: int) -> AttitudeEstimate:
        """The attitude from a reading alone; the others as uncertain as before the first reading."""
        axes, start = self.axes[..., number, :, :], self.start.covariance
        variance = self.variance[..., number, :, None]
        covariance = np.zeros_like(estimate.covariance)
        covariance[..., :3, :3] = product(transposed(axes), variance * axes)
        covariance[..., 3:, 3:] = start[..., 3:, 3:]
        return replace(estimate, mrp=reading, covariance=covariance)


def small_rotation(mrp: Array, from_mrp: Array) -> Array:
    """Rotation from one attitude's axes to those of another, as four times its modified Rodrigues parameters.

    Args:
        mrp: attitude after the rotation, shape (..., 3).
        from_mrp: attitude before it, shape (..., 3).

    Returns:
        rad, shape (..., 3); it differs from the rotation vector by its cube over 48.

    Source: Markley & Crassidis 2014, ch. 6.2.
    """
    return 4.0 * relative_mrp(mrp, from_mrp)


def error_transition(rotation: Array, step: float) -> Array:
    """How the errors of attitude and bias go through a step at a constant rate.

    Args:
        rotation: of the body over the step, rotation vector, rad, shape (..., 3).
        step: s.

    Returns:
        Shape (..., 6, 6).

    Source: Markley & Crassidis 2014, eq. 6.86 to 6.92.
    """
    squared = dot(rotation, rotation)
    angle = np.sqrt(squared)
    half = sine_quotient(0.5 * angle)
    first, second = sine_quotient(angle), 0.5 * half * half
    small = angle < _SERIES
    # (angle - sin angle) / angle^3
    series = 1.0 / 6.0 - squared / 120.0 * (1.0 - squared / 42.0 * (1.0 - squared / 72.0))
    third = np.where(small, series, (1.0 - first) / np.where(small, 1.0, squared))
    skew = cross_matrix(rotation)
    square = rotation[..., :, None] * rotation[..., None, :] - squared[..., None, None] * _UNIT
    transition = np.zeros((*squared.shape, 6, 6))
    transition[..., :3, :3] = _UNIT - first[..., None, None] * skew + second[..., None, None] * square
    transition[..., :3, 3:] = -step * (
        _UNIT - second[..., None, None] * skew + third[..., None, None] * square
    )
    transition[..., 3:, 3:] = _UNIT
    return transition
