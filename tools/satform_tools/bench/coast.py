# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Processor time of a long flight of two satellites without commands, beside brahe's propagator."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import brahe
import numpy as np

from satform.flight.simulate import simulate
from satform.numeric.elementwise import Array
from satform.orbits.time_scales import brahe_epoch
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, parse_scenario
from satform_tools.bench.figures import Figure, repeated

PERIOD = 1200.0
"""Control period, s."""

RKN1210 = "brahe RKN1210"

_DAY = 86400.0
_DEGREE, _MASS, _AREA, _DRAG_COEFFICIENT = 20, 100.0, 1.0, 2.2
_EPOCH = datetime(2024, 1, 1, tzinfo=UTC)
_SCENARIO = """
name: coast
title: Two satellites without commands at 500 km
text: Made for measuring speed.
orbit:
  chief:
    kind: keplerian
    semi_major_axis: 6878.137e3
    eccentricity: 0.0
    inclination: 0.9
    right_ascension: 0.0
    argument_of_perigee: 0.0
    mean_anomaly: 0.0
    epoch: {epoch}
timing: {{step: {period}, duration: {duration}}}
dynamics:
  kind: inertial
  gravity: {{degree: {degree}, rotation: closed}}
  drag: true
  sun: true
  moon: true
  body: {{mass: {mass}, drag_area: {area}, drag_coefficient: {coefficient}}}
  integrator: {{kind: collocation}}
graph: {{kind: none}}
consensus: {{kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}}
nominal_motion: {{rate: 0.0}}
satellite_defaults:
  curve: {{kind: fixed_point, position: [0.0, 0.0, 0.0]}}
  controller: {{kind: coast}}
satellites:
  - name: sat1
    start: {{kind: cartesian, position: [100.0, 200.0, 300.0], velocity: [0.1, -0.2, 0.3]}}
  - name: sat2
    start: {{kind: cartesian, position: [-100.0, -500.0, 50.0], velocity: [0.0, 0.1, 0.0]}}
"""


def scenario(days: float) -> Scenario:
    """The flight that is measured.

    Args:
        days: of flight, rounded up to whole control periods.
    """
    text = _SCENARIO.format(
        epoch=_EPOCH.isoformat(),
        period=PERIOD,
        duration=PERIOD * math.ceil(days * _DAY / PERIOD),
        degree=_DEGREE,
        mass=_MASS,
        area=_AREA,
        coefficient=_DRAG_COEFFICIENT,
    )
    return parse_scenario(text, "coast")


def measure(days: float, repetitions: int) -> Figure:
    """Processor time of the flight in process, and of brahe's RKN1210 for the same two trajectories.

    Both are measured in turns, in this process. The flight is that of `simulate`: truth model, flight
    software of both satellites and record. brahe's propagators have the same forces and start from the
    flight's own inertial states.

    Args:
        days: of flight, rounded up to whole control periods.
        repetitions: of each measurement.

    Returns:
        The figure; in its details the largest distance of a satellite from brahe's RKF78 at the end, m, and
        that of brahe's RKN1210.

    Raises:
        RuntimeError: the flight ended early.
    """
    flown = scenario(days)
    # What both load once is not measured.
    first = simulate(scenario(PERIOD / _DAY))
    starts = np.concatenate((first.inertial_position[0], first.inertial_velocity[0]), axis=1)
    _by_brahe(starts, PERIOD, brahe.NumericalPropagationConfig.high_precision())
    seconds = flown.timing.steps * PERIOD
    records: list[FlightRecord] = []
    ends: list[Array] = []

    def fly() -> None:
        records[:] = [simulate(flown)]

    def propagate() -> None:
        ends[:] = [_by_brahe(starts, seconds, brahe.NumericalPropagationConfig.high_precision())]

    figure = repeated(
        f"coast, {days:g} days, 2 satellites",
        RKN1210,
        lambda: _processor_time(propagate),
        lambda: _processor_time(fly),
        repetitions,
    )
    if records[0].early_end:
        raise RuntimeError(f"the flight ended early: {records[0].early_end.sentence}")
    reference = _by_brahe(starts, seconds, _rkf78())
    details = {
        "distance_from_rkf78": _largest(records[0].inertial_position[-1] - reference),
        "rkn1210_from_rkf78": _largest(ends[0] - reference),
    }
    return replace(figure, details=details)


def _processor_time(work: Callable[[], None]) -> float:
    begin = time.process_time()
    work()
    return max(time.process_time() - begin, math.ulp(1.0))


def _largest(difference: Array) -> float:
    return float(np.linalg.norm(difference, axis=1).max())


def _rkf78() -> Any:
    """The reference: steps of at most 30 s, of order 8."""
    order_8: Any = brahe.IntegrationMethod.RKF78
    method = brahe.NumericalPropagationConfig.with_method(order_8)
    return method.with_rel_tol(1e-13).with_abs_tol(1e-9).with_initial_step(30.0).with_max_step(30.0)


def _by_brahe(starts: Array, seconds: float, numerics: Any) -> Array:
    """Final inertial positions of brahe's propagator, m, shape (N, 3), from states of shape (N, 6)."""
    # brahe's Earth orientation is global to the process.
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    value = brahe.ParameterSource.value
    # The package's type stubs take the constants of its enumerations for methods.
    low: Any = brahe.EphemerisSource.LowPrecision
    bodies: tuple[Any, ...] = (brahe.ThirdBody.SUN, brahe.ThirdBody.MOON)
    harris_priester: Any = brahe.AtmosphericModel.HARRIS_PRIESTER
    turning: Any = brahe.FrameTransformationModel.EARTH_ROTATION_ONLY
    forces = brahe.ForceModelConfig(
        gravity=brahe.GravityConfiguration(degree=_DEGREE, order=_DEGREE),
        mass=value(_MASS),
        frame_transform=turning,
        drag=brahe.DragConfiguration(harris_priester, value(_AREA), value(_DRAG_COEFFICIENT)),
        third_body=[brahe.ThirdBodyConfiguration(body, low) for body in bodies],
    )
    epoch, ends = brahe_epoch(_EPOCH), []
    for start in starts:
        propagator = brahe.NumericalOrbitPropagator(epoch, start, numerics, forces, np.array([_MASS]))
        propagator.propagate_to(epoch + seconds)
        ends.append(propagator.current_state()[:3])
    return np.array(ends)
