# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every scenario of the control laws, shortened, is the same flight over DDS as in process, bit for bit."""

from pathlib import Path

import pytest

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

QUICK = {
    "adaptive_tracking": 2.5,
    "approach_gssap": 12.5,
    "compare_controllers": 100.0,
    "formation_pointing": 40.0,
    "geo_in_plane_circle": 200.0,
    "ground_contacts": 400.0,
    "attitude_cape_canaveral": 2.5,
    "directed_triangle": 1.0,
    "eccentric_navigation": 9600.0,
    "eccentric_rigid": 900.0,
    "geo_sphere_lqr": 25.0,
    "integral_action": 50.0,
    "own_truth_model": 200.0,
    "keep_out_transfer": 400.0,
    "mean_elements": 3600.0,
}
"""Flown in every test run, with the duration in s: they have every control law, the models of filters,
and formulas as truth. Laws without events of their own fly about fifty steps: a state that is passed on
wrongly from one step to the next shows in the third."""

MORE = {
    "attitude_limited_wheels": 20.0,
    "directed_triangle_close": 1.0,
    "directed_triangle_crossing": 1.0,
    "directed_triangle_crossing_no_barrier": 1.0,
    "directed_triangle_no_adaptation": 1.0,
    "element_reconfiguration": 2000.0,
    "geo_along_track": 100.0,
    "geo_parallel": 200.0,
    "geo_parallel_lqi": 200.0,
    "geo_parallel_lqi_meant": 200.0,
    "geo_parallel_lqi_response": 5.0,
    "geo_parallel_lqr": 200.0,
    "geo_parallel_lqr_meant": 200.0,
    "geo_sphere": 200.0,
    "geo_sphere_lag": 200.0,
    "patrol_drift": 6000.0,
    "patrol_three": 12000.0,
}


@pytest.mark.parametrize(
    ("name", "duration"),
    [
        *QUICK.items(),
        *(pytest.param(name, duration, marks=pytest.mark.slow) for name, duration in MORE.items()),
    ],
)
def test_a_lockstep_flight_has_the_bits_of_the_in_process_run(
    name: str, duration: float, tmp_path: Path
) -> None:
    scenario = shortened(name, duration)
    # Laws that a flight with a process for each satellite has shown fly in one for all.
    group = 1 if name in QUICK else len(scenario.satellites)
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None, group=group)
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    assert simulate(scenario).differences(bag.record) == []
