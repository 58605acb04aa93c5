# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Specification of the attitude filter `kind: multiplicative_extended`."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.attitude.attitude_filter import UNKNOWN_RATE, AttitudeEstimate, AttitudeFilter
from satform.common.angle_text import OR_DEGREES
from satform.common.spec import LEAST_DEVIATION, Deviation, NonNegative, Positive, Spec
from satform.equipment.sensors.gyro import GyroChannel
from satform.equipment.sensors.protocol import SensorChannel
from satform.equipment.sensors.star_tracker import StarTrackerChannel
from satform.numeric.elementwise import Array
from satform.numeric.modified_rodrigues import composed_mrp, mrp_of_rotation


class AttitudeFilterSpec(Spec):
    """Attitude by a multiplicative extended Kalman filter on the gyro and the star trackers of `sensors`."""

    kind: Literal["multiplicative_extended"] = "multiplicative_extended"
    angle_random_walk: Deviation | None = None
    """Of the gyro, assumed by the filter, rad/s^(1/2); that of the gyro when left out."""
    rate_random_walk: NonNegative | None = None
    """Of the gyro's bias, assumed by the filter, rad/s^(3/2); that of the gyro when left out."""
    angular_acceleration_density: Positive | None = None
    """Power spectral density of the angular acceleration about each body axis, rad^2/s^3, beyond that of the
    rigid body by the momentum of its wheels; assumed over steps without a reading of the gyro, in which the
    estimated angular velocity goes on by this model. A gyro with `outages` or `latency` needs it. Without it,
    the newest reading counts as measured until the next one has arrived."""
    initial_attitude_error: Annotated[float, Field(ge=LEAST_DEVIATION, le=math.pi), OR_DEGREES] = (
        math.radians(1.0)
    )
    """Standard deviation of the first estimate about each axis, rad or text such as `1 deg`; the estimate is
    the true attitude turned by a seeded draw of it."""
    initial_bias_error: Deviation | None = None
    """Standard deviation of the gyro's bias on each axis about its first estimate, which is zero, rad/s; when
    left out the gyro's `turn_on_bias` and `bias` together."""
    innovation_gate: Positive | None = 30.0
    """Largest normalised innovation squared of a star tracker's reading that is worked in; one beyond it is
    rejected. For a consistent filter it is chi-square distributed with 3 degrees of freedom, and beyond 30
    1.4 times in a million. None for no gate."""
    max_consecutive_rejections: Annotated[int, Field(ge=1, le=1000)] = 5
    """Readings rejected in a row at the last of which the attitude is taken from that one."""

    def build(
        self, channels: Sequence[SensorChannel], step: float, mrp: Array, normals: Array
    ) -> AttitudeFilter:
        """The filter itself.

        Args:
            channels: of all sensors of the satellite, in the order of their readings.
            step: control period, s.
            mrp: true attitude at the start, shape (3,).
            normals: standard normal numbers for the error of the first estimate, shape (3,).

        Raises:
            ValueError: the satellite has not exactly one gyro or no star tracker, a noise is zero, or the
                gyro's readings are late or missing and no angular acceleration is assumed.
        """
        found = _columns(channels)
        gyros = [(column, channel) for column, channel in found if isinstance(channel, GyroChannel)]
        trackers = [(column, channel) for column, channel in found if isinstance(channel, StarTrackerChannel)]
        if len(gyros) != 1 or not trackers:
            raise ValueError(
                "an attitude filter needs one gyro and at least one star_tracker among the satellite's "
                f"sensors, which have {len(gyros)} and {len(trackers)}"
            )
        ((gyro_column, gyro),) = gyros
        angle = gyro.angle_random_walk if self.angle_random_walk is None else self.angle_random_walk
        bias = gyro.rate_random_walk if self.rate_random_walk is None else self.rate_random_walk
        variance = np.stack([channel.noise * channel.noise for _, channel in trackers])
        if not (angle >= LEAST_DEVIATION and variance.min() > 0.0):
            raise ValueError(
                "an attitude filter cannot assume a noise of zero: give the star_tracker a positive "
                "cross_axis_noise and boresight_noise, and the gyro or the filter an angle_random_walk"
            )
        return AttitudeFilter(
            step=step,
            gyro_column=gyro_column,
            gyro_period=gyro.timing.period,
            gyro_latency=gyro.timing.latency,
            tracker_columns=tuple(column for column, _ in trackers),
            tracker_latencies=tuple(channel.timing.latency for _, channel in trackers),
            axes=np.stack([channel.axes for _, channel in trackers]),
            variance=variance,
            angle_density=np.asarray(angle * angle),
            bias_density=np.asarray(bias * bias),
            acceleration_density=self._acceleration_density(gyro),
            start=self._start(gyro, mrp, normals),
            gate=np.asarray(np.inf if self.innovation_gate is None else self.innovation_gate),
            max_consecutive_rejections=np.asarray(float(self.max_consecutive_rejections)),
        )

    def _acceleration_density(self, gyro: GyroChannel) -> Array | None:
        """What is assumed over steps without a reading of the gyro; needed if it leaves some out."""
        density, timing = self.angular_acceleration_density, gyro.timing
        if density is None and (timing.latency or timing.outages):
            late = "latency" if timing.latency else "outages"
            raise ValueError(
                f"a gyro with {late} leaves steps without a reading, in which the filter predicts the rate: "
                "give the filter an angular_acceleration_density"
            )
        return None if density is None else np.asarray(density)

    def _start(self, gyro: GyroChannel, mrp: Array, normals: Array) -> AttitudeEstimate:
        """The estimate before the first reading: the truth less a draw from its error."""
        error = self.initial_attitude_error
        bias = gyro.largest_bias if self.initial_bias_error is None else self.initial_bias_error
        if not bias > 0.0:
            raise ValueError("a gyro without turn_on_bias and bias: give the filter an initial_bias_error")
        # The error is the rotation from the estimated to the true axes.
        estimated = composed_mrp(mrp_of_rotation(-error * normals), mrp)
        variances = [error * error, bias * bias]
        if self.angular_acceleration_density is not None:
            variances.append(UNKNOWN_RATE)
        covariance, none = np.diag(np.repeat(variances, 3)), np.zeros(())
        return AttitudeEstimate(estimated, np.zeros(3), np.zeros(3), covariance, none, none, none)


def _columns(channels: Sequence[SensorChannel]) -> list[tuple[int, SensorChannel]]:
    """Each channel with the column of its first number among the readings of the satellite."""
    found: list[tuple[int, SensorChannel]] = []
    column = 0
    for channel in channels:
        found.append((column, channel))
        column += channel.width
    return found
