# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellites that fly by star tracker and gyro have the same bits over DDS as in process."""

from pathlib import Path

import numpy as np
import pytest

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

LOST = "faults=[{kind: satellite_lost, satellite: sat2, at: 9.0, rejoin_at: 20.0}]"
FILTER = (
    "{kind: multiplicative_extended, initial_attitude_error: 0.5 deg, angular_acceleration_density: 1.0e-11}"
)
GYRO = "{kind: gyro, angle_random_walk: 1.0e-5, rate_random_walk: 1.0e-8, turn_on_bias: 0.003 deg/s"
LATE = f"{GYRO}, latency: 2.0, outages: [{{begin: 12.0, end: 18.0}}]}}"
FLIGHTS = {
    "undisturbed": [],
    "lost and rejoined": [LOST, "checkpoint_period=4.0"],
    "gyro late and out, lost and rejoined": [
        LOST,
        "checkpoint_period=4.0",
        f"satellites.sat2.sensors.0={LATE}",
        f"satellites.sat2.attitude.filter={FILTER}",
    ],
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_estimated_attitudes_over_dds_have_the_bits_of_the_in_process_run(name: str, tmp_path: Path) -> None:
    scenario = shortened("star_tracker_gyro_pointing", 30.0, *FLIGHTS[name])
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    record = simulate(scenario)
    assert record.differences(bag.record) == []
    flies = ~record.absent
    assert np.isfinite(bag.record.estimated_mrp[flies]).all()
    assert (record.attitude_estimation_error[24:] < 1e-3).all()
