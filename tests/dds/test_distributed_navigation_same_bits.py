# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios whose satellites exchange estimates are the same flight over DDS as in process, bit for bit."""

from pathlib import Path
from typing import Any

import pytest

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

APART = [["chief", "deputy"], ["deputy", "chief"]]
DISTURBED = {
    "links": {"default": {"loss": 0.3, "delay": 20.0, "jitter": 10.0}},
    "graph_schedule": [{"at": 100.0, "remove": APART}, {"at": 160.0, "add": APART}],
    "faults": [{"kind": "satellite_lost", "satellite": "chief", "at": 250.0}],
    "consensus.neighbour_timeout": 60.0,
}
FLIGHTS: dict[str, tuple[str, float, dict[str, Any]]] = {
    "cameras": ("bearing_only_swarm", 480.0, {}),
    "lossy and late links, another graph, a loss": ("gnss_differential_pair", 300.0, DISTURBED),
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_estimates_over_dds_have_the_bits_of_the_in_process_run(name: str, tmp_path: Path) -> None:
    shipped, duration, changes = FLIGHTS[name]
    scenario = shortened(shipped, duration).with_(changes)
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.losses
    assert flight.bag is not None
    assert simulate(scenario).differences(read_bag(flight.bag).record) == []
