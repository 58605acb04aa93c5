# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of theory with which the shipped campaigns are compared."""

import numpy as np
import pytest

from campaigns import CAMPAIGNS
from satform.campaign.cases import case_scenario
from satform.campaign.loader import load_campaign
from satform.evaluation.stability_borders import loop_radius

pytestmark = pytest.mark.unmeasured


@pytest.mark.slow
def test_166_of_the_384_loops_of_the_gain_sweep_are_stable() -> None:
    campaign = load_campaign(CAMPAIGNS / "gain_sweep.yaml")
    radii = np.array([loop_radius(case_scenario(campaign, n), "tracking") for n in range(campaign.cases)])
    assert (int(np.count_nonzero(radii < 1.0)), len(radii)) == (166, 384)
    # So close to one a loop takes longer than the flight: the rate in flight may differ by as much.
    close = int(np.count_nonzero(abs(radii - 1.0) < 0.01))
    assert close == 4
    (expected,) = campaign.expect
    assert expected.above is not None
    assert expected.below is not None
    assert expected.above <= (166 - close) / 384
    assert expected.below >= (166 + close) / 384
