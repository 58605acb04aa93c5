# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A filter that has the readings of all satellites, run over a recorded flight.

It is what distributed navigation is compared with: the same model, the same kind of filter, all accelerations
known, each reading worked in once, at the step at which it was taken.
"""

from collections.abc import Sequence

import numpy as np

from satform.equipment.random_streams import FILTER_STREAM
from satform.flight.compile import FormationPlan
from satform.navigation.joint_state import SIZE, JointMeasurement
from satform.navigation.satellite_navigation import SatelliteNavigation
from satform.numeric.elementwise import Array
from satform.numeric.seeded_numbers import SeededNormals
from satform.record.flight_record import FlightRecord


def central_estimate(plan: FormationPlan, record: FlightRecord) -> Array | None:
    """Motion of all satellites as a filter with all readings estimates it.

    Prior and filter are those of the first satellite that estimates the whole formation.

    Args:
        plan: of the flight.
        record: of it, with its readings.

    Returns:
        Position (m) and velocity (m/s) of each satellite, LVLH, shape (K, N, 6); None where no satellite
        estimates the whole formation.
    """
    count = len(plan.names)
    navigations = [plan.satellite(index).navigation for index in range(count)]
    whole = [own for own in navigations if own is not None and len(own.members) == count]
    if not whole or record.navigation is None:
        return None
    first = whole[0]
    numbers = SeededNormals(first.seed, FILTER_STREAM, [count], max(1, first.filter.draws))
    present = first.filter.start(first.prior, numbers.at(0)[0])
    found = np.empty((record.steps, count, SIZE))
    # What a satellite measures that is lost, or skips the step, is used by no filter.
    readings = record.navigation.readings.copy()
    readings[: record.steps][record.not_flown] = np.nan
    for step in range(record.steps):
        draws = numbers.at(step)[0]
        if step > 0:
            over = first.model.over(step - 1, record.applied_acceleration[step - 1], [True] * count)
            present = first.filter.predict(present, over.transition, over.increment, over.process, draws)
        for function, measured in _measurements(navigations, readings, step):
            present, _ = first.filter.update(present, measured, function, draws)
        found[step] = first.filter.estimate(present).mean.reshape(count, SIZE)
    return found


def _measurements(
    navigations: Sequence[SatelliteNavigation | None], readings: Array, step: int
) -> list[tuple[JointMeasurement, Array]]:
    """What each satellite measured at a step, with the readings that arrived for it later."""
    found = []
    for index, navigation in enumerate(navigations):
        models, targets, numbers, begin = [], [], [], 0
        for channel in () if navigation is None else navigation.channels:
            arrival, columns = step + channel.timing.latency, slice(begin, begin + channel.width)
            begin += channel.width
            if channel.model is None or arrival >= len(readings):
                continue
            reading = readings[arrival, index, columns]
            if np.isfinite(reading).all():
                models.append(channel.model)
                targets.append(index if channel.model.target is None else channel.model.target)
                numbers.append(reading)
        if models:
            measurement = JointMeasurement.of(models, index, targets, numbers)
            found.append((measurement, np.concatenate(numbers)))
    return found
