# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about sensors whose readings never come, or that nobody uses."""

from collections.abc import Iterator

from satform.equipment.sensors.gyro import GyroSpec
from satform.equipment.sensors.sensor_spec import SensorSpec
from satform.equipment.sensors.star_tracker import StarTrackerSpec
from satform.flight.compile_satellite import flight_plan
from satform.scenario import Scenario
from satform.scenario.navigation_checks import sensor_channels
from satform_tools.check.observability import planned_flight, planned_steps, sight


def sensor_warnings(scenario: Scenario) -> list[str]:
    """A sentence for each sensor that is in vain, and for each outage outside of the flight."""
    found: list[str] = []
    for index, satellite in enumerate(scenario.satellites):
        whole = scenario.satellite(index)
        for number, sensor in enumerate(whole.sensors):
            path = f"satellites[{index}].sensors[{number}]"
            if whole.navigation is None and not whole.external and not _is_of_attitude(sensor):
                found.append(
                    f"{path}: measures, and {satellite.name} has no navigation that uses it; "
                    "it flies by its true motion or by `sensor`"
                )
            found += [f"{path}{text}" for text in _of_times(scenario, sensor)]
    return found + _unseen(scenario)


def _is_of_attitude(sensor: SensorSpec) -> bool:
    return isinstance(sensor, GyroSpec | StarTrackerSpec)


def _of_times(scenario: Scenario, sensor: SensorSpec) -> Iterator[str]:
    """Times of a sensor that the flight is too short for."""
    duration, last = scenario.timing.duration, scenario.timing.steps
    timing = sensor.timing(scenario.timing.step)
    but = f"but the flight lasts {duration:g} s"
    if timing.latency >= last:
        yield f".latency: {sensor.latency:g} s, {but}: no reading arrives"
    elif timing.period >= last > 1:
        yield f".period: {sensor.period:g} s, {but}: there is one reading, at its start"
    for number, (begin, _) in enumerate(timing.outages):
        if begin >= last:
            window = sensor.outages[number]
            yield (
                f".outages[{number}]: begins at {window.begin:g} s, after the flight's end at {duration:g} s"
            )
    if timing.outages and not any(timing.is_due(step) for step in range(last)):
        yield ".outages: cover all readings of the flight"


def _unseen(scenario: Scenario) -> list[str]:
    """Channels that have no reading on the planned motion."""
    plans = [flight_plan(scenario, index) for index in range(len(scenario.satellites))]
    navigations = [plan.navigation for plan in plans if plan.navigation is not None]
    if not navigations:
        return []
    steps = planned_steps(scenario)
    flight = planned_flight(scenario, plans, navigations[0], steps)
    found = []
    for index, satellite in enumerate(scenario.satellites):
        for channel in sensor_channels(scenario, index):
            if channel.model is None or not any(map(channel.timing.is_due, range(scenario.timing.steps))):
                continue
            if not sight(scenario, flight, channel, [*steps, scenario.timing.steps]).readings.any():
                found.append(
                    f"sensors of {satellite.name}: {channel.name} has no reading on the planned motion; look "
                    "at its field of view, its range, and the Earth in between"
                )
    return found
