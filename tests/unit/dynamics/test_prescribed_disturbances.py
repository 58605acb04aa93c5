# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Disturbing accelerations: their formulas, bounds, and independence of who else flies."""

import numpy as np
import pytest
from pydantic import ValidationError

from satform.dynamics.prescribed_disturbances import (
    BoundedNoiseSpec,
    ConstantSpec,
    HarmonicSpec,
    PerturbationSetting,
)

MEAN_MOTION = 2.0 * np.pi / 6000.0


def setting(count=3, seed=5, index=0, step=0.5):
    return PerturbationSetting(
        mean_motion=MEAN_MOTION, step=step, satellite_count=count, seed=seed, index=index
    )


def test_harmonic_is_the_sinusoid_of_the_case_study():
    phase = (0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0)
    harmonic = HarmonicSpec(amplitude=0.01, phase=phase, phase_step=0.7).build(setting())
    for step, offset in ((0, 0.0), (7, 0.2), (12345, 0.5)):
        time = step * 0.5 + offset
        for satellite, row in enumerate(harmonic.acceleration(step, offset)):
            expected = 0.01 * np.sin(MEAN_MOTION * time + np.array(phase) + 0.7 * satellite)
            assert row == pytest.approx(expected, abs=1e-16)
    assert np.array_equal(harmonic.bound(), np.full((3, 3), 0.01))
    assert not harmonic.centre().any()


def test_harmonic_takes_its_own_frequency_when_given_one():
    harmonic = HarmonicSpec(amplitude=(1.0, 0.0, 0.0), angular_frequency=np.pi).build(setting(1, step=1.0))
    assert harmonic.acceleration(0, 0.5)[0, 0] == pytest.approx(1.0)
    assert harmonic.acceleration(1, 0.5)[0, 0] == pytest.approx(-1.0)


def test_constant_is_its_own_bound_and_centre():
    constant = ConstantSpec(acceleration=(0.1, -0.2, 0.3)).build(setting(2))
    assert np.array_equal(constant.acceleration(9, 0.1), [[0.1, -0.2, 0.3]] * 2)
    assert np.array_equal(constant.bound(), [[0.1, 0.2, 0.3]] * 2)
    assert np.array_equal(constant.centre(), [[0.1, -0.2, 0.3]] * 2)


def test_noise_is_uniform_within_its_bound_and_uncorrelated():
    noise = BoundedNoiseSpec(bound=(0.1, 0.2, 0.0)).build(setting(2))
    values = np.array([noise.acceleration(step, 0.0) for step in range(4000)])
    assert np.all(np.abs(values) <= noise.bound())
    # Four standard deviations of a mean, a variance and a correlation of 4000 uniform numbers.
    unit = values[..., :2] / np.array([0.1, 0.2])
    assert np.abs(unit.mean(axis=0)).max() < 4.0 * np.sqrt(1.0 / 3.0 / 4000.0)
    assert np.abs(unit.var(axis=0) - 1.0 / 3.0).max() < 4.0 * np.sqrt(4.0 / 45.0 / 4000.0)
    correlation = np.corrcoef(np.vstack((unit.reshape(4000, -1)[1:].T, unit.reshape(4000, -1)[:-1].T)))
    assert np.abs(correlation - np.eye(8)).max() < 4.0 / np.sqrt(4000.0)


def test_noise_is_held_over_a_step():
    noise = BoundedNoiseSpec(bound=1.0).build(setting())
    assert np.array_equal(noise.acceleration(3, 0.0), noise.acceleration(3, 0.49))


def test_noise_does_not_depend_on_the_order_in_which_steps_are_asked_for():
    forward, backward = (BoundedNoiseSpec(bound=1.0).build(setting()) for _ in range(2))
    steps = [0, 1, 255, 256, 257, 511, 512, 1000]
    ahead = [forward.acceleration(step, 0.0).copy() for step in steps]
    behind = [backward.acceleration(step, 0.0).copy() for step in reversed(steps)]
    assert np.array_equal(ahead, behind[::-1])


def test_noise_of_a_satellite_does_not_depend_on_how_many_others_fly():
    few, many = (BoundedNoiseSpec(bound=1.0).build(setting(count)) for count in (2, 50))
    assert np.array_equal(few.acceleration(300, 0.0), many.acceleration(300, 0.0)[:2])


def test_harmonic_of_a_satellite_has_the_same_bits_however_many_others_fly():
    spec = HarmonicSpec(amplitude=0.01, phase=(0.0, 2.0, 4.0), phase_step=0.7)
    many = spec.build(setting(101)).acceleration(777, 0.3)
    for count in (1, 2, 7, 50):
        assert np.array_equal(spec.build(setting(count)).acceleration(777, 0.3), many[:count])


def test_two_noises_of_one_scenario_and_two_seeds_differ():
    spec = BoundedNoiseSpec(bound=1.0)
    first = spec.build(setting()).acceleration(0, 0.0)
    assert not np.any(first == spec.build(setting(index=1)).acceleration(0, 0.0))
    assert not np.any(first == spec.build(setting(seed=6)).acceleration(0, 0.0))


def test_a_negative_bound_is_refused():
    with pytest.raises(ValidationError, match="greater than or equal to 0"):
        BoundedNoiseSpec(bound=-1.0)
