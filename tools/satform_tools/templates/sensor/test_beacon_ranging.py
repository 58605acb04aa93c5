# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The sensor has the derivatives of its readings, and the scenario flies as it expects."""

from pathlib import Path

import numpy as np
from beacon_ranging import BeaconRangingSpec

from satform import evaluate, load_scenario, simulate

SCENARIO = Path(__file__).with_name("beacon_ranging.yaml")


def test_the_derivatives_are_the_finite_differences() -> None:
    (channel,) = BeaconRangingSpec(position=(0.0, 30.0, 0.0)).build(("a",), 0, 1.0)
    assert channel.model is not None
    own = np.random.default_rng(1).normal(size=(10, 6)) * 500.0
    derived, by_other = channel.model.jacobian(own, own)
    for component in range(6):
        shift = 1e-2 * np.eye(6)[component]
        difference = channel.model.predicted(own + shift, own) - channel.model.predicted(own - shift, own)
        np.testing.assert_allclose(derived[..., component], difference / 2e-2, atol=1e-9)
    assert not by_other.any()


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
