# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every shipped scenario whose satellites fly by navigation filters is the same over DDS as in process."""

from pathlib import Path

import pytest

from flights import SCENARIOS, shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.scenario import Scenario, load_scenario
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

STEPS = 12


def navigates(scenario: Scenario) -> bool:
    return any(scenario.satellite(index).navigation is not None for index in range(len(scenario.satellites)))


PERIODS = {
    file.stem: scenario.timing.step
    for file in sorted(SCENARIOS.glob("*.yaml"))
    if navigates(scenario := load_scenario(file))
}
"""Control period of each, s."""


@pytest.mark.parametrize("name", PERIODS)
def test_a_scenario_with_navigation_has_the_bits_of_the_in_process_run(name: str, tmp_path: Path) -> None:
    scenario = shortened(name, STEPS * PERIODS[name])
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.losses
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    assert bag.record.navigation is not None
    assert simulate(scenario).differences(bag.record) == []
