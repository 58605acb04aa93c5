# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Speed of inertial propagation with gravity of degree 10, beside brahe's propagator and SciPy's."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import brahe
import numpy as np
from scipy.integrate import solve_ivp

from satform.dynamics.inertial import InertialDynamics
from satform.dynamics.orbital_forces import gravitational_parameter
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import FixedStepSpec, GravitySpec
from satform.dynamics.truth_models import InertialDynamicsSpec
from satform.numeric.elementwise import Array
from satform.orbits.chief import ChiefOrbitSpec
from satform.orbits.time_scales import brahe_epoch

DEGREE = 10
SPAN = 2700.0
"""Simulated time of each measurement, s: half a low orbit."""

_EPOCH = datetime(2024, 1, 1, tzinfo=UTC)
_RADIUS = 7e6
_CHIEF = ChiefOrbitSpec(inclination=0.9)

Flight = Callable[[], Array]
"""Propagates from the start over the span; final inertial positions in m, shape (N, 3)."""


@dataclass(frozen=True)
class PlantRate:
    """One propagator with one setting and one number of satellites.

    Attributes:
        propagator: whose it is.
        setting: method and step or tolerance.
        satellites: how many fly.
        satellite_seconds_per_second: simulated time of all satellites in each second of wall-clock time.
        error: of the first satellite's inertial position at the end, m.
    """

    propagator: str
    setting: str
    satellites: int
    satellite_seconds_per_second: float
    error: float


def measure(counts: tuple[int, ...] = (1, 3, 10, 100), repetitions: int = 3) -> list[PlantRate]:
    """Rate and error of every propagator, one after another in this process and on one core.

    satform's includes the chief, which it propagates beside the satellites, and the LVLH states of
    every control period, as a plant needs them; the others give the final state alone.

    Args:
        counts: numbers of satellites.
        repetitions: of each measurement; the fastest one counts.

    Returns:
        A row for each propagator, setting and number of satellites.
    """
    exact = _by_scipy(_starts(1), 1e-13, 1e-9)()[0]
    rows = []
    for count in counts:
        starts = _starts(count)
        for propagator, setting, flight in _candidates(starts):
            seconds, end = min((_timed(flight) for _ in range(repetitions)), key=lambda result: result[0])
            error = float(np.linalg.norm(end[0] - exact))
            rows.append(PlantRate(propagator, setting, count, count * SPAN / seconds, error))
    return rows


def _timed(flight: Flight) -> tuple[float, Array]:
    begin = time.perf_counter()
    end = flight()
    return time.perf_counter() - begin, end


def _candidates(starts: Array) -> list[tuple[str, str, Flight]]:
    return [
        ("satform", "rk4, 1 s", _by_satform(starts, "rk4", 1.0)),
        ("satform", "rk4, 10 s", _by_satform(starts, "rk4", 10.0)),
        ("satform", "rk8, 60 s", _by_satform(starts, "rk8", 60.0)),
        ("satform", "rk8, 100 s", _by_satform(starts, "rk8", 100.0)),
        ("brahe", "RK4, 1 s", _by_brahe(starts, brahe.IntegrationMethod.RK4, 1.0)),
        ("brahe", "RK4, 10 s", _by_brahe(starts, brahe.IntegrationMethod.RK4, 10.0)),
        ("brahe", "DP54, default tolerances", _by_brahe(starts, brahe.IntegrationMethod.DP54, None)),
        ("SciPy", "DOP853, 1e-10", _by_scipy(starts, 1e-10, 1e-6)),
    ]


def _dynamics(count: int, method: str, step: float) -> InertialDynamics:
    rate = math.sqrt(gravitational_parameter() / _RADIUS**3)
    integrator = FixedStepSpec.model_validate({"kind": method, "maximum_step": step})
    spec = InertialDynamicsSpec(
        epoch=_EPOCH, chief=_CHIEF, gravity=GravitySpec(degree=DEGREE), integrator=integrator
    )
    return spec.build(DynamicsSetting(mean_motion=rate, step=step, satellite_count=count))


def _starts(count: int) -> Array:
    """Inertial position in m and velocity in m/s of satellites on circles about the chief, (N, 6)."""
    rate = math.sqrt(gravitational_parameter() / _RADIUS**3)
    angle = 2.0 * np.pi * np.arange(count) / 100.0
    position = 1e3 * np.stack((np.sin(angle), 2.0 * np.cos(angle), np.sin(angle)), axis=1)
    velocity = 1e3 * rate * np.stack((np.cos(angle), -2.0 * np.sin(angle), np.cos(angle)), axis=1)
    motion = _dynamics(count, "rk4", 1.0).start(position, velocity).motion[:, 1:]
    starts: Array = np.concatenate((motion[0], motion[1]), axis=1)
    return starts


def _by_satform(starts: Array, method: str, step: float) -> Flight:
    count = len(starts)
    dynamics = _dynamics(count, method, step)
    frame = dynamics.lvlh(dynamics.start(np.zeros((count, 3)), np.zeros((count, 3))))
    begin = dynamics.start(*frame)
    begin.motion[0, 1:], begin.motion[1, 1:] = starts[:, :3], starts[:, 3:]
    still = np.zeros((count, 3))

    def flight() -> Array:
        state = begin
        for number in range(round(SPAN / step)):
            state = dynamics.advance(state, still, number)
            dynamics.lvlh(state)
        end: Array = state.motion[0, 1:]
        return end

    return flight


def _by_brahe(starts: Array, method: Any, step: float | None) -> Flight:
    epoch = brahe_epoch(_EPOCH)
    # The package's type stubs take the constants of its enumerations for methods.
    # brahe's own propagator takes Earth orientation from the process.
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    turning: Any = brahe.FrameTransformationModel.EARTH_ROTATION_ONLY
    config = brahe.ForceModelConfig(
        gravity=brahe.GravityConfiguration(degree=DEGREE, order=DEGREE),
        frame_transform=turning,
    )
    numerics = brahe.NumericalPropagationConfig.with_method(method)
    if step is not None:
        numerics = numerics.with_initial_step(step)

    def flight() -> Array:
        # brahe's Earth orientation is global to the process.
        brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
        ends = []
        for start in starts:
            propagator = brahe.NumericalOrbitPropagator(epoch, start, numerics, config, None)
            propagator.propagate_to(epoch + SPAN)
            ends.append(propagator.current_state()[:3])
        return np.array(ends)

    return flight


def _by_scipy(starts: Array, relative: float, absolute: float) -> Flight:
    gravity = _dynamics(1, "rk4", 1.0).forces

    def rate(at: float, state: Array) -> Array:
        motion = state.reshape(1, 6)
        acceleration = gravity.acceleration(at, motion[:, :3], motion[:, 3:], ())
        return np.concatenate((state[3:], acceleration[0]))

    def flight() -> Array:
        ends = [
            solve_ivp(rate, (0.0, SPAN), start, method="DOP853", rtol=relative, atol=absolute).y[:3, -1]
            for start in starts
        ]
        return np.array(ends)

    return flight
