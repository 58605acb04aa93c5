"""Relative navigation: what a satellite is told of its motion, and the filter that makes more of it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from satform.dynamics.cw import input_matrix, transition_matrix
from satform.dynamics.linear import multiply
from satform.elementwise import Array
from satform.spec import NonNegative, NonNegativePerAxis, PerAxis, PositivePerAxis, Spec

NOISE_PER_STEP = 6
"""Standard normal numbers that `Sensor.measure` wants: three of position, three of velocity."""


@dataclass(frozen=True)
class Measurement:
    """Motion as measured, by one satellite or by many that measure together.

    Attributes:
        position: m, LVLH, shape (..., 3).
        velocity: m/s, in the rotating frame, shape (..., 3).
        step: number of the step at which the motion was so; older than now by the latency and by the
            time since the last update.
    """

    position: Array
    velocity: Array
    step: int


@dataclass(frozen=True)
class SensorMemory:
    """Measurements on their way.

    Attributes:
        delivered: the newest that has arrived.
        waiting: taken, but not yet arrived, oldest first.
    """

    delivered: Measurement
    waiting: tuple[Measurement, ...] = ()


@dataclass(frozen=True)
class Sensor:
    """White noise, bias, update rate and latency between the true motion and what is told of it.

    Attributes:
        noise: standard deviation of position (m) and velocity (m/s), shape (..., 6).
        bias: constant error of position (m) and velocity (m/s), shape (..., 6).
        update: steps between two measurements, at least 1.
        latency: steps from a measurement to its arrival.
    """

    noise: Array
    bias: Array
    update: int
    latency: int

    def start(self, position: Array, velocity: Array, normals: Array) -> SensorMemory:
        """The memory at step 0, whose measurement is there at once.

        Args:
            position: true, m, LVLH, shape (..., 3).
            velocity: true, m/s, shape (..., 3).
            normals: standard normal numbers of step 0, shape (..., 6).
        """
        return SensorMemory(self._taken(position, velocity, normals, 0))

    def measure(
        self, memory: SensorMemory, position: Array, velocity: Array, step: int, normals: Array
    ) -> SensorMemory:
        """What is known at one step; called at each step after 0, in order.

        Args:
            memory: of the step before.
            position: true, m, LVLH, shape (..., 3).
            velocity: true, m/s, shape (..., 3).
            step: number of the step.
            normals: standard normal numbers of this step, shape (..., 6).

        Returns:
            The memory whose `delivered` is what the satellite is told.
        """
        waiting = memory.waiting
        if step % self.update == 0:
            waiting = (*waiting, self._taken(position, velocity, normals, step))
        if waiting and waiting[0].step + self.latency <= step:
            return SensorMemory(waiting[0], waiting[1:])
        return replace(memory, waiting=waiting)

    def _taken(self, position: Array, velocity: Array, normals: Array, step: int) -> Measurement:
        error = self.bias + self.noise * normals
        return Measurement(position + error[..., :3], velocity + error[..., 3:], step)


class NavigationSpec(Spec):
    """Relative navigation of a satellite; what is left out is perfect."""

    position_noise: NonNegativePerAxis = (0.0, 0.0, 0.0)
    """Standard deviation of the white noise on position, LVLH [m]."""
    velocity_noise: NonNegativePerAxis = (0.0, 0.0, 0.0)
    """Standard deviation of the white noise on velocity, LVLH [m/s]."""
    position_bias: PerAxis = (0.0, 0.0, 0.0)
    """Constant error of position, LVLH [m]."""
    velocity_bias: PerAxis = (0.0, 0.0, 0.0)
    """Constant error of velocity, LVLH [m/s]."""
    update_period: NonNegative = 0.0
    """Time between measurements, whole control periods [s]; 0 for one at every step."""
    latency: NonNegative = 0.0
    """Time from a measurement to its arrival, whole control periods [s]."""

    def build(self, step: float) -> Sensor:
        """The sensor itself.

        Args:
            step: control period, s.

        Raises:
            ValueError: update period or latency is not a whole number of control periods.
        """
        return Sensor(
            noise=np.array([*self.position_noise, *self.velocity_noise]),
            bias=np.array([*self.position_bias, *self.velocity_bias]),
            update=max(1, _whole_steps("update_period", self.update_period, step)),
            latency=_whole_steps("latency", self.latency, step),
        )


def _whole_steps(name: str, duration: float, step: float) -> int:
    ratio = duration / step
    if abs(ratio - round(ratio)) > 1e-6 * max(1.0, ratio):
        nearest = max(1, round(ratio)) * step
        raise ValueError(
            f"{name} {duration:g} s is {ratio:g} control periods of {step:g} s; it has to be a whole number, "
            f"for example {nearest:g} s"
        )
    return round(ratio)


@dataclass(frozen=True)
class Estimate:
    """A motion with its uncertainty.

    Attributes:
        state: position (m) and velocity (m/s), LVLH, shape (..., 6).
        covariance: of the state's error, shape (..., 6, 6).
    """

    state: Array
    covariance: Array


@dataclass(frozen=True)
class CwKalmanFilter:
    """Kalman filter on CW dynamics with known commands and measured position and velocity.

    Attributes:
        transition: over one control period, shape (..., 6, 6).
        response: to a command held over one control period, shape (..., 6, 3).
        process: covariance added in one control period, shape (..., 6, 6).
        variance: of each measured component, shape (..., 6).

    Source: Kalman 1960; Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and
    Navigation, ch. 5.
    """

    transition: Array
    response: Array
    process: Array
    variance: Array

    def start(self, measurement: Measurement) -> Estimate:
        """The estimate from a first measurement alone."""
        state = np.concatenate((measurement.position, measurement.velocity), axis=-1)
        variance = np.broadcast_to(self.variance, state.shape)
        return Estimate(state, variance[..., None] * np.eye(6))

    def predict(self, estimate: Estimate, acceleration: Array) -> Estimate:
        """The estimate one control period later.

        Args:
            estimate: at the start of the period.
            acceleration: command held over it, m/s^2, shape (..., 3).
        """
        half = _product(self.transition, estimate.covariance)
        covariance = _product(half, np.swapaxes(self.transition, -1, -2)) + self.process
        return Estimate(self.predict_state(estimate.state, acceleration), covariance)

    def predict_state(self, state: Array, acceleration: Array) -> Array:
        """The state alone one control period later, shape (..., 6)."""
        return multiply(self.transition, state) + multiply(self.response, acceleration)

    def update(self, estimate: Estimate, measurement: Measurement) -> Estimate:
        """The estimate with a measurement of the same instant worked in.

        The six components are independent, so they are worked in one after another and nothing has
        to be inverted.
        """
        measured = np.concatenate((measurement.position, measurement.velocity), axis=-1)
        state, covariance = estimate.state, estimate.covariance
        for index in range(6):
            column = covariance[..., :, index]
            innovation_variance = column[..., index] + self.variance[..., index]
            gain = column / innovation_variance[..., None]
            state = state + gain * (measured[..., index] - state[..., index])[..., None]
            covariance = covariance - gain[..., :, None] * column[..., None, :]
        return Estimate(state, covariance)


def cw_kalman_filter(
    mean_motion: float, step: float, noise: Array, acceleration_density: Array
) -> CwKalmanFilter:
    """The filter for one chief, one control period and one quality of measurement.

    Args:
        mean_motion: of the chief, rad/s.
        step: control period, s.
        noise: standard deviation of measured position (m) and velocity (m/s), positive, shape (6,).
        acceleration_density: power spectral density of the unknown acceleration on each axis, taken to
            be white, m^2/s^3, shape (3,).
    """
    return CwKalmanFilter(
        transition=transition_matrix(mean_motion, step),
        response=input_matrix(mean_motion, step),
        process=process_covariance(mean_motion, step, acceleration_density),
        variance=np.asarray(noise, dtype=np.float64) ** 2,
    )


def process_covariance(mean_motion: float, step: float, acceleration_density: Array) -> Array:
    """Covariance that white acceleration adds to a free CW motion over a time span.

    Args:
        mean_motion: of the chief, rad/s.
        step: s.
        acceleration_density: power spectral density on each axis, m^2/s^3, shape (3,).

    Returns:
        Shape (6, 6), in m and m/s. The integral is taken by twelve-point Gauss-Legendre quadrature.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 4.3 (discretised continuous white noise).
    """
    abscissae, weights = np.polynomial.legendre.leggauss(12)
    total = np.zeros((6, 6))
    for abscissa, weight in zip(abscissae, weights, strict=True):
        response = transition_matrix(mean_motion, 0.5 * step * (1.0 + abscissa))[:, 3:]
        total += 0.5 * step * weight * (response * acceleration_density) @ response.T
    return total


def normalised_error_squared(error: Array, covariance: Array) -> Array:
    """Normalised estimation error squared (NEES): chi-square of 6 degrees if a filter is consistent.

    Args:
        error: estimate less truth, shape (..., 6).
        covariance: as the filter believes, shape (..., 6, 6).

    Returns:
        Dimensionless, shape (...). For analysis, not for flight.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 5.4.
    """
    squared: Array = np.sum(error * np.linalg.solve(covariance, error[..., None])[..., 0], axis=-1)
    return squared


@dataclass(frozen=True)
class EstimatorMemory:
    """What an estimator remembers between steps.

    Attributes:
        anchor: estimate at the step of the newest measurement worked in.
        step: number of that step.
        commands: accelerations applied in the steps since, oldest first, m/s^2, shape (..., 3) each.
        state: position (m) and velocity (m/s) now, shape (..., 6).
    """

    anchor: Estimate
    step: int
    commands: tuple[Array, ...]
    state: Array


@dataclass(frozen=True)
class Estimator:
    """The motion now, from measurements that may be rare and late and commands that are known.

    A measurement is worked in at the step at which it was taken; from there the estimate is carried
    to now with the commands given since.

    Attributes:
        filter: on whose dynamics and noise it rests.
        update: steps between two measurements; satellites that differ in it cannot be stacked.
        latency: steps from a measurement to its arrival; likewise.
    """

    filter: CwKalmanFilter
    update: int = 1
    latency: int = 0

    def start(self, measurement: Measurement) -> EstimatorMemory:
        """The memory at the step of a first measurement."""
        anchor = self.filter.start(measurement)
        return EstimatorMemory(anchor, measurement.step, (), anchor.state)

    def resume(
        self, memory: EstimatorMemory, missed: int, commanded: Array, applied: Array
    ) -> EstimatorMemory:
        """The memory after steps without the flight software, up to the step before the next one.

        The estimate is propagated over the gap with its covariance, which grows by the process noise of each
        step: the first measurement afterwards counts for more the longer the gap was.

        Args:
            memory: of the last step before the gap.
            missed: steps in the gap, at least 1.
            commanded: held from that last step on, m/s^2, shape (..., 3).
            applied: in each step of the gap, m/s^2, shape (..., 3).
        """
        meanwhile = (commanded, *(applied for _ in range(missed - 1)))
        state = memory.state
        for acceleration in meanwhile:
            state = self.filter.predict_state(state, acceleration)
        return replace(memory, commands=(*memory.commands, *meanwhile), state=state)

    def observe(self, memory: EstimatorMemory, measurement: Measurement, command: Array) -> EstimatorMemory:
        """The memory one step later.

        Args:
            memory: of the step before.
            measurement: the newest that has arrived, perhaps the same as at the step before.
            command: acceleration that was applied since the step before, m/s^2, shape (..., 3).
        """
        commands = (*memory.commands, command)
        if measurement.step <= memory.step:
            state = self.filter.predict_state(memory.state, command)
            return replace(memory, commands=commands, state=state)
        elapsed = measurement.step - memory.step
        anchor = memory.anchor
        for past in commands[:elapsed]:
            anchor = self.filter.predict(anchor, past)
        anchor = self.filter.update(anchor, measurement)
        state = anchor.state
        for past in commands[elapsed:]:
            state = self.filter.predict_state(state, past)
        return EstimatorMemory(anchor, measurement.step, commands[elapsed:], state)


class FilterSpec(Spec):
    """Kalman filter on CW dynamics between the measurements and the controller."""

    acceleration_density: PositivePerAxis
    """Power spectral density of the unknown acceleration, taken to be white, LVLH [m^2/s^3]."""
    position_noise: PositivePerAxis | None = None
    """Standard deviation of measured position that the filter believes [m]; the sensor's when left out."""
    velocity_noise: PositivePerAxis | None = None
    """Standard deviation of measured velocity that the filter believes [m/s]; the sensor's when left
    out."""

    def build(self, mean_motion: float, step: float, navigation: NavigationSpec) -> Estimator:
        """The estimator itself.

        Args:
            mean_motion: of the chief, rad/s.
            step: control period, s.
            navigation: whose noise is believed where nothing else is said.

        Raises:
            ValueError: a believed noise is zero, or the sensor's times are no whole control periods.
        """
        position = self.position_noise or navigation.position_noise
        velocity = self.velocity_noise or navigation.velocity_noise
        noise = np.array([*position, *velocity])
        if math.isclose(float(noise.min()), 0.0, abs_tol=0.0):
            raise ValueError(
                f"a Kalman filter cannot believe in a noise of zero: position_noise {position} m, "
                f"velocity_noise {velocity} m/s; give the filter positive ones"
            )
        density = np.array(self.acceleration_density)
        sensor = navigation.build(step)
        return Estimator(cw_kalman_filter(mean_motion, step, noise, density), sensor.update, sensor.latency)


def _product(left: Array, right: Array) -> Array:
    """Matrix product over the last two axes, element-wise and in a fixed order."""
    total: Array = left[..., :, 0, None] * right[..., 0, None, :]
    for index in range(1, left.shape[-1]):
        total = total + left[..., :, index, None] * right[..., index, None, :]
    return total
