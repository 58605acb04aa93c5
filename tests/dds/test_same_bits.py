# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lockstep over DDS and the in-process run are the same flight, to the last bit."""

import os
from pathlib import Path

import pytest

from flights import shipped, shortened
from satform.bag.reader import Bag, read_bag
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_bringup.supervisor.flight import Flight
from satform_bringup.supervisor.run import fly
from satform_nodes.transport.compiled import PYTHON_TRANSPORT

pytestmark = pytest.mark.unmeasured


def flown(scenario: Scenario, out: Path, environment: dict[str, str] | None = None) -> tuple[Flight, Bag]:
    out.mkdir()
    flight = fly(scenario, out, record=True, progress=lambda _done, _all: None, environment=environment)
    assert not flight.lost, flight.reason
    assert not flight.missed
    assert flight.bag is not None
    return flight, read_bag(flight.bag)


def assert_every_message_is_there(flight: Flight, bag: Bag) -> None:
    steps = bag.scenario.timing.steps
    satellites = [satellite.name for satellite in bag.scenario.satellites]
    expected = {f"/{name}/{kind}": steps + 1 for name in satellites for kind in ("state", "arc_length")}
    expected |= {f"/{name}/{kind}": steps for name in satellites for kind in ("command", "tracking")}
    expected["/clock"] = steps + 1
    assert {topic: bag.messages[topic] for topic in expected} == expected
    assert flight.messages == sum(bag.messages.values())


def assert_same_bits_as_in_process(scenario: Scenario, bag: Bag) -> None:
    assert bag.complete
    assert bag.record.steps == scenario.timing.steps
    assert simulate(scenario).differences(bag.record) == []


@pytest.mark.parametrize("name", ["triangle", "ring_six"])
def test_a_lockstep_flight_is_recorded_whole_with_the_bits_of_the_in_process_run(
    name: str, tmp_path: Path
) -> None:
    # Each step passes the same messages: a thousand show as much as all. SATFORM_SOAK flies the whole.
    whole = shipped(name)
    steps = whole.timing.steps if "SATFORM_SOAK" in os.environ else 1500
    scenario = shortened(name, steps * whole.timing.step)
    flight, bag = flown(scenario, tmp_path / "quiet")
    assert_same_bits_as_in_process(scenario, bag)
    assert_every_message_is_there(flight, bag)


@pytest.mark.parametrize("name", ["triangle", "ring_six"])
@pytest.mark.usefixtures("busy_cores")
def test_other_work_on_every_core_does_not_change_a_bit(name: str, tmp_path: Path) -> None:
    # Load mixes up who is late in every single step: hundreds of them show as much as all would.
    scenario = shortened(name, 600.0 * shipped(name).timing.step)
    _, bag = flown(scenario, tmp_path / "busy")
    assert_same_bits_as_in_process(scenario, bag)


@pytest.mark.parametrize("name", ["triangle", "formation_pointing"])
def test_messages_that_are_taken_in_python_make_the_same_bits(name: str, tmp_path: Path) -> None:
    scenario = shortened(name, 300.0 * shipped(name).timing.step)
    flight, bag = flown(scenario, tmp_path / "python", {PYTHON_TRANSPORT: "1"})
    assert_same_bits_as_in_process(scenario, bag)
    assert_every_message_is_there(flight, bag)
