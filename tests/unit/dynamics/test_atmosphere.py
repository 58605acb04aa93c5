# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Densities that drag is computed with: exponent, solar activity, and nothing kept from another flight."""

import math

import brahe
import numpy as np
import pytest
from pydantic import ValidationError

from satform.dynamics.atmosphere import HarrisPriester, Nrlmsise00, atmosphere_of
from satform.dynamics.atmosphere_specs import HarrisPriesterSpec, Nrlmsise00Spec
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.specs import EPOCH
from satform.dynamics.truth_models import InertialDynamicsSpec
from satform.orbits.chief import earth_angle_at
from satform.orbits.earth_orientation import without_file
from satform.orbits.frames import ClosedEarthRotation
from satform.orbits.time_scales import brahe_epoch

LARGEST, LEAST = 3.526e-11, 1.708e-11
"""At 300 km, kg/m^3 (Montenbruck & Gill, table 3.8)."""
DENSITY_OF_400_KM = (2.249e-12, 7.492e-12)
"""The same at 400 km: opposite to the bulge and in it."""


def bulge():
    """Unit vector to the densest place, two hours behind the Sun."""
    sun = np.asarray(brahe.sun_position(brahe_epoch(EPOCH)))
    sun = sun / np.linalg.norm(sun)
    cosine, sine = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    return np.array([cosine * sun[0] - sine * sun[1], sine * sun[0] + cosine * sun[1], sun[2]])


def build(spec):
    rotation = ClosedEarthRotation(earth_angle_at(EPOCH))
    return atmosphere_of(spec, brahe_epoch(EPOCH), np.eye(3), rotation, without_file())


def equatorial(angle, altitude):
    return (6378137.0 + altitude) * np.array([math.cos(angle), math.sin(angle), 0.0])


@pytest.mark.parametrize("exponent", [2.0, 3.5, 6.0])
def test_density_falls_from_the_bulge_with_the_chosen_power_of_the_cosine(exponent):
    atmosphere = build(HarrisPriesterSpec(exponent=exponent))
    for angle in (0.0, 1.0, 2.5, 4.0):
        position = equatorial(angle, 300e3)
        cosine = float(position @ bulge()) / np.linalg.norm(position)
        expected = LEAST + (LARGEST - LEAST) * (0.5 + 0.5 * cosine) ** (0.5 * exponent)
        (found,) = atmosphere.densities(0.0, [position])
        assert found == pytest.approx(expected, rel=1e-4)


def test_the_default_exponent_is_brahes_own_and_the_others_join_it():
    epoch = brahe_epoch(EPOCH)
    places = [equatorial(angle, 420e3) for angle in (0.1, 2.0, 3.9)]
    ours = HarrisPriester(epoch, np.eye(3)).densities(100.0, places)
    theirs = [brahe.density_harris_priester(at, brahe.sun_position(epoch + 100.0)) for at in places]
    assert ours == theirs
    near = HarrisPriester(epoch, np.eye(3), 6.0 - 1e-9).densities(100.0, places)
    np.testing.assert_allclose(near, ours, rtol=1e-6)


def test_density_rises_with_the_suns_activity_and_is_the_tables_at_the_mean():
    position = equatorial(1.0, 400e3)
    quiet, mean, active = (
        build(Nrlmsise00Spec(f107=flux)).densities(0.0, [position])[0] for flux in (70.0, 150.0, 230.0)
    )
    # Over the solar cycle the density at 400 km changes by about an order of magnitude.
    assert 5.0 < active / quiet < 30.0
    least, largest = DENSITY_OF_400_KM
    assert 0.6 * least < mean < 1.6 * largest
    storm = build(Nrlmsise00Spec(ap=100.0)).densities(0.0, [position])[0]
    assert storm > 1.2 * mean


def test_activity_that_somebody_else_has_set_does_not_matter():
    position = equatorial(1.0, 400e3)
    atmosphere = build(Nrlmsise00Spec())
    first = atmosphere.densities(0.0, [position])
    weather = brahe.StaticSpaceWeatherProvider.from_values(9.0, 400.0, 300.0, 300.0, 0)
    brahe.set_global_space_weather_provider(weather)
    brahe.set_global_eop_provider_from_static_provider(
        brahe.StaticEOPProvider.from_values(0.3, 1e-6, 1e-6, 0.0, 0.0, 0.0)
    )
    assert atmosphere.densities(0.0, [position]) == first
    assert isinstance(atmosphere, Nrlmsise00)


def test_a_chosen_atmosphere_slows_a_flight_in_proportion_to_its_density():
    heavy, light = {"mass": 1e9}, {"mass": 10.0}

    def fallen(atmosphere):
        spec = InertialDynamicsSpec.model_validate(
            {"drag": True, "atmosphere": atmosphere, "gravity": {"degree": 0}, "body": heavy}
            | {"satellite_bodies": [light]}
        )
        dynamics = spec.build(DynamicsSetting(math.sqrt(3.986004415e14 / 6.778137e6**3), 10.0, 1))
        state = dynamics.start(np.zeros((1, 3)), np.zeros((1, 3)))
        for step in range(6):
            state = dynamics.advance(state, np.zeros((1, 3)), step)
        return dynamics.lvlh(state)[0][0, 1]

    quiet, active = ({"kind": "nrlmsise00", "f107": flux} for flux in (70.0, 230.0))
    densities = [
        build(Nrlmsise00Spec.model_validate(one)).densities(30.0, [equatorial(0.03, 400e3)])[0]
        for one in (quiet, active)
    ]
    assert fallen(active) / fallen(quiet) == pytest.approx(densities[1] / densities[0], rel=0.05)


def test_an_exponent_beyond_the_models_range_is_refused():
    with pytest.raises(ValidationError, match="less than or equal to 6"):
        HarrisPriesterSpec(exponent=7.0)
