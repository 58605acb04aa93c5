# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Groups of satellites that exchange arrays fly with the bits of the in-process flight."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flights import shortened
from flown import processes_of
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_bringup.supervisor.flight import Flight
from satform_bringup.supervisor.run import fly


def flown_in_arrays(
    scenario: Scenario,
    out: Path,
    group: int,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> Flight:
    """A recorded flight of groups that exchange arrays."""
    return fly(scenario, out, record=True, progress=progress, group=group, arrays=True)


def sparse(count: int) -> Scenario:
    """Satellites of `ring_six` on a sparse directed graph that is not in the order of the satellites."""
    receivers = np.random.default_rng(5).permutation(count)
    adjacency = np.zeros((count, count), dtype=int)
    adjacency[receivers, np.roll(receivers, 1)] = 1
    adjacency[receivers, np.roll(receivers, 4)] = 1
    satellites = ", ".join(
        f"{{name: s{index}, arc_length: {1000.0 * (index * 7 % count)}}}" for index in range(count)
    )
    return shortened(
        "ring_six",
        60.0,
        f"graph={{kind: matrix, rows: {adjacency.tolist()}}}",
        f"satellites=[{satellites}]",
        "expect=[]",
    )


@pytest.mark.parametrize(
    ("scenario", "group"),
    [
        # Every group has both other ones as neighbours.
        (shortened("ring_six", 200.0), 2),
        # Groups of different sizes, and satellites with and without in-neighbours in other groups.
        (sparse(11), 4),
    ],
    ids=["ring", "sparse graph"],
)
def test_groups_that_exchange_arrays_have_the_bits_of_the_flight_in_process(
    scenario: Scenario, group: int, tmp_path: Path
) -> None:
    flight = flown_in_arrays(scenario, tmp_path, group)
    assert (flight.reason, flight.missed) == ("", ())
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    assert simulate(scenario).differences(bag.record) == []
    # A message of each group and step in place of one of each satellite.
    groups = -(-len(scenario.satellites) // group)
    steps = scenario.timing.steps
    of_satellites = {name for name in bag.messages if name.split("/")[1] in bag.record.satellites}
    assert not of_satellites
    assert bag.messages["/group0/group_state"] == steps + 1
    assert sum(name.endswith("/group_command") for name in bag.messages) == groups


@pytest.mark.parametrize("limit", ["speed=1000.0", "acceleration=500.0"], ids=["by the plant", "by a group"])
def test_a_flight_of_groups_ends_early_as_in_process(limit: str, tmp_path: Path) -> None:
    scenario = shortened("ring_six", 400.0, "consensus.tracking_gain=2.1", f"limits.{limit}")
    alone = simulate(scenario).early_end
    assert alone is not None
    assert alone.step > 0
    assert flown_in_arrays(scenario, tmp_path, 2).early_end == alone


def test_a_flight_of_groups_ends_when_one_of_them_is_lost(tmp_path: Path) -> None:
    killed: list[int] = []

    def kill(done: int, _all: int) -> None:
        if done >= 100 and not killed:
            killed.append(processes_of(tmp_path)["group1"])
            os.kill(killed[0], signal.SIGKILL)

    flight = flown_in_arrays(shortened("ring_six", 12000.0), tmp_path, 3, kill)
    assert killed
    assert flight.lost == ("group1",)
    assert "group1 was ended by signal 9" in flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert 100 <= bag.record.steps < 12000
    assert not bag.complete
    steps = bag.record.steps
    assert simulate(shortened("ring_six", float(steps))).differences(bag.record) == []
