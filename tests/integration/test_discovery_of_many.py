"""A flight whose processes call at every port, and whose nodes are lean, is the same flight."""

from pathlib import Path

import pytest

from flights import shortened
from satform.simulate import simulate
from satform_bringup import discovery, middleware
from satform_bringup.supervise import fly
from satform_nodes.bag_reader import read_bag


def test_a_flight_as_of_many_processes_has_the_bits_of_the_in_process_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(discovery, "FEW", 1)
    monkeypatch.delenv(discovery.RANGE, raising=False)
    scenario = shortened("triangle", 50.0)
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert "<maxInitialPeersRange>104<" in (tmp_path / middleware.FILE).read_text()
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    assert simulate(scenario).differences(bag.record) == []
