# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Filter of a satellite's measured relative position and velocity (field `filter` of a scenario).

It has an innovation gate, and takes delayed measurements and gaps in the flight.

The innovation gate rejects measurements, and the filter is reinitialised after several rejections in a row
(`Estimator.observe`). A delayed measurement is fused at the step at which it was taken, and the estimate is
propagated from there to the current step. Prediction and update of the Kalman filter are in `kalman_filter`.

Delayed readings of satellites with `navigation` are in `satellite_navigation`.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from satform.common.spec import DensityPerAxis, DeviationPerAxis, Positive, Spec
from satform.dynamics.relative_motion_models import ModelName
from satform.equipment.sensors.relative_motion import Measurement, NavigationSpec
from satform.navigation.kalman_filter import Estimate, KalmanFilter, SteadyProcess, process_model
from satform.numeric.elementwise import Array
from satform.numeric.stacking import select
from satform.orbits.chief import KeplerianChief

DOUBTED = 22.457744
"""Largest innovation gate where one more rejected measurement reinitialises the filter.

The 99.9 % quantile of chi-square with 6 degrees of freedom.
"""


def _no_gate() -> Array:
    """For an estimator that works in every measurement."""
    return np.asarray(np.inf)


@dataclass(frozen=True)
class EstimatorMemory:
    """What an estimator remembers between steps.

    Attributes:
        anchor: estimate at the step of the newest measurement that was taken in.
        step: number of that step.
        commands: accelerations applied in the steps since, oldest first, m/s^2, shape (..., 3) each.
        state: position (m) and velocity (m/s) now, shape (..., 6).
        covariance: of the state's error now, shape (..., 6, 6).
        innovation: normalised innovation squared of the newest measurement, shape (...); 0 at first.
        rejected: measurements so far that the innovation gate rejected, shape (...).
        in_a_row: of these, the last ones without one between them that was worked in, shape (...).
    """

    anchor: Estimate
    step: int
    commands: tuple[Array, ...]
    state: Array
    covariance: Array
    innovation: Array
    rejected: Array
    in_a_row: Array


@dataclass(frozen=True)
class Estimator:
    """The motion now, from measurements that may be rare and late and commands that are known.

    A measurement is worked in at the step at which it was taken; from there the estimate is carried
    to now with the accelerations applied since. A measurement whose normalised innovation squared lies beyond
    the gate is rejected as an outlier. When several in a row are rejected it is the estimate that is wrong,
    and the filter starts anew from the last of them. The first measurement after a gap does so alone, and at
    `DOUBTED`, since what was commanded between a checkpoint and a loss is in no covariance.

    Attributes:
        filter: on whose dynamics and noise it rests.
        update: steps between two measurements; satellites that differ in it cannot be stacked.
        latency: steps from a measurement to its arrival; likewise.
        gate: largest normalised innovation squared of a measurement that is worked in, shape (...);
            infinite for no gate.
        max_consecutive_rejections: measurements rejected in a row after which the filter is initialised from
            the last of them, shape (...).

    Source: Bar-Shalom, Li & Kirubarajan, ch. 5.4 (consistency), ch. 5.2 (validation gate).
    """

    filter: KalmanFilter
    update: int = 1
    latency: int = 0
    gate: Array = field(default_factory=_no_gate)
    max_consecutive_rejections: Array = field(default_factory=_no_gate)

    def start(self, measurement: Measurement) -> EstimatorMemory:
        """The memory at the step of a first measurement."""
        anchor = self.filter.start(measurement)
        none = np.zeros(anchor.state.shape[:-1])
        return EstimatorMemory(
            anchor, measurement.step, (), anchor.state, anchor.covariance, none, none, none
        )

    def resume(
        self, memory: EstimatorMemory, missed: int, commanded: Array, applied: Array
    ) -> EstimatorMemory:
        """The memory after steps without the flight software, up to the step before the next one.

        The estimate is propagated over the gap with its covariance, which grows by the process noise of each
        step: the first measurement afterwards counts for more the longer the gap was. Of a gap that is longer
        than a measurement can be late, the part before is propagated at once; readings of it are lost.

        Args:
            memory: of the last step before the gap.
            missed: steps in the gap, at least 1.
            commanded: held from that last step on, m/s^2, shape (..., 3).
            applied: in each step of the gap, m/s^2, shape (..., 3).
        """
        now = Estimate(memory.state, memory.covariance)
        first = memory.step + len(memory.commands)
        last = first + missed
        now = self.filter.predict(now, commanded, first)
        # No measurement of an earlier step arrives after the gap.
        earliest = last - self.latency - self.update + 1
        anchor, step, commands = memory.anchor, memory.step, (*memory.commands, commanded)
        if earliest > first + 1:
            now = self.filter.predict_across(now, applied, first + 1, earliest - first - 1)
            anchor, step, commands = now, earliest, ()
        rest = range(step + len(commands), last)
        for number in rest:
            now = self.filter.predict(now, applied, number)
        return replace(
            memory,
            anchor=anchor,
            step=step,
            commands=(*commands, *(applied for _ in rest)),
            state=now.state,
            covariance=now.covariance,
            in_a_row=np.broadcast_to(self.max_consecutive_rejections - 1.0, memory.in_a_row.shape).copy(),
        )

    def observe(self, memory: EstimatorMemory, measurement: Measurement, command: Array) -> EstimatorMemory:
        """The memory one step later.

        Args:
            memory: of the step before.
            measurement: the newest that has arrived, perhaps the same as at the step before.
            command: acceleration that was applied since the step before, m/s^2, shape (..., 3).
        """
        commands = (*memory.commands, command)
        if measurement.step <= memory.step:
            number = memory.step + len(memory.commands)
            now = self.filter.predict(Estimate(memory.state, memory.covariance), command, number)
            return replace(memory, commands=commands, state=now.state, covariance=now.covariance)
        elapsed = measurement.step - memory.step
        predicted = memory.anchor
        for number, past in enumerate(commands[:elapsed], memory.step):
            predicted = self.filter.predict(predicted, past, number)
        updated, innovation = self.filter.update(predicted, measurement)
        doubted = (memory.in_a_row >= self.max_consecutive_rejections - 1.0) & (memory.in_a_row > 0.0)
        gate = np.where(doubted & np.isfinite(self.gate), np.minimum(self.gate, DOUBTED), self.gate)
        outlier = innovation > gate
        in_a_row = np.where(outlier, memory.in_a_row + 1.0, 0.0)
        anew = outlier & (in_a_row >= self.max_consecutive_rejections)
        anchor = select(outlier, select(anew, self.filter.start(measurement), predicted), updated)
        now = anchor
        for number, past in enumerate(commands[elapsed:], measurement.step):
            now = self.filter.predict(now, past, number)
        return EstimatorMemory(
            anchor=anchor,
            step=measurement.step,
            commands=commands[elapsed:],
            state=now.state,
            covariance=now.covariance,
            innovation=innovation,
            rejected=memory.rejected + outlier,
            in_a_row=np.where(anew, 0.0, in_a_row),
        )


class FilterSpec(Spec):
    """Kalman filter on a linear model of relative motion, between the measurements and the controller."""

    model: ModelName = "cw"
    """Relative motion between measurements: cw about a circular chief, yamanaka_ankersen about an eccentric
    one, j2_elements also under the Earth's oblateness."""

    acceleration_density: DensityPerAxis
    """Power spectral density of the unknown acceleration, taken to be white, LVLH [m^2/s^3]."""
    position_noise: DeviationPerAxis | None = None
    """Standard deviation of measured position that the filter assumes [m]; the sensor's when left out."""
    velocity_noise: DeviationPerAxis | None = None
    """Standard deviation of measured velocity that the filter assumes [m/s]; the sensor's when left
    out."""

    innovation_gate: Positive | None = 50.0
    """Largest normalised innovation squared of a measurement that is worked in; one beyond it is rejected.
    For a consistent filter it is chi-square distributed with 6 degrees of freedom, and beyond 50 five times
    in a thousand million. None for no gate."""
    max_consecutive_rejections: Annotated[int, Field(ge=1, le=1000)] = 5
    """Measurements rejected in a row at the last of which the filter starts anew from that one."""

    def build(
        self, mean_motion: float, step: float, navigation: NavigationSpec, chief: KeplerianChief | None = None
    ) -> Estimator:
        """The estimator itself.

        Args:
            mean_motion: of the chief, rad/s.
            step: control period, s.
            navigation: the sensor, whose noise is assumed where the filter has none of its own.
            chief: its orbit; None for a circular one in an unknown plane.

        Raises:
            ValueError: an assumed noise is zero, the sensor's times are no whole control periods, or the
                model does not know such an orbit.
        """
        position = self.position_noise or navigation.position_noise
        velocity = self.velocity_noise or navigation.velocity_noise
        noise = np.array([*position, *velocity])
        if math.isclose(float(noise.min()), 0.0, abs_tol=0.0):
            raise ValueError(
                f"a Kalman filter cannot assume a noise of zero: position_noise {position} m, "
                f"velocity_noise {velocity} m/s; give the filter positive ones"
            )
        density = np.array(self.acceleration_density)
        sensor = navigation.build(step)
        gate = np.inf if self.innovation_gate is None else self.innovation_gate
        return Estimator(
            KalmanFilter(process_model(self.model, mean_motion, step, density, chief), noise**2),
            sensor.update,
            sensor.latency,
            np.asarray(gate, dtype=np.float64),
            np.asarray(self.max_consecutive_rejections, dtype=np.float64),
        )


def estimation_transition(estimator: Estimator) -> Array:
    """How the error of a Kalman filter goes from one measurement to the next once its gain is constant.

    Args:
        estimator: of one satellite, whose model is the same in all control periods.

    Returns:
        Transition of the error of (position, velocity) over `estimator.update` steps, in units of the
        measurement noise, shape (6, 6).

    Raises:
        ValueError: the Riccati equation has no stabilising solution in double precision, or the gain changes
            along the chief's orbit.

    Source: Bar-Shalom, Li & Kirubarajan, ch. 5.2.5: the steady-state filter.
    """
    from scipy.linalg import solve_discrete_are  # noqa: PLC0415  slow to import, and not needed in flight

    if not isinstance(estimator.filter.model, SteadyProcess):
        raise ValueError("its gain changes along the chief's orbit")
    model = estimator.filter.model.each
    scale = np.sqrt(estimator.filter.variance)
    transition = model.transition / scale[:, None] * scale
    process = model.process / scale[:, None] / scale
    between, added = np.eye(6), np.zeros((6, 6))
    for _ in range(estimator.update):
        between, added = transition @ between, transition @ added @ transition.T + process
    try:
        predicted = solve_discrete_are(between.T, np.eye(6), added, np.eye(6))
    except (ValueError, np.linalg.LinAlgError) as error:
        raise ValueError(f"the filter's steady state was not found: {error}") from None
    gain = np.linalg.solve(predicted + np.eye(6), predicted).T
    corrected: Array = (np.eye(6) - gain) @ between
    return corrected
