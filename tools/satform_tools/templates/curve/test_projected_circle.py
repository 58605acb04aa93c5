# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The curve is a circle seen from the Earth, and the scenario flies as it expects."""

from pathlib import Path

import numpy as np
from projected_circle import ProjectedCircleSpec

from satform import evaluate, load_scenario, simulate

SCENARIO = Path(__file__).with_name("projected_circle.yaml")


def test_every_point_has_the_radius_along_and_across_the_track() -> None:
    curve = ProjectedCircleSpec(radius=500.0).build()
    position = curve.point(np.linspace(0.0, 6.0, 50)).position
    np.testing.assert_allclose(np.hypot(position[:, 1], position[:, 2]), 500.0, rtol=1e-12)


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
