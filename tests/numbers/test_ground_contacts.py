# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Contacts and eclipses of the shipped scenario with stations, against brahe's own propagation and search."""

import math

import brahe
import numpy as np
import pytest

from flights import shipped
from satform.dynamics.orbital_forces import brahe_epoch
from satform.evaluation.visibility import Interval, timeline
from satform.flight.simulate import simulate
from satform.orbits.earth_orientation import without_file
from satform.scenario.environment import earth_rotation

pytestmark = pytest.mark.unmeasured


def test_the_timeline_of_the_shipped_scenario_is_that_of_brahes_propagator() -> None:
    scenario = shipped("ground_contacts")
    record = simulate(scenario)
    found = timeline(record, scenario.stations, earth_rotation(scenario.dynamics)).intervals
    assert record.chief is not None
    zero, duration = brahe_epoch(record.chief.epoch), scenario.timing.duration
    forces = brahe.ForceModelConfig(gravity=brahe.GravityConfiguration(degree=4, order=4))
    contacts: dict[tuple[str, str], list[Interval]] = {}
    for own in found:
        if own.kind == "contact":
            contacts.setdefault((own.satellite, own.other), []).append(own)
    assert len(contacts) == 6
    with without_file().in_use(zero):
        for column, name in enumerate(record.satellites):
            state = np.concatenate((record.inertial_position[0, column], record.inertial_velocity[0, column]))
            propagator = brahe.NumericalOrbitPropagator.from_eci(zero, state, force_config=forces)
            propagator.add_event_detector(brahe.EclipseEvent("in", brahe.EdgeType.RISING_EDGE, None))
            propagator.add_event_detector(brahe.EclipseEvent("out", brahe.EdgeType.FALLING_EDGE, None))
            propagator.propagate_to(zero + duration)
            events = [(event.name, event.window_open - zero) for event in propagator.event_log()]
            shadows = [own for own in found if own.kind == "penumbra" and own.satellite == name]
            for end, edge in (("begin", "in"), ("end", "out")):
                times = [getattr(own, end) for own in shadows if not getattr(own, f"open_{end}")]
                assert times
                assert times == pytest.approx([time for kind, time in events if kind == edge], abs=0.05)
            for station in scenario.stations:
                windows = brahe.location_accesses(
                    brahe.PointLocation(
                        math.degrees(station.longitude), math.degrees(station.latitude), station.altitude
                    ),
                    propagator,
                    zero,
                    zero + duration,
                    brahe.ElevationConstraint(min_elevation_deg=math.degrees(station.elevation_mask)),
                    config=brahe.AccessSearchConfig(initial_time_step=20.0, time_tolerance=1e-4),
                )
                expected = [(one.window_open - zero, one.window_close - zero) for one in windows]
                pairs = [(own.begin, own.end) for own in contacts[name, station.name]]
                assert len(pairs) == 2
                assert pairs == [pytest.approx(pair, abs=0.01) for pair in expected]
