"""Satellites that share a process act in one step over arrays, and nobody can tell from the numbers."""

from pathlib import Path

import pytest

from flights import shortened
from satform.scenario import Scenario
from satform.simulate import simulate
from satform_bringup.supervise import fly
from satform_nodes.bag_reader import read_bag


def flown_in_one_process(scenario: Scenario, out: Path) -> list[str]:
    """Quantities of a grouped flight that differ from the in-process run, which here flies each alone."""
    flight = fly(
        scenario, out, record=True, progress=lambda _done, _all: None, group=len(scenario.satellites)
    )
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    return simulate(scenario, together=False).differences(bag.record)


@pytest.mark.parametrize(
    ("name", "steps"),
    [
        ("star_six", 100),  # with different numbers of neighbours
        ("approach_gssap", 20),  # that hear nobody
        ("formation_pointing", 40),  # with attitudes
        ("directed_triangle", 100),  # that tell their motion, under a law with a memory
    ],
)
def test_a_group_flies_with_the_bits_of_single_satellites(name: str, steps: int, tmp_path: Path) -> None:
    scenario = shortened(name, steps * shortened(name, 100.0).timing.step)
    assert flown_in_one_process(scenario, tmp_path) == []


def test_a_group_whose_members_part_in_flight_keeps_its_bits(tmp_path: Path) -> None:
    scenario = shortened(
        "star_six",
        100.0,
        "graph_schedule=[{at: 40.0, remove: [[sat1, sat3], [sat3, sat1]]}]",
    )
    assert flown_in_one_process(scenario, tmp_path) == []
