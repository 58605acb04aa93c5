# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurement models against finite differences, closed forms and signals between Kepler orbits."""

import math

import brahe
import numpy as np
import pytest
from scipy.optimize import brentq

from satform.common.physical_constants import SPEED_OF_LIGHT
from satform.equipment.sensors.bearing_camera import BearingModel
from satform.equipment.sensors.gnss import MotionModel
from satform.equipment.sensors.ranging import RangingModel, two_way_reading
from satform.orbits.frames import lvlh_frame

MODELS = {
    "range": RangingModel("range", 0, 1, np.ones(1)),
    "range and rate": RangingModel("range and rate", 0, 1, np.ones(2)),
    "bearing": BearingModel("bearing", 0, 1, np.ones(2)),
    "gnss": MotionModel("gnss", 0, None, np.ones(3)),
    "differential gnss": MotionModel("differential gnss", 0, 1, np.ones(6)),
}


def states(count):
    rng = np.random.default_rng(5)
    scale = np.array([500.0, 500.0, 200.0, 0.5, 0.5, 0.5])
    return rng.normal(size=(2, count, 6)) * scale


def differences(model, states, which):
    """Derivatives of the prediction by one of both states, by central differences."""
    columns = []
    for component, width in enumerate([1e-2] * 3 + [1e-3] * 3):
        shift = np.zeros(6)
        shift[component] = width
        moved = [[*states], [*states]]
        moved[0][which] = states[which] - shift
        moved[1][which] = states[which] + shift
        less, more = (model.predicted(*pair) for pair in moved)
        columns.append(model.residual(more, less) / (2.0 * width))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("name", MODELS)
def test_jacobians_are_the_finite_differences(name):
    model, pair = MODELS[name], states(20)
    assert model.predicted(*pair).shape == (20, model.width)
    for which, jacobian in enumerate(model.jacobian(*pair)):
        assert jacobian.shape == (20, model.width, 6)
        # Rounding of ranges of 1 km over steps of 1 cm, and of rates over steps of 1 mm/s.
        np.testing.assert_allclose(jacobian, differences(model, pair, which), atol=2e-9, rtol=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_a_prediction_has_the_same_bits_alone_and_among_many(name):
    model, (own, other) = MODELS[name], states(20)
    together, derived = model.predicted(own, other), model.jacobian(own, other)
    for row in range(20):
        assert model.predicted(own[row], other[row]).tobytes() == together[row].tobytes()
        for alone, whole in zip(model.jacobian(own[row], other[row]), derived, strict=True):
            assert alone.tobytes() == whole[row].tobytes()


def test_bearings_are_those_of_a_triangle():
    model, own = MODELS["bearing"], np.zeros(6)
    for direction, azimuth, elevation in (
        ([0.0, 500.0, 0.0], 90.0, 0.0),
        ([-500.0, 0.0, 0.0], 180.0, 0.0),
        ([0.0, -100.0, 100.0], -90.0, 45.0),
        ([math.sqrt(3.0), 1.0, -2.0 / math.sqrt(3.0)], 30.0, -30.0),
    ):
        found = np.degrees(model.predicted(own, np.array([*direction, 1.0, 2.0, 3.0])))
        np.testing.assert_allclose(found, [azimuth, elevation], atol=1e-12)


def test_the_residual_of_an_azimuth_across_the_half_turn_is_small():
    residual = MODELS["bearing"].residual(np.array([math.pi - 0.01, 0.2]), np.array([-math.pi + 0.02, 0.1]))
    np.testing.assert_allclose(residual, [-0.03, 0.1], rtol=1e-12)


@pytest.mark.parametrize("speed", [-7000.0, 0.3, 2000.0])
def test_two_way_range_to_a_target_that_moves_along_the_line_has_its_closed_form(speed):
    distance, light = 1.2e6, SPEED_OF_LIGHT
    other = np.array([0.0, distance, 0.0, 0.0, speed, 0.0])
    found = two_way_reading(np.zeros(6), other)
    np.testing.assert_allclose(
        found, np.array([distance, speed]) * light / (light + speed), rtol=1e-14, atol=1e-12
    )


@pytest.mark.parametrize("speed", [-7000.0, 0.3, 2000.0])
def test_two_way_range_of_an_observer_that_moves_along_the_line_has_its_closed_form(speed):
    distance, light = 1.2e6, SPEED_OF_LIGHT
    own = np.array([0.0, 0.0, 0.0, 0.0, speed, 0.0])
    found = two_way_reading(own, np.array([0.0, distance, 0.0, 0.0, 0.0, 0.0]))
    # Up: distance + speed (down + up) = light up, with down = distance / light.
    factor = 0.5 * (1.0 + (light + speed) / (light - speed))
    np.testing.assert_allclose(found, np.array([distance, -speed]) * factor, rtol=1e-14, atol=1e-12)


AXIS = 7.0e6
RATE = math.sqrt(brahe.GM_EARTH / AXIS**3)


def kepler(elements, time):
    """Inertial state on a Kepler orbit, by brahe."""
    moved = np.array(elements)
    moved[5] += math.sqrt(brahe.GM_EARTH / moved[0] ** 3) * time
    return brahe.state_koe_to_eci(moved, brahe.AngleFormat.RADIANS)


CHIEF = (AXIS, 1e-9, 1.0, 0.3, 0.0, 0.2)
OBSERVER = (AXIS, 1e-3, 1.0, 0.3, 0.4, -0.25)
TARGET = (AXIS + 2000.0, 8e-3, 1.02, 0.28, 0.1, 0.18)


def from_chief(elements, time):
    """Position relative to the chief along inertial axes, in which light goes straight at its speed, m."""
    return kepler(elements, time)[:3] - kepler(CHIEF, time)[:3]


def travelled(time):
    """Two-way range of a signal that returns at a time, its light times by Brent's method, m."""

    def way(begin, end):
        return float(np.linalg.norm(end - begin)) / SPEED_OF_LIGHT

    arrived = from_chief(OBSERVER, time)
    down = brentq(lambda t: way(from_chief(TARGET, time - t), arrived) - t, 0.0, 0.1, xtol=1e-16)
    reflected = from_chief(TARGET, time - down)
    up = brentq(lambda t: way(from_chief(OBSERVER, time - down - t), reflected) - t, 0.0, 0.1, xtol=1e-16)
    return 0.5 * SPEED_OF_LIGHT * (down + up)


def test_two_way_reading_is_that_of_a_signal_between_two_kepler_orbits():
    chief = kepler(CHIEF, 0.0)
    frame = lvlh_frame(chief[:3], chief[3:])
    own, other = (
        np.concatenate(frame.to_lvlh(state[:3], state[3:]))
        for state in (kepler(OBSERVER, 0.0), kepler(TARGET, 0.0))
    )
    found = two_way_reading(own, other)
    distance, rate = MODELS["range and rate"].predicted(own, other)
    assert 2e5 < distance < 1e6
    # The light time is seen by a laser of a millimetre; what the model leaves out is not.
    assert abs(distance - travelled(0.0)) > 1e-2
    assert found[0] == pytest.approx(travelled(0.0), abs=1e-5)
    # Left out is the acceleration in LVLH along the line, times the light time of one way.
    times = 0.2 * np.arange(-2, 3)
    ranges = np.polynomial.Polynomial.fit(times, [travelled(time) for time in times], 4).convert()
    relative = other[3:] - own[3:]
    across = relative - rate * (other[:3] - own[:3]) / distance
    acceleration = 2.0 * ranges.coef[2] - across @ across / distance
    neglected = acceleration * distance / SPEED_OF_LIGHT
    assert found[1] - neglected == pytest.approx(ranges.coef[1], abs=3e-6)
    assert abs(neglected) > 1e-4
