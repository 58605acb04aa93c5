# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""From a scenario to the plans of one satellite: flight software, parameters, start and attitude."""

from collections.abc import Sequence

import numpy as np

from satform.attitude.ground_pointing import CircularOrbit
from satform.attitude.guidance import Orientation, Target, orientation
from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.control.protocol import FlightSetting, Motion
from satform.flight.chief_motion import turning_axes
from satform.flight.plans import FlightPlan, ParameterPlan
from satform.navigation.relative_state_filter import Estimator
from satform.numeric import stacking
from satform.numeric.elementwise import Array, scalar
from satform.orbits.curve_specs import InertialPointSpec
from satform.orbits.path_reference import Path, Reference
from satform.orbits.turning_axes import TurningPointPath
from satform.scenario import Scenario
from satform.scenario.environment import pointing_in
from satform.scenario.navigation_checks import attitude_filter_of, navigation_of
from satform.scenario.parts import SatelliteSpec


def flight_plan(scenario: Scenario, index: int, neighbours: Sequence[int] | None = None) -> FlightPlan:
    """Plan of the satellite with an index in a scenario's list.

    Args:
        scenario: what is flown.
        index: of the satellite.
        neighbours: indices of its possible in-neighbours, ascending; by the scenario's graph when left out.
    """
    spec = scenario.satellite(index)
    assert spec.controller is not None  # noqa: S101 - the scenario's validator has seen to it
    path, nominal, desired = departure(scenario, spec)
    arc_length, rate = scalar(spec.arc_length), scalar(nominal if spec.rate is None else spec.rate)
    aim = _orientation(scenario, index, desired, neighbours)
    return FlightPlan(
        path=path,
        controller=spec.controller.build(flight_setting(scenario, index)),
        consensus=scenario.consensus.build(),
        nominal_rate=scalar(nominal),
        phase_offset=scalar(spec.phase_offset),
        arc_length=arc_length,
        rate=rate,
        start=_start(scenario, index),
        step=scenario.timing.step,
        estimator=_estimator(scenario, spec),
        orientation=aim,
        attitude_filter=None if aim is None else attitude_filter_of(scenario, index, aim.start.mrp),
        navigation=None
        if spec.navigation is None
        else navigation_of(scenario, index, lambda other: _start_numbers(scenario, other)),
    )


def flight_setting(scenario: Scenario, index: int) -> FlightSetting:
    """What the controller of the satellite with this index may know of a scenario."""
    step, thruster = scenario.timing.step, scenario.satellite(index).thruster
    return FlightSetting(
        mean_motion=scenario.orbit.rate,
        step=step,
        thrust_resolution=0.0 if thruster is None else thruster.resolution(step),
        thrust_error=0.0 if thruster is None else thruster.largest_error,
        chief=scenario.chief,
    )


def parameter_plan(scenario: Scenario, index: int) -> ParameterPlan:
    """What of one satellite may be changed in flight."""
    own = scenario.satellite(index)
    assert own.controller is not None  # noqa: S101 - the scenario's validator has seen to it
    assert own.curve is not None  # noqa: S101 - likewise
    return ParameterPlan(
        controller=own.controller,
        curve=own.curve,
        phase_offset=own.phase_offset,
        attitude_controller=None if own.attitude is None else own.attitude.controller,
        setting=flight_setting(scenario, index),
        scale=own.scale,
        nominal_motion=scenario.nominal_motion,
    )


def departure(scenario: Scenario, spec: SatelliteSpec) -> tuple[Path, float, Reference]:
    """Path of a satellite, rate of its arc length once all agree, and its desired motion at the start."""
    assert spec.curve is not None  # noqa: S101 - the scenario's validator has seen to it
    path = Path(spec.curve.build(), scalar(spec.scale), spec.path_parameter, spec.feedforward_sample)
    if isinstance(spec.curve, InertialPointSpec):
        axes = turning_axes(scenario, spec.curve.axes)
        path = TurningPointPath(path.curve, path.scale, path.parameter, path.feedforward_sample, axes=axes)
    nominal = scenario.nominal_motion.rate_along(float(path.period))
    rate = scalar(nominal if spec.rate is None else spec.rate)
    return path, nominal, path.reference(scalar(spec.arc_length), rate, np.zeros_like(rate))


def motion_at_start(scenario: Scenario) -> Motion:
    """Where all satellites begin: by their `start`, or on their references, off by the scenario's errors.

    Returns:
        Position in m and velocity in m/s in LVLH, shapes (N, 3).
    """
    starts = [flight_plan(scenario, index).start for index in range(len(scenario.satellites))]
    return stacking.stack(starts)


def orientations(scenario: Scenario) -> list[Orientation | None]:
    """Where each satellite of a scenario points; None for one without attitude."""
    return [flight_plan(scenario, index).orientation for index in range(len(scenario.satellites))]


def attitude_orbit(scenario: Scenario, index: int) -> CircularOrbit | None:
    """The chief's orbit in the axes in which a satellite's attitude is measured; None without attitude."""
    spec = scenario.satellite(index).attitude
    if spec is None:
        return None
    pointing = pointing_in(scenario.dynamics, spec.pointing)
    if isinstance(pointing, SatellitePointingSpec):
        return pointing.build(scenario.orbit.rate, scenario.orbit.radius).orbit
    return pointing.build().orbit


def _start(scenario: Scenario, index: int) -> Motion:
    """Where a satellite begins: by its `start`, or on its reference, off by the scenario's errors."""
    spec = scenario.satellite(index)
    _, _, desired = departure(scenario, spec)
    return scenario.start_of(index) or Motion(
        desired.position + np.asarray(spec.position_error),
        desired.velocity + np.asarray(spec.velocity_error),
    )


def _start_numbers(scenario: Scenario, index: int) -> Array:
    """Position (m) and velocity (m/s) of a satellite at the start, LVLH, shape (6,)."""
    start = _start(scenario, index)
    return np.concatenate((start.position, start.velocity))


def _orientation(
    scenario: Scenario, index: int, desired: Reference, neighbours: Sequence[int] | None
) -> Orientation | None:
    spec = scenario.satellite(index).attitude
    if spec is None:
        return None
    spec = spec.model_copy(update={"pointing": pointing_in(scenario.dynamics, spec.pointing)})
    target = None
    if isinstance(spec.pointing, SatellitePointingSpec):
        names = [satellite.name for satellite in scenario.satellites]
        other = names.index(spec.pointing.target)
        aimed_at = scenario.satellite(other)
        path, nominal, begin = departure(scenario, aimed_at)
        in_neighbours = scenario.possible_graph().neighbours(index) if neighbours is None else neighbours
        known = Target(
            path=path,
            phase_offset=scalar(aimed_at.phase_offset),
            satellite=np.asarray(other, dtype=np.int64),
            row=np.asarray(in_neighbours.index(other), dtype=np.int64),
            planned_phase=scalar(aimed_at.arc_length - aimed_at.phase_offset),
            planned_rate=scalar(nominal if aimed_at.rate is None else aimed_at.rate),
        )
        if spec.pointing.initial_target is not None:
            first = scenario.satellite(names.index(spec.pointing.initial_target))
            _, _, begin = departure(scenario, first)
        target = (known, begin)
    return orientation(spec, (scenario.orbit.rate, scenario.orbit.radius), desired, target)


def _estimator(scenario: Scenario, spec: SatelliteSpec) -> Estimator | None:
    if spec.filter is None:
        return None
    assert spec.sensor is not None  # noqa: S101 - the scenario's validator has seen to it
    return spec.filter.build(scenario.orbit.rate, scenario.timing.step, spec.sensor, scenario.chief)
