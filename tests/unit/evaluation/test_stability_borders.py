# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The value of a field at which a sampled loop is no longer stable, against closed forms."""

import math

import pytest

from flights import shipped
from satform.evaluation.stability_borders import crossing, loop_radius, stability_border


@pytest.mark.parametrize(("layer", "step"), [(0.5, 2.0), (1.0, 1.0), (0.2, 2.0)])
def test_the_border_of_the_reaching_gain_is_that_of_the_closed_form(layer: float, step: float) -> None:
    scenario = shipped("triangle").with_(
        {"timing.step": step, "satellites[*].controller.boundary_layer": layer}
    )
    path = "satellites[*].controller.reaching_gain"
    border = stability_border(scenario, path, 0.01, 3.0, "tracking")
    # Equation (12) of docs/controllers/sliding_mode.md, which leaves out the slope of the surface, 0.01 1/s.
    assert border == pytest.approx(2.0 / step - 0.1 / layer, abs=0.02)
    assert loop_radius(scenario.with_({path: border - 1e-4}), "tracking") < 1.0
    assert loop_radius(scenario.with_({path: border + 1e-4}), "tracking") > 1.0


def test_the_border_of_the_rate_gain_is_where_a_root_passes_minus_one() -> None:
    scenario = shipped("triangle").with_({"timing.step": 10.0, "consensus.tracking_gain": 1.0e-3})
    border = stability_border(scenario, "consensus.rate_gain", 1.0e-3, 1.0, "consensus")
    # det(M + I) = 4 - 2 h (k1 + k3 mu) = 0 for the largest eigenvalue of three satellites, 3: equation (14).
    assert border == pytest.approx((2.0 / 10.0 - 1.0e-3) / 3.0, rel=1e-6)


def test_without_a_change_of_stability_there_is_no_border() -> None:
    path = "satellites[*].controller.reaching_gain"
    assert stability_border(shipped("triangle"), path, 0.01, 0.02, "tracking") is None
    assert crossing(lambda value: 2.0, 0.0, 1.0) is None
    assert crossing(lambda value: 2.0 - value, 0.0, 4.0) == pytest.approx(1.0)


def test_a_formation_without_an_analysed_loop_has_no_radius() -> None:
    assert math.isnan(loop_radius(shipped("triangle"), "attitude"))
