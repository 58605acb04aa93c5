# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Describes control laws for `show`: gains, poles, pointing, and how far from their goal they start."""

import math
from typing import Any

import numpy as np

from satform.attitude.guidance import reference_at_start
from satform.attitude.mrp_tracking import attitude_error, attitude_transition
from satform.consensus.arc_length import ArcLengthConsensus
from satform.control.feedback_gains import feedback, sampled_poles
from satform.control.periodic_lqr import PeriodicLqr
from satform.control.protocol import ControlStep
from satform.control.sliding_mode import SlidingMode, reaching_time
from satform.flight.compile_satellite import flight_setting
from satform.flight.plans import FlightPlan
from satform.navigation.relative_state_filter import Estimator, estimation_transition
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference
from satform.scenario import Scenario
from satform_tools import console, truncated
from satform_tools.console import Table

COLUMNS = ("x", "y", "z", "vx", "vy", "vz", "integral x", "integral y", "integral z")
"""What the columns of a gain multiply."""


_ANOMALIES = 4
"""True anomalies, evenly from 0, at which a gain that repeats with the orbit is shown."""

_REAL = 1e-5
"""Share of a pole below which its imaginary part is not printed: rounding of poles that are nearly equal."""

_ROUNDING = 1e-12
"""Angle, rate and energy in SI units below which nothing is printed as left."""


def feedback_of(scenario: Scenario, index: int, plan: FlightPlan) -> dict[str, Any]:
    """Gain and poles of a satellite's control law and filter.

    Args:
        scenario: to describe.
        index: of the satellite.
        plan: of the satellite.

    Returns:
        `gain` K of u = -K e with rows x, y, z (SI units), or None; `gains_over_orbit`, likewise at true
        anomalies of the chief (rad), of a law whose gain repeats with them; `closed_loop_poles`,
        `observer_poles` and `filter_poles`, 1/s, complex ones as pairs, empty where there are none.
    """
    spec, setting = scenario.satellite(index).controller, flight_setting(scenario, index)
    assert spec is not None  # noqa: S101 - the scenario's validator has seen to it
    gain: list[list[float]] | None = None
    poles: tuple[complex, ...] = ()
    observer_poles: tuple[complex, ...] = ()
    with np.errstate(all="ignore"):
        transition = spec.linearisation(setting)
        if isinstance(transition, np.ndarray):
            poles = sampled_poles(transition, setting.step)
        elif transition is None and spec.follows == "reference":
            found = feedback(plan.controller, setting)
            if found is not None:
                gain, poles, observer_poles = found.gain.tolist(), found.poles, found.observer_poles
        filter_poles = _filter_poles(plan.estimator, setting.step)
    return {
        "gain": gain,
        "gains_over_orbit": _gains_over_orbit(plan.controller),
        "closed_loop_poles": _numbers(poles),
        "observer_poles": _numbers(observer_poles),
        "filter_poles": _numbers(filter_poles),
    }


def _gains_over_orbit(law: Any) -> list[dict[str, Any]]:
    if not isinstance(law, PeriodicLqr):
        return []
    rows = [index * len(law.gain) // _ANOMALIES for index in range(_ANOMALIES)]
    return [{"true_anomaly": math.tau * row / len(law.gain), "gain": law.gain[row].tolist()} for row in rows]


def _filter_poles(estimator: Estimator | None, step: float) -> tuple[complex, ...]:
    if estimator is None:
        return ()
    try:
        return sampled_poles(estimation_transition(estimator), step * estimator.update)
    except ValueError:
        return ()


def _numbers(poles: tuple[complex, ...]) -> list[float | list[float]]:
    return [[pole.real, pole.imag] if pole.imag else pole.real for pole in poles]


def start_of(plan: FlightPlan, disturbance: tuple[Array, Array]) -> dict[str, Any] | None:
    """Where a sliding-mode law starts.

    Args:
        plan: of a satellite.
        disturbance: bound and centre of what is declared for it, m/s^2, shape (3,) each.

    Returns:
        Sliding variable of each axis at the start, m/s; longest time until it is zero without and with the
        disturbances, s, None where that is not certain; Lyapunov function V = s's/2, m^2/s^2. None for other
        laws.
    """
    law = plan.controller
    if not isinstance(law, SlidingMode) or not isinstance(plan.consensus, ArcLengthConsensus):
        return None
    step = ControlStep(0, plan.step)
    sliding = law.act(plan.start, desired_at_start(plan), None, step).sliding_variable
    bound, centre = disturbance
    residual = bound - np.abs(centre) + np.abs(centre - law.disturbance_centre)
    free = reaching_time(sliding, law.switching_gain, law.reaching_gain)
    worst = reaching_time(sliding, law.switching_gain, law.reaching_gain, residual)
    return {
        "sliding_variable": sliding.tolist(),
        "reaching_time": _finite(free),
        "longest_reaching_time": _finite(worst),
        "lyapunov": 0.5 * float(sliding @ sliding),
    }


def desired_at_start(plan: FlightPlan) -> Reference:
    """The motion that a satellite's law follows in its first step, LVLH, shape (3,)."""
    arc_length, rate = plan.arc_length, plan.rate
    if isinstance(plan.consensus, ArcLengthConsensus) and plan.consensus.arc_length_source == "projected":
        arc_length, rate = plan.path.projected(plan.start.position, plan.start.velocity, arc_length)
    return plan.path.reference(arc_length, rate, np.zeros_like(rate))


def _finite(times: Array) -> list[float | None]:
    return [time if math.isfinite(time) else None for time in times.tolist()]


def attitude_of(scenario: Scenario, index: int, plan: FlightPlan) -> dict[str, Any] | None:
    """Pointing, gains, inertias and poles of a satellite's attitude; None without one."""
    spec, orientation = scenario.satellite(index).attitude, plan.orientation
    if spec is None or orientation is None:
        return None
    law, start = orientation.law, orientation.start
    wanted = reference_at_start(orientation, desired_at_start(plan))
    error = attitude_error(start.mrp, law.body.angular_velocity(start), wanted)
    return {
        "pointing": spec.pointing.model_dump(mode="json", exclude_none=True),
        "controller": spec.controller.kind,
        "attitude_gain": float(law.attitude_gain),
        "rate_gain": float(law.rate_gain),
        "inertia": law.body.inertia.tolist(),
        "wheel_inertia": law.body.wheel_inertia.tolist(),
        "wheel_torque_limit": spec.wheel_torque_limit,
        "wheel_momentum_limit": spec.wheel_momentum_limit,
        "closed_loop_poles": _numbers(
            sampled_poles(attitude_transition(law, scenario.timing.step), scenario.timing.step)
        ),
        "angle": 4.0 * math.atan(float(np.linalg.norm(error.mrp))),
        "rate_error": float(np.linalg.norm(error.angular_velocity)),
        "lyapunov": float(law.lyapunov(start, wanted)),
    }


def print_feedback(satellites: list[dict[str, Any]]) -> None:
    """Print the gains and poles that `feedback_of` has found, once for satellites with the same ones."""
    alike: dict[str, tuple[dict[str, Any], list[str]]] = {}
    for entry in satellites:
        if any(entry["feedback"].values()):
            alike.setdefault(repr(entry["feedback"]), (entry["feedback"], []))[1].append(entry["name"])
    for found, names in alike.values():
        whose = truncated.names(names)
        if found["gain"] is not None:
            console.line(f"gain of {whose}, u = -K e:")
            _print_gain(found["gain"])
        for entry in found["gains_over_orbit"]:
            anomaly = math.degrees(entry["true_anomaly"])
            console.line(f"gain of {whose}, u = -K e, at a true anomaly of the chief of {anomaly:g} deg:")
            _print_gain(entry["gain"])
        for key, words in (
            ("closed_loop_poles", "closed-loop poles"),
            ("observer_poles", "observer poles"),
            ("filter_poles", "filter poles"),
        ):
            if found[key]:
                console.line(f"{words} of {whose}: {_poles(found[key])} 1/s")
    if alike:
        console.line()


def _print_gain(gain: list[list[float]]) -> None:
    headings = ("K [1/s², 1/s, 1/s³]", *COLUMNS[: len(gain[0])])
    rows = [(axis, *(_digits(value) for value in row)) for axis, row in zip("xyz", gain, strict=True)]
    console.table(Table(headings, rows, frozenset(range(1, len(headings)))))


def print_start(satellites: list[dict[str, Any]]) -> None:
    """Print what `start_of` has found."""
    rows = []
    for entry in satellites:
        start = entry["sliding"]
        if start is not None:
            rows.append(
                (
                    entry["name"],
                    ", ".join(_digits(value) for value in start["sliding_variable"]),
                    ", ".join(_time(value) for value in start["reaching_time"]),
                    ", ".join(_time(value) for value in start["longest_reaching_time"]),
                    f"{start['lyapunov']:.6g}",
                )
            )
    if rows:
        headings = ("satellite", "s(0) [m/s]", "reaching time [s]", "longest, disturbed [s]", "V(0) [m²/s²]")
        truncated.table(Table(headings, rows, frozenset({4})))
        console.line()


def print_attitudes(satellites: list[dict[str, Any]]) -> None:
    """Print what `attitude_of` has found."""
    alike: dict[str, tuple[dict[str, Any], list[str]]] = {}
    rows = []
    for entry in satellites:
        attitude = entry["attitude"]
        if attitude is None:
            continue
        law = {
            key: value for key, value in attitude.items() if key not in {"angle", "rate_error", "lyapunov"}
        }
        alike.setdefault(repr({**law, "pointing": None}), (law, []))[1].append(entry["name"])
        goal = attitude["pointing"]
        rows.append(
            (
                entry["name"],
                f"{goal['kind']} at {goal['target']}" if "target" in goal else goal["kind"],
                _left(math.degrees(attitude["angle"])),
                _left(math.degrees(attitude["rate_error"])),
                _left(attitude["lyapunov"]),
            )
        )
    for law, names in alike.values():
        inertia = "; ".join(", ".join(_digits(value) for value in row) for row in law["inertia"])
        wheels = ", ".join(_digits(value) for value in law["wheel_inertia"])
        console.line(
            f"attitude of {truncated.names(names)}: {law['controller']}, attitude_gain "
            f"{law['attitude_gain']:g} N m, rate_gain {law['rate_gain']:g} N m s, inertia [{inertia}] kg m², "
            f"wheel_inertia [{wheels}] kg m²"
        )
        console.line(f"  closed-loop poles: {_poles(law['closed_loop_poles'])} 1/s")
    if rows:
        headings = ("satellite", "points", "angle at the start [deg]", "rate [deg/s]", "V(0) [J]")
        truncated.table(Table(headings, rows, frozenset({2, 3, 4})))
        console.line()


def _poles(values: list[float | list[float]]) -> str:
    texts = []
    for value in values:
        if not isinstance(value, list):
            texts.append(f"{value:.6g}")
        elif abs(value[1]) < _REAL * abs(value[0]):
            texts.append(f"{value[0]:.6g}")
        elif [value[0], -value[1]] not in values:
            texts.append(f"{value[0]:.6g} {'+' if value[1] > 0.0 else '-'} {abs(value[1]):.6g}i")
        elif value[1] > 0.0:
            texts.append(f"{value[0]:.6g} ± {value[1]:.6g}i")
    return ", ".join(texts)


def _digits(value: float) -> str:
    return f"{0.0 if abs(value) < 1e-20 else value:.6g}"


def _left(value: float) -> str:
    return f"{0.0 if abs(value) < _ROUNDING else value:.6g}"


def _time(value: float | None) -> str:
    return "not certain" if value is None else f"{value:.6g}"
