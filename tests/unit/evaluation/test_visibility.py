# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Eclipses, contacts and lines of sight, against brahe's own search and closed forms."""

import math
from datetime import UTC, datetime
from typing import Any

import brahe
import numpy as np
import pytest

import satform as sf
from flights import shortened
from satform.dynamics.orbital_forces import FullEarthRotation
from satform.evaluation.visibility import Interval, timeline
from satform.orbits.earth import EQUATORIAL_RADIUS
from satform.orbits.earth_orientation import without_file
from satform.orbits.frames import ClosedEarthRotation, lvlh_frame
from satform.orbits.inertial_motion import ChiefMotion
from satform.orbits.line_of_sight import line_of_sight_distance
from satform.orbits.time_scales import brahe_epoch
from satform.scenario.environment import earth_rotation
from satform.scenario.stations import StationSpec

EPOCH = datetime(2024, 6, 1, 3, 0, 0, tzinfo=UTC)
ZERO = brahe_epoch(EPOCH)
RADIANS: Any = brahe.AngleFormat.RADIANS
STEP = 20.0


def keplerian(*elements: float) -> Any:
    """brahe's propagator of an orbit: a [m], e, i, node, perigee, mean anomaly [rad] at `EPOCH`."""
    return brahe.KeplerianPropagator.from_eci(ZERO, brahe.state_koe_to_eci(np.array(elements), RADIANS), 60.0)


def flown(steps: int, **propagators: Any) -> sf.FlightRecord:
    """A record in which satellites move as brahe propagates them; the first is the chief as well."""
    times = STEP * np.arange(steps + 1)
    epochs = [ZERO + time for time in times.tolist()]
    states = np.array([np.array(own.states_eci(epochs)) for own in propagators.values()])
    frames = lvlh_frame(states[0, :, :3].copy(), states[0, :, 3:].copy())
    parts = (frames.origin_position, frames.origin_velocity, frames.radial, frames.along_track)
    wide = type(frames)(*(part[:, None] for part in (*parts, frames.normal, frames.rate)))
    relative = wide.to_lvlh(*(states.transpose(1, 0, 2)[..., part] for part in (slice(3), slice(3, 6))))
    template = sf.simulate(shortened("triangle_inertial", 1.0))
    count = len(propagators)
    fields = {
        name: np.zeros((steps + (len(values) - 1), count, *values.shape[2:]))
        for name, values in template.quantities().items()
        if len(values)
    }
    empty = {name: values for name, values in template.quantities().items() if not len(values)}
    return sf.FlightRecord(
        tuple(propagators),
        STEP,
        **{**fields, **empty, "position": relative[0], "velocity": relative[1]},
        early_end=None,
        chief_source=lambda rows: ChiefMotion(EPOCH, frames),
    )


def of_kind(found: tuple[Interval, ...], kind: str) -> list[Interval]:
    return [own for own in found if own.kind == kind]


def test_contacts_are_those_of_brahes_own_search() -> None:
    propagator = keplerian(7.0e6, 0.02, 1.7, 0.4, 0.5, 0.6)
    record = flown(1300, sat1=propagator)
    stations = [
        StationSpec(
            name="svalbard", latitude=1.3654, longitude=0.2686, altitude=450.0, elevation_mask=0.0873
        ),
        StationSpec(name="quito", latitude=-0.004, longitude=-1.37, altitude=2800.0),
    ]
    found = of_kind(timeline(record, stations, FullEarthRotation(ZERO)).intervals, "contact")
    degrees = math.degrees
    config = brahe.AccessSearchConfig(initial_time_step=20.0, time_tolerance=1e-4)
    expected = []
    with without_file().in_use(ZERO):
        for own in stations:
            place = brahe.PointLocation(degrees(own.longitude), degrees(own.latitude), own.altitude)
            visible = brahe.ElevationConstraint(min_elevation_deg=degrees(own.elevation_mask))
            windows = brahe.location_accesses(
                place, propagator, ZERO, ZERO + record.steps * STEP, visible, config=config
            )
            expected += [
                (own.name, one.window_open - ZERO, one.window_close - ZERO, one.elevation_max)
                for one in windows
            ]
    expected.sort(key=lambda one: one[1])
    assert len(found) == len(expected) >= 6
    for own, (name, begin, end, highest) in zip(found, expected, strict=True):
        assert own.other == name
        # Both searches end within 0.1 ms; the cubics between states 20 s apart are 10 cm off.
        assert own.begin == pytest.approx(begin, abs=2e-3)
        assert own.end == pytest.approx(end, abs=2e-3)
        # brahe gives the highest of a few moments of its window.
        assert degrees(own.highest_elevation) >= highest - 1e-6


def test_eclipses_are_those_of_brahes_detector() -> None:
    elements = (6.9e6, 0.01, 0.9, 0.4, 0.5, 0.6)
    propagator = keplerian(*elements)
    record = flown(900, sat1=propagator)
    found = of_kind(timeline(record).intervals, "penumbra")
    with without_file().in_use(ZERO):
        numeric = brahe.NumericalOrbitPropagator.from_eci(
            ZERO,
            brahe.state_koe_to_eci(np.array(elements), RADIANS),
            force_config=brahe.ForceModelConfig.two_body(),
        )
        numeric.add_event_detector(brahe.EclipseEvent("in", brahe.EdgeType.RISING_EDGE, None))
        numeric.add_event_detector(brahe.EclipseEvent("out", brahe.EdgeType.FALLING_EDGE, None))
        numeric.propagate_to(ZERO + record.steps * STEP)
        log = [(event.name, event.window_open - ZERO) for event in numeric.event_log()]
    begins = [own.begin for own in found if not own.open_begin]
    ends = [own.end for own in found if not own.open_end]
    assert len(begins) >= 3
    assert begins == pytest.approx([time for name, time in log if name == "in"], abs=0.05)
    assert ends == pytest.approx([time for name, time in log if name == "out"], abs=0.05)


def test_an_eclipse_on_a_circular_orbit_lasts_as_long_as_the_earths_shadow_is_wide() -> None:
    # In the plane of the Sun the umbra ends at a line that touches Sun and Earth: a sin(half + slope) = R.
    sun = np.array(brahe.sun_position(ZERO))
    node = math.atan2(sun[1], sun[0])
    tilt = math.asin(sun[2] / np.linalg.norm(sun))
    axis = 7.0e6
    record = flown(350, sat1=keplerian(axis, 0.0, 0.5 * math.pi, node, 0.0, 0.0))
    umbra = of_kind(timeline(record).intervals, "umbra")
    rate = math.sqrt(3.986004415e14 / axis**3)
    assert len(umbra) == 1
    middle = 0.5 * (umbra[0].begin + umbra[0].end)
    assert rate * middle == pytest.approx(tilt + math.pi, abs=1e-3)
    slope = math.asin((brahe.R_SUN - brahe.R_EARTH) / float(np.linalg.norm(sun)))
    half = math.asin(brahe.R_EARTH / axis) - slope
    # The Sun moves by 0.4 mrad meanwhile.
    assert 0.5 * rate * umbra[0].duration == pytest.approx(half, abs=4e-4)


def test_a_contact_on_a_circular_equatorial_orbit_has_the_closed_form() -> None:
    axis, angle = 8.0e6, 0.3
    record = flown(700, sat1=keplerian(axis, 0.0, 0.0, 0.0, 0.0, 0.0))
    mask = math.radians(10.0)
    station = StationSpec(name="equator", latitude=0.0, longitude=1.0, elevation_mask=mask)
    found = of_kind(timeline(record, [station], ClosedEarthRotation(angle)).intervals, "contact")
    # Seen from the Earth's centre a satellite at elevation e is acos((R / a) cos e) - e from the station.
    half = math.acos(EQUATORIAL_RADIUS / axis * math.cos(mask)) - mask
    rate = math.sqrt(3.986004415e14 / axis**3) - ClosedEarthRotation(0.0).rate
    passes = [(angle + 1.0 + turn * math.tau) / rate for turn in range(2)]
    assert [own.begin for own in found] == pytest.approx([time - half / rate for time in passes], abs=2e-3)
    assert [own.end for own in found] == pytest.approx([time + half / rate for time in passes], abs=2e-3)
    assert [own.highest_at for own in found] == pytest.approx(passes, abs=0.5)
    assert [own.highest_elevation for own in found] == pytest.approx([0.5 * math.pi] * 2, abs=1e-3)


def test_a_line_of_sight_is_blocked_while_the_closed_form_says_so() -> None:
    # On circular orbits of different size the angle between two satellites grows evenly.
    low, high = 7.0e6, 9.0e6
    pair = {"sat1": keplerian(low, 0.0, 0.0, 0.0, 0.0, 0.0), "sat2": keplerian(high, 0.0, 0.0, 0.0, 0.0, 0.0)}
    margin = 100e3
    found = timeline(flown(1000, **pair), line_of_sight_margin=margin)
    least = EQUATORIAL_RADIUS + margin
    horizon = math.acos(least / low) + math.acos(least / high)
    rates = [math.sqrt(3.986004415e14 / axis**3) for axis in (low, high)]
    rate = rates[0] - rates[1]
    blocked = of_kind(found.intervals, "blocked")
    assert len(blocked) == 1
    assert not found.pairs_left_out
    assert blocked[0].other == "sat2"
    assert blocked[0].begin == pytest.approx(horizon / rate, abs=5e-3)
    assert blocked[0].end == pytest.approx((math.tau - horizon) / rate, abs=5e-3)


def test_the_least_distance_of_a_segment_is_at_its_end_where_the_centre_is_beyond_it() -> None:
    first, second = (
        np.array([[1.0, 1.0, 0.0], [3.0, 4.0, 0.0]]),
        np.array([[-1.0, 1.0, 0.0], [6.0, 8.0, 0.0]]),
    )
    assert line_of_sight_distance(first, second) == pytest.approx([1.0, 5.0], rel=1e-15)
    assert line_of_sight_distance(first[1:], first[1:]) == pytest.approx([5.0], rel=1e-15)


def test_stations_need_a_date_and_names_of_their_own() -> None:
    stations = "[{name: a, latitude: 10 deg, longitude: 20 deg}, {name: a, latitude: 0.0, longitude: 0.0}]"
    with pytest.raises(sf.ScenarioError, match="another station is called a too"):
        shortened("triangle_inertial", 1.0, f"stations={stations}")
    with pytest.raises(sf.ScenarioError, match=r"ground stations need a truth model with a date.*found cw"):
        shortened("triangle", 1.0, "stations=[{name: a, latitude: 10 deg, longitude: 20 deg}]")


def test_stations_do_not_change_what_is_flown() -> None:
    station = "stations=[{name: a, latitude: 10 deg, longitude: 20 deg, elevation_mask: 5 deg}]"
    with_station = shortened("triangle_inertial", 1.0, station)
    assert with_station.digest() == shortened("triangle_inertial", 1.0).digest()
    assert with_station.stations[0].elevation_mask == pytest.approx(math.radians(5.0), rel=1e-15)
    assert isinstance(earth_rotation(with_station.dynamics), ClosedEarthRotation)
