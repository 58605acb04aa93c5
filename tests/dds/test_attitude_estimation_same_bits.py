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


def test_estimated_attitudes_over_dds_have_the_bits_of_the_in_process_run(tmp_path: Path) -> None:
    scenario = shortened("star_tracker_gyro_pointing", 30.0)
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    record = simulate(scenario)
    assert record.differences(bag.record) == []
    assert np.isfinite(bag.record.estimated_mrp).all()
