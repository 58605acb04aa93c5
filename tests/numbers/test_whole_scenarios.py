# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every shipped scenario, flown whole in process, meets its expectations."""

import pytest

from flights import SCENARIOS, shipped
from satform.evaluation.evaluate import judge
from satform.flight.simulate import simulate

pytestmark = pytest.mark.unmeasured

# The longest first, so that none of them is flown alone when everything else is done.
NAMES = sorted(
    (path.stem for path in SCENARIOS.glob("*.yaml")), key=lambda name: (-shipped(name).timing.steps, name)
)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_scenario_gives_what_it_promises(name: str) -> None:
    scenario = shipped(name)
    verdicts = judge(scenario.expect, simulate(scenario), setting=scenario.setting)
    assert verdicts
    assert not [verdict for verdict in verdicts if not verdict.met]
