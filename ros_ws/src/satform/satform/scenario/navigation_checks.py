# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Sensors and navigation of a scenario: built for its satellites, and what is wrong with them."""

from collections.abc import Callable

import numpy as np

from satform.attitude.attitude_filter import AttitudeFilter
from satform.common.spec import Complaint
from satform.equipment.random_streams import ATTITUDE_PRIOR_STREAM, MOST_CHANNELS
from satform.equipment.sensors.gyro import GyroSpec
from satform.equipment.sensors.protocol import SensorChannel
from satform.equipment.sensors.star_tracker import StarTrackerSpec
from satform.navigation.navigation_spec import NavigationSetting
from satform.navigation.satellite_navigation import SatelliteNavigation
from satform.numeric.elementwise import Array
from satform.numeric.seeded_numbers import SeededNormals
from satform.scenario.definition import ScenarioDefinition
from satform.scenario.environment import environment_of

_ATTITUDE_SENSORS = (("gyro", GyroSpec), ("star_tracker", StarTrackerSpec))


def sensor_channels(scenario: ScenarioDefinition, index: int) -> tuple[SensorChannel, ...]:
    """The channels of a satellite's sensors, in order.

    Args:
        scenario: whose parts are well-formed.
        index: of the satellite.

    Raises:
        ValueError: a sensor cannot be.
    """
    sensors = scenario.satellite(index).sensors
    if not sensors:
        # A list of all names for each of many satellites would take most of the time of a start.
        return ()
    names = [satellite.name for satellite in scenario.satellites]
    step = scenario.timing.step
    return tuple(channel for sensor in sensors for channel in sensor.build(names, index, step))


def navigation_of(
    scenario: ScenarioDefinition, index: int, start: Callable[[int], Array]
) -> SatelliteNavigation | None:
    """The navigation of a satellite; None for one that flies by its motion as it is measured.

    Args:
        scenario: whose parts are well-formed.
        index: of the satellite.
        start: position (m) and velocity (m/s) of a satellite at step 0 by its index, LVLH, shape (6,).

    Raises:
        ValueError: the filter cannot be.
    """
    spec = scenario.satellite(index).navigation
    if spec is None:
        return None
    setting = NavigationSetting(
        names=tuple(satellite.name for satellite in scenario.satellites),
        satellite=index,
        start=start,
        mean_motion=scenario.orbit.rate,
        step=scenario.timing.step,
        chief=scenario.chief,
        seed=scenario.seed,
    )
    return spec.build(setting, sensor_channels(scenario, index))


def attitude_filter_of(scenario: ScenarioDefinition, index: int, mrp: Array) -> AttitudeFilter | None:
    """The attitude filter of a satellite; None for one that knows its true attitude.

    Args:
        scenario: whose parts are well-formed.
        index: of the satellite.
        mrp: its true attitude at step 0, shape (3,).

    Raises:
        ValueError: the filter cannot be.
    """
    whole = scenario.satellite(index)
    spec = None if whole.attitude is None else whole.attitude.filter
    if spec is None:
        return None
    normals = SeededNormals(scenario.seed, ATTITUDE_PRIOR_STREAM, [index], 3).at(0)[0]
    return spec.build(sensor_channels(scenario, index), scenario.timing.step, mrp, normals)


def navigation_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    """Why sensors or filters of a scenario cannot be, with the path of each fault."""
    found: list[Complaint] = []
    for index, own in enumerate(scenario.satellites):
        shared = ("satellite_defaults",)
        given = own.model_fields_set
        sensors = ("satellites", index) if "sensors" in given else shared
        navigation = ("satellites", index) if "navigation" in given else shared
        faults = [((*sensors, "sensors", *path), text) for path, text in _sensor_faults(scenario, index)]
        if not faults:
            faults = [((*navigation, "navigation"), text) for text in _navigation_faults(scenario, index)]
            attitude = ("satellites", index) if "attitude" in given else shared
            faults += [((*attitude, "attitude"), text) for text in _attitude_faults(scenario, index)]
        found += [fault for fault in faults if fault not in found]
    return found + _exchange_complaints(scenario)


def _sensor_faults(scenario: ScenarioDefinition, index: int) -> list[Complaint]:
    sensors = scenario.satellite(index).sensors
    if not sensors:
        return []
    names, step = [satellite.name for satellite in scenario.satellites], scenario.timing.step
    found: list[Complaint] = []
    count = 0
    for number, sensor in enumerate(sensors):
        try:
            count += len(sensor.build(names, index, step))
        except ValueError as error:
            found.append(((number,), str(error)))
        if sensor.needs_sun and environment_of(scenario.dynamics) is None and scenario.orbit.chief is None:
            sentence = "needs the Sun: a truth model with a date, cw_perturbed or inertial, or orbit.chief"
            found.append(((number,), sentence))
    if count > MOST_CHANNELS:
        found.append(((), f"{count} channels; at most {MOST_CHANNELS} are allowed"))
    return found


def _navigation_faults(scenario: ScenarioDefinition, index: int) -> list[str]:
    whole = scenario.satellite(index)
    if whole.navigation is None:
        return []
    twice = [name for name in ("sensor", "filter") if getattr(whole, name) is not None]
    if twice:
        return [f"a satellite with navigation flies by its sensors; leave out {' and '.join(twice)}"]
    try:
        navigation_of(scenario, index, lambda _other: np.zeros(6))
    except ValueError as error:
        return [str(error)]
    return []


def _attitude_faults(scenario: ScenarioDefinition, index: int) -> list[str]:
    """What is wrong with the sensors of a satellite's attitude and its filter."""
    whole = scenario.satellite(index)
    kinds = [name for name, kind in _ATTITUDE_SENSORS if any(isinstance(own, kind) for own in whole.sensors)]
    if kinds and not whole.estimates_attitude:
        lacking = "attitude" if whole.attitude is None else "attitude.filter"
        return [f"the satellite has a {kinds[0]} and no {lacking} that uses it"]
    try:
        attitude_filter_of(scenario, index, np.zeros(3))
    except ValueError as error:
        return [str(error)]
    return []


def _exchange_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    """All satellites exchange estimates, or none: the messages of all have the same form."""
    specs = [scenario.satellite(index).navigation for index in range(len(scenario.satellites))]
    exchanging = [spec is not None and spec.exchange != "none" for spec in specs]
    if all(exchanging) or not any(exchanging):
        return []
    silent = exchanging.index(False)
    name = scenario.satellites[silent].name
    sentence = f"{name} exchanges no estimates, and others do; either all satellites do or none"
    return [(("satellites", silent), sentence)]
