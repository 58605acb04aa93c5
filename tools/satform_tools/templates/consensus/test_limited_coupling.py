# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The coupling of a neighbour is limited, and the scenario flies as it expects."""

from pathlib import Path

import numpy as np
from limited_coupling import LimitedCouplingSpec

from satform import evaluate, load_scenario, simulate
from satform.consensus.arc_length import NeighbourPhases

SCENARIO = Path(__file__).with_name("limited_coupling.yaml")


def test_the_coupling_of_a_far_neighbour_is_limited_and_that_of_a_near_one_is_linear() -> None:
    law = LimitedCouplingSpec(tracking_gain=1.0, coupling_gain=0.1, rate_gain=0.1, limit=2.0).build()
    zero = np.zeros(2)
    neighbours = NeighbourPhases(np.array([-100.0, 5.0]), zero, zero, np.ones(2))
    found = law.couplings(np.array(0.0), np.array(0.0), neighbours, 0.0)
    np.testing.assert_allclose(found, [2.0, -0.5], rtol=1e-15)


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
