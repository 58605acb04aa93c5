# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A truth that scipy's rotations turn, for filters of the attitude: gyro and star tracker readings, and NEES.

scipy's rotations are active: of a rotation from inertial to body axes they have the inverse matrix, so that
attitudes are composed in the other order. Gyro and star tracker readings are drawn here, not by the sensors.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from satform.attitude.attitude_filter import (
    AttitudeEstimate,
    AttitudeFilter,
    AttitudeMemory,
)
from satform.attitude.attitude_filter_spec import AttitudeFilterSpec
from satform.equipment.sensors.gyro import GyroSpec
from satform.equipment.sensors.protocol import SensorChannel
from satform.equipment.sensors.star_tracker import StarTrackerSpec
from satform.numeric.elementwise import Array
from satform.numeric.stacking import item

ARCSEC = math.radians(1.0 / 3600.0)
STEP = 1.0
ANGLE_WALK, BIAS_WALK = 1e-5, 1e-7
TURN_ON = 1e-4
RATE = np.array([0.02, -0.01, 0.03])


def tracker(**fields: object) -> StarTrackerSpec:
    return StarTrackerSpec.model_validate(
        {"cross_axis_noise": 10.0 * ARCSEC, "boresight_noise": 60.0 * ARCSEC, **fields}
    )


def gyro(**fields: object) -> GyroSpec:
    given = {"angle_random_walk": ANGLE_WALK, "rate_random_walk": BIAS_WALK, "turn_on_bias": TURN_ON}
    return GyroSpec.model_validate({**given, **fields})


def channels_of(*specs: GyroSpec | StarTrackerSpec) -> list[SensorChannel]:
    return [channel for spec in specs for channel in spec.build(["one"], 0, STEP)]


def mrp_of(rotation: Rotation) -> Array:
    return np.asarray(rotation.as_mrp())


class Truth:
    """A body that turns at a rate that swings, a gyro on it and star trackers, all with scipy's rotations."""

    def __init__(
        self,
        seed: int,
        specs: list[StarTrackerSpec],
        gyro_steps: int = 1,
        *,
        gyro_latency: int = 0,
        gyro_outage: range = range(0),
        acceleration: float = 0.0,
        known: float = 0.0,
    ) -> None:
        """The angular acceleration is white noise of a density (rad^2/s^3) and a known part (rad/s^2)."""
        self.random = np.random.default_rng(seed)
        self.specs, self.gyro_steps = specs, gyro_steps
        self.gyro_latency, self.gyro_outage = gyro_latency, gyro_outage
        self.acceleration, self.turning = acceleration, RATE
        self.known, self.told = known, np.zeros(3)
        self.gyro_sent: list[Array] = []
        # Active: body axes from inertial ones.
        self.body = Rotation.random(random_state=self.random)
        self.bias = TURN_ON * self.random.standard_normal(3)
        self.step = 0
        self.integrated = Rotation.identity()
        self.sent: list[list[Array]] = [[] for _ in specs]

    def values(self) -> Array:
        """Readings that arrive at the present step: the gyro's, then those of each star tracker."""
        gyro = np.full(3, np.nan)
        if self.step % self.gyro_steps == 0:
            time = self.gyro_steps * STEP
            walk = BIAS_WALK * math.sqrt(time) * self.random.standard_normal(3)
            white = math.sqrt(ANGLE_WALK**2 / time + BIAS_WALK**2 * time / 12.0)
            rate = self.integrated.as_rotvec() / time if self.step else self.rate()
            walk = walk if self.step else 0.0 * walk
            gyro = rate + self.bias + 0.5 * walk + white * self.random.standard_normal(3)
            self.bias = self.bias + walk
            self.integrated = Rotation.identity()
        self.gyro_sent.append(np.full(3, np.nan) if self.step in self.gyro_outage else gyro)
        gyro = (
            self.gyro_sent[-1 - self.gyro_latency] if self.gyro_latency <= self.step else np.full(3, np.nan)
        )
        for spec, sent in zip(self.specs, self.sent, strict=True):
            sent.append(self.seen(spec))
        late = [round(spec.latency / STEP) for spec in self.specs]
        arrived = [
            sent[-1 - wait] if wait < len(sent) else np.full(3, np.nan)
            for sent, wait in zip(self.sent, late, strict=True)
        ]
        return np.concatenate([gyro, *arrived])

    def seen(self, spec: StarTrackerSpec) -> Array:
        if self.step % max(1, round(spec.period / STEP)) or any(
            window.begin <= self.step * STEP < window.end for window in spec.outages
        ):
            return np.full(3, np.nan)
        looking = np.array(spec.boresight) / np.linalg.norm(spec.boresight)
        noise = self.random.standard_normal(3)
        across = spec.cross_axis_noise * (noise - looking * (looking @ noise))
        error = across + spec.boresight_noise * looking * self.random.standard_normal()
        return mrp_of(self.body * Rotation.from_rotvec(error))

    def rate(self) -> Array:
        if self.acceleration:
            return self.turning
        if self.gyro_steps > 1:
            # The filter takes the rate for constant between two readings of the gyro.
            return RATE
        return np.asarray(RATE * (1.0 + 0.5 * np.cos(0.01 * self.step * np.array([1.0, 1.3, 0.7]))))

    def advance(self) -> None:
        mean = self.rate()
        if self.acceleration:
            # Rate and integrated rate have the covariance of white acceleration exactly.
            walk = math.sqrt(self.acceleration * STEP) * self.random.standard_normal(3)
            between = math.sqrt(self.acceleration * STEP / 12.0) * self.random.standard_normal(3)
            self.told = self.known * np.cos(0.2 * self.step * np.array([1.0, 1.3, 0.7]))
            change = walk + self.told * STEP
            mean, self.turning = self.turning + 0.5 * change + between, self.turning + change
        turn = Rotation.from_rotvec(mean * STEP)
        self.body, self.integrated = self.body * turn, self.integrated * turn
        self.step += 1

    def error(self, estimate: AttitudeEstimate) -> Array:
        """Rotation from estimated to true body axes, true less estimated bias, and rate where one is held."""
        off = Rotation.from_mrp(estimate.mrp).inv() * self.body
        rate = self.rate() - estimate.rate if estimate.holds_rate else np.empty(0)
        return np.concatenate((off.as_rotvec(), self.bias - estimate.bias, rate))

    def nees(self, estimate: AttitudeEstimate) -> float:
        error = self.error(estimate)
        return float(error @ np.linalg.solve(estimate.covariance, error))


def filter_of(truth: Truth, **fields: object) -> AttitudeFilter:
    own = gyro(period=truth.gyro_steps * STEP, latency=truth.gyro_latency * STEP)
    specs = [own, *truth.specs]
    if truth.acceleration:
        fields = {"angular_acceleration_density": truth.acceleration, **fields}
    spec = AttitudeFilterSpec.model_validate(fields)
    return spec.build(channels_of(*specs), STEP, mrp_of(truth.body), truth.random.standard_normal(3))


def flown(truths: list[Truth], own: AttitudeFilter, steps: int) -> tuple[Array, AttitudeMemory]:
    """NEES of each step and truth, and the memory at the end, of as many filters in one."""
    memory = own.first(np.stack([truth.values() for truth in truths]))
    nees = []
    for number in range(steps + 1):
        if number:
            for truth in truths:
                truth.advance()
            told = np.stack([truth.told for truth in truths])
            memory = own.observe(memory, np.stack([truth.values() for truth in truths]), told)
        nees.append([truth.nees(item(memory.now, row)) for row, truth in enumerate(truths)])
    return np.array(nees), memory
