# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every scenario in which something goes wrong is the same flight over DDS as in process, bit for bit."""

from pathlib import Path

import pytest

from flights import SCENARIOS, shipped, shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.scenario import load_scenario
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

FLOWN: dict[str, tuple[float, tuple[str, ...]]] = {
    "lossy_links": (300.0, ()),
    "switching_graph": (
        100.0,
        tuple(f"graph_schedule.{index}.at={30.0 * (index + 1)}" for index in range(2)),
    ),
    "partition": (100.0, ("graph_schedule.0.at=30.0", "graph_schedule.1.at=60.0")),
    "satellite_lost_and_rejoined": (
        60.0,
        (
            "checkpoint_period=10.0",
            "faults=[{kind: satellite_lost, satellite: sat2, at: 25.0, rejoin_at: 40.0}]",
        ),
    ),
    "byzantine": (100.0, ("faults=[{kind: byzantine, satellite: sat6, at: 30.0, drift: 2.0}]",)),
    "byzantine_unprotected": (100.0, ("faults=[{kind: byzantine, satellite: sat6, at: 30.0, drift: 2.0}]",)),
    "realtime_triangle": (60.0, ()),
    "radio_links_spread": (1600.0, ()),
}
"""How long each is flown, s, and its faults and changes of the graph moved into that time."""


def test_every_shipped_scenario_with_something_wrong_in_it_is_here() -> None:
    wrong = {
        file.stem
        for file in SCENARIOS.glob("*.yaml")
        if (scenario := load_scenario(file)).faults or scenario.links or scenario.graph_schedule
    }
    assert wrong <= set(FLOWN)


@pytest.mark.parametrize("name", sorted(FLOWN))
def test_a_lockstep_flight_in_which_something_goes_wrong_has_the_bits_of_the_in_process_run(
    name: str, tmp_path: Path
) -> None:
    duration, changes = FLOWN[name]
    scenario = shortened(name, duration, *changes)
    # Shortened or not, it is to go wrong.
    assert bool(scenario.faults) == bool(shipped(name).faults)
    changes_of_the_graph = [entry.at for entry in scenario.graph_schedule if entry.at < duration]
    assert bool(changes_of_the_graph) == bool(shipped(name).graph_schedule)
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.losses
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    assert simulate(scenario).differences(bag.record) == []
