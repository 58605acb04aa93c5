# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The figures of pairs and of four satellites by their definitions, over the whole arrays of one flight."""

import math
from itertools import combinations
from typing import Any

import numpy as np

from figure_reductions import greatest, least, length, mean
from flight_arrays import Flight
from satform.control.protocol import Motion
from satform.control.relative_elements import elements_from_motion
from satform.dynamics.free_drift import least_free_distance
from satform.orbits.collision_probability import collision_probability
from satform.orbits.radial_normal import least_radial_normal_distance
from satform.orbits.sun import days_at, sun_in_lvlh
from satform.orbits.tetrahedron import QUALITIES


def closest_pass(expectation: Any, flight: Flight) -> tuple[float, np.ndarray, int] | None:
    """Time and separation of the closest pass, and the step from which it is found."""
    places = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    motions = flight.window(expectation, flight.arrays["velocity"], of_bodies=True)
    if places is None or motions is None:
        return None
    times = flight.window(
        expectation.model_copy(update={"satellites": flight.names[:1]}),
        (np.arange(flight.steps + 1) * flight.step)[:, None],
        of_bodies=True,
    )
    assert times is not None
    passes = []
    for time, place, motion in zip(times[:, 0], places, motions, strict=True):
        apart, closing = place[0] - place[1], motion[0] - motion[1]
        speed_squared = closing[0] * closing[0] + closing[1] * closing[1] + closing[2] * closing[2]
        product = apart[0] * closing[0] + apart[1] * closing[1] + apart[2] * closing[2]
        ahead = -product / speed_squared if speed_squared > 0.0 else -product
        ahead = max(-0.5 * flight.step, min(0.5 * flight.step, ahead))
        ahead = max(times[0, 0], min(times[-1, 0], time + ahead)) - time
        nearest = apart + ahead * closing
        passes.append(
            (
                nearest[0] * nearest[0] + nearest[1] * nearest[1] + nearest[2] * nearest[2],
                time + ahead,
                nearest,
                round(time / flight.step),
            )
        )
    _, when, nearest, step = min(passes, key=lambda own: own[0])
    return float(when), nearest, step


def pass_distance(expectation: Any, flight: Flight) -> float:
    found = closest_pass(expectation, flight)
    return math.nan if found is None else float(length(found[1]))


def pass_time(expectation: Any, flight: Flight) -> float:
    found = closest_pass(expectation, flight)
    return math.nan if found is None else found[0]


def pass_light_angle(expectation: Any, flight: Flight) -> float:
    found = closest_pass(expectation, flight)
    if found is None or not float(length(found[1])):
        return math.nan
    sun = sun_in_lvlh(days_at(expectation.epoch) + found[0] / 86400.0, expectation.chief_longitude)
    product = found[1][0] * sun[0] + found[1][1] * sun[1] + found[1][2] * sun[2]
    return math.acos(max(-1.0, min(1.0, product / float(length(found[1])))))


def pairs(expectation: Any, flight: Flight) -> list[tuple[str, str]]:
    return list(combinations(expectation.satellites or flight.names, 2))


def collision(expectation: Any, flight: Flight) -> float:
    found = []
    for pair in pairs(expectation, flight):
        closest = closest_pass(expectation.model_copy(update={"satellites": pair}), flight)
        whole = flight.window(expectation, flight.arrays["position"], of_bodies=True)
        motions = flight.window(expectation, flight.arrays["velocity"], of_bodies=True)
        if closest is None or whole is None or motions is None:
            return math.nan
        _, nearest, k = closest
        columns = flight.columns(pair)
        closing = flight.arrays["velocity"][k, columns[0]] - flight.arrays["velocity"][k, columns[1]]
        # Of a circular chief; the frame turns with it.
        closing = closing + flight.mean_motion * np.array([-nearest[1], nearest[0], 0.0])
        squared = nearest[0] * nearest[0] + nearest[1] * nearest[1] + nearest[2] * nearest[2]
        product = nearest[0] * closing[0] + nearest[1] * closing[1] + nearest[2] * closing[2]
        across = closing - nearest * (product / squared if squared > 0.0 else product)
        covariance = np.diag(np.square(expectation.standard_deviation or (math.nan,) * 3))
        if expectation.standard_deviation is None:
            estimates = flight.arrays["estimate_covariance"][min(k, flight.steps - 1)]
            covariance = estimates[columns[0], :3, :3] + estimates[columns[1], :3, :3]
        found.append(collision_probability(nearest, across, covariance, expectation.combined_radius))
    return math.nan if any(map(math.isnan, found)) else max(found)


def relative_motions(expectation: Any, flight: Flight) -> list[list[Motion]] | None:
    """Motion of each pair in each row."""
    places = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    motions = flight.window(expectation, flight.arrays["velocity"], of_bodies=True)
    if places is None or motions is None:
        return None
    indices = list(combinations(range(places.shape[1]), 2))
    return [
        [Motion(place[one] - place[other], motion[one] - motion[other]) for one, other in indices]
        for place, motion in zip(places, motions, strict=True)
    ]


def radial_normal(expectation: Any, flight: Flight) -> float:
    rate, angle = np.array([flight.mean_motion]), np.zeros(())
    found = [
        elements_from_motion(Motion(own.position[None], own.velocity[None]), rate, angle).as_array()
        for row in relative_motions(expectation, flight) or []
        for own in row
    ]
    return min((float(least_radial_normal_distance(own)[0]) for own in found), default=math.nan)


def passive_safety(expectation: Any, flight: Flight) -> float:
    found = [
        least_free_distance(own.position, own.velocity, flight.mean_motion, expectation.orbits)[0]
        for row in (relative_motions(expectation, flight) or [])[:: expectation.every]
        for own in row
    ]
    return min(map(float, found), default=math.nan)


def tetrahedron(expectation: Any, flight: Flight) -> np.ndarray | None:
    corners = flight.window(expectation, flight.arrays["position"], of_bodies=True)
    return None if corners is None else QUALITIES[expectation.quality](corners)[:, None]


def tetrahedron_quality(expectation: Any, flight: Flight) -> float:
    make = {"mean": mean, "minimum": least, "maximum": greatest}[expectation.statistic]
    return make(tetrahedron(expectation, flight))


def tetrahedron_quality_at(expectation: Any, flight: Flight) -> float:
    values = flight.arrays["position"]
    corners = flight.kept(
        values, flight.row(expectation, len(values)), flight.columns(expectation.satellites)
    )
    return math.nan if corners is None else float(QUALITIES[expectation.quality](corners)[0])
