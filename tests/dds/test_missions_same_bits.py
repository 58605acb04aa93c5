# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every scenario of a mission, shortened, is the same flight over DDS as in process, bit for bit."""

from pathlib import Path

import pytest

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

MISSIONS = {
    "aperture_model_predictive": 900.0,
    "canx_formations": 1200.0,
    "mms_tetrahedron": 87000.0,
    "netsat_helix": 1800.0,
    "prisma_approach": 1800.0,
    "proba3_coronagraph": 800.0,
    "tandemx_helix": 4800.0,
}
"""Durations in s: over the first burns of one, and some control periods of the others."""


@pytest.mark.parametrize(("name", "duration"), MISSIONS.items())
def test_a_mission_over_dds_has_the_bits_of_the_in_process_run(
    name: str, duration: float, tmp_path: Path
) -> None:
    scenario = shortened(name, duration)
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    assert simulate(scenario).differences(bag.record) == []
