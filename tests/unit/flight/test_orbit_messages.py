# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Orbit messages are read back by a program that is neither satform nor brahe: beyond."""

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import brahe
import numpy as np
import pytest
from beyond.io import ccsds
from pydantic import TypeAdapter, ValidationError
from sgp4.api import WGS72, Satrec

import satform as sf
from flights import shortened
from satform.flight.orbit_messages import (
    CHIEF,
    CHIEF_BESIDE_A_NAMESAKE,
    Ephemeris,
    MeanElements,
    ephemerides,
    fitted_elements,
    oem_text,
    omm_text,
)
from satform.orbits.earth_orientation import without_file
from satform.scenario.parts import Name

UTC_SCALE: Any = brahe.TimeSystem.UTC
EPOCH = datetime(2024, 3, 5, 6, 7, 8, 250_000, tzinfo=UTC)
ZERO = brahe.Epoch.from_datetime(2024, 3, 5, 6, 7, 8.25, 0.0, UTC_SCALE)


def sgp4_of(elements: MeanElements) -> Satrec:
    """The orbit of mean elements by the package sgp4."""
    satellite = Satrec()
    days = (EPOCH - datetime(1949, 12, 31, tzinfo=UTC)).total_seconds() / 86400.0
    degrees = (elements.argument_of_perigee, elements.inclination, elements.mean_anomaly)
    angles = [math.radians(angle) for angle in degrees]
    rate, node = elements.mean_motion * math.tau / 1440.0, math.radians(elements.right_ascension)
    satellite.sgp4init(WGS72, "i", 1, days, 0.0, 0.0, 0.0, elements.eccentricity, *angles, rate, node)
    return satellite


def ephemeris_of(elements: MeanElements) -> Ephemeris:
    """An orbit by SGP4 over one hour, turned into GCRF by brahe."""
    times, satellite = 60.0 * np.arange(61), sgp4_of(elements)
    states = 1e3 * np.array([np.stack(satellite.sgp4_tsince(time / 60.0)[1:]) for time in times.tolist()])
    with without_file().in_use(ZERO):
        turned = np.array([brahe.rotation_teme_to_gcrf(ZERO + time) for time in times.tolist()])
    seen = np.einsum("kij,knj->kni", turned, states)
    return Ephemeris("sat1", EPOCH, times, seen[:, 0], seen[:, 1])


def test_an_ephemeris_that_another_program_reads_has_the_positions_of_the_flight() -> None:
    record = sf.simulate(shortened("triangle_inertial", 6.0, "timing.step=1.5"))
    found = ephemerides(record)
    assert [own.name for own in found] == [CHIEF, "sat1", "sat2", "sat3"]
    for own in found:
        read = ccsds.loads(oem_text(own, "a comment"))
        assert str(read.frame) == "GCRF"
        assert len(read) == 5
        states = np.array([np.array(state) for state in read])
        # As many digits as are printed: 1 mm and 1 um/s, each rounded.
        assert np.abs(states[:, :3] - own.position).max() <= 0.5e-3 + 1e-8
        assert np.abs(states[:, 3:] - own.velocity).max() <= 0.5e-6 + 1e-11
        dates = [(state.date.datetime.replace(tzinfo=UTC) - own.epoch).total_seconds() for state in read]
        assert dates == own.times.tolist()


def test_states_that_are_not_known_are_left_out_of_an_ephemeris() -> None:
    record = sf.simulate(shortened("triangle_inertial", 4.0))
    position = record.position.copy()
    position[1:3, 1] = np.nan
    position[:, 2] = np.nan
    found = {own.name: own for own in ephemerides(replace(record, position=position))}
    assert list(found) == [CHIEF, "sat1", "sat2"]
    assert found["sat2"].times.tolist() == [0.0, 3.0, 4.0]


def test_a_satellite_called_chief_and_the_chief_have_names_of_their_own() -> None:
    record = sf.simulate(shortened("triangle_inertial", 2.0))
    found = ephemerides(replace(record, satellites=("sat1", CHIEF, "sat3")))
    assert [own.name for own in found] == [CHIEF_BESIDE_A_NAMESAKE, "sat1", CHIEF, "sat3"]
    assert np.array_equal(found[2].position, record.inertial_position[:, 1])
    with pytest.raises(ValidationError):
        TypeAdapter(Name).validate_python(CHIEF_BESIDE_A_NAMESAKE)


def test_without_a_date_there_is_no_ephemeris() -> None:
    with pytest.raises(ValueError, match="no inertial quantities"):
        ephemerides(sf.simulate(shortened("triangle", 1.0)))


@pytest.mark.parametrize(
    "elements",
    [
        MeanElements(15.2, 0.0012, 97.6, 41.0, 120.0, 230.0, 0.0),
        MeanElements(14.9, 2e-6, 51.6, 300.0, 10.0, 20.0, 0.0),
        MeanElements(1.0027, 2e-4, 0.05, 200.0, 300.0, 100.0, 0.0),
        MeanElements(2.0, 0.7, 63.4, 10.0, 270.0, 5.0, 0.0),
    ],
)
def test_mean_elements_of_an_orbit_of_sgp4_are_found_again_and_read_by_others(elements: MeanElements) -> None:
    ephemeris = ephemeris_of(elements)
    found = fitted_elements(ephemeris)
    # Micrometres of rounding in 40 000 km, and eccentricity and node that the fit finds again.
    assert found.residual < 1e-3
    read = ccsds.loads(omm_text(ephemeris, found)).copy(form="tle")
    inclination, node, eccentricity, perigee, anomaly, rate = (float(value) for value in np.array(read))
    assert inclination == pytest.approx(math.radians(found.inclination), abs=1e-14)
    assert node == pytest.approx(math.radians(found.right_ascension), abs=1e-13)
    assert eccentricity == pytest.approx(found.eccentricity, abs=1e-15)
    assert perigee == pytest.approx(math.radians(found.argument_of_perigee), abs=1e-13)
    assert anomaly == pytest.approx(math.radians(found.mean_anomaly), abs=1e-13)
    assert rate == pytest.approx(found.mean_motion * math.tau / 86400.0, rel=1e-14)
    assert str(read.frame) == "TEME"
    assert read.date.datetime.replace(tzinfo=UTC) == EPOCH
    assert math.degrees(inclination) == pytest.approx(elements.inclination, abs=1e-7)
    assert rate * 86400.0 / math.tau == pytest.approx(elements.mean_motion, rel=1e-9)
    assert eccentricity == pytest.approx(elements.eccentricity, abs=1e-9)


def test_an_epoch_with_another_time_zone_is_written_in_utc() -> None:
    elements = MeanElements(15.2, 0.0012, 97.6, 41.0, 120.0, 230.0, 0.0)
    ephemeris = replace(ephemeris_of(elements), epoch=EPOCH.astimezone(timezone(timedelta(hours=2))))
    for text in (omm_text(ephemeris, elements), oem_text(ephemeris, "a comment")):
        assert "2024-03-05T06:07:08.25" in text
        assert "2024-03-05T08:07:08.25" not in text


@pytest.mark.parametrize("epoch", ["2026-01-01T02:00:00+02:00", "2026-01-01T00:00:00"])
@pytest.mark.parametrize("scenario", ["triangle_inertial", "triangle"])
def test_the_chief_of_a_flight_has_its_epoch_in_utc(scenario: str, epoch: str) -> None:
    elements = f"semi_major_axis: 7.0e6, inclination: 0.9, argument_of_latitude: 0.1, epoch: {epoch}"
    chief = f"orbit={{chief: {{kind: keplerian, {elements}}}}}"
    change = f"dynamics.epoch={epoch}" if scenario == "triangle_inertial" else chief
    record = sf.simulate(shortened(scenario, 4.0, change))
    assert record.chief is not None
    assert record.chief.epoch == datetime(2026, 1, 1, tzinfo=UTC)
    assert record.chief.epoch.tzinfo is UTC


def test_what_sgp4_does_not_propagate_is_a_sentence() -> None:
    position, velocity = np.array([[7.0e6, 0.0, 0.0]]), np.array([[0.0, 2.0e4, 0.0]])
    with pytest.raises(ValueError, match="sat1: SGP4 does not propagate this orbit"):
        fitted_elements(Ephemeris("sat1", EPOCH, np.zeros(1), position, velocity))
