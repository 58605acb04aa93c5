# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A linear formation with a Gaussian start: mean and covariance of the final state by the closed form."""

import numpy as np
import pytest
import scipy.linalg
import scipy.stats

from satform.campaign.chunk import fly_chunk
from satform.campaign.model import Campaign
from satform.scenario import parse_scenario

pytestmark = pytest.mark.unmeasured

RUNS, STEPS, STEP, PERIOD = 1000, 30, 10.0, 6000.0

SCENARIO = f"""
name: gaussian_start
orbit: {{period: {PERIOD}}}
timing: {{step: {STEP}, duration: {STEPS * STEP}}}
dynamics: {{kind: cw}}
graph: {{kind: none}}
consensus: {{kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}}
nominal_motion: {{rate: 0.0}}
satellites:
  - name: sat1
    curve: {{kind: fixed_point, position: [0.0, 0.0, 0.0]}}
    controller: {{kind: feedback_linearisation, natural_frequency: 0.01, damping_ratio: 0.7}}
    position_error: [100.0, -200.0, 50.0]
    velocity_error: [0.1, 0.0, -0.2]
"""

CORRELATION = np.array([[1.0, 0.8], [0.8, 1.0]])
DEVIATIONS = np.array([20.0, 30.0, 10.0, 0.05, 0.02, 0.1])
PATHS = [f"satellites[0].{field}_error[{axis}]" for field in ("position", "velocity") for axis in range(3)]


def study() -> Campaign:
    """Six dispersed components, the first of position and of velocity correlated."""
    return Campaign.model_validate(
        {
            "scenario": parse_scenario(SCENARIO),
            "runs": RUNS,
            "seed": 6,
            "dispersions": [
                {
                    "path": path,
                    "distribution": {"kind": "normal", "standard_deviation": float(deviation)},
                    "applied": "add",
                }
                for path, deviation in zip(PATHS, DEVIATIONS, strict=True)
            ],
            "correlated": [{"of": [PATHS[0], PATHS[3]], "matrix": CORRELATION.tolist()}],
            "keep": {
                "series": [
                    {"quantity": "position", "every": STEPS * STEP},
                    {"quantity": "velocity", "every": STEPS * STEP},
                ]
            },
        }
    )


def closed_loop() -> np.ndarray:
    """Transition of the state over the flight: Clohessy-Wiltshire motion with the command held, by expm."""
    n = 2.0 * np.pi / PERIOD
    system, command = np.zeros((6, 6)), np.vstack((np.zeros((3, 3)), np.eye(3)))
    system[:3, 3:] = np.eye(3)
    system[3, 0], system[3, 4], system[4, 3], system[5, 2] = 3.0 * n * n, 2.0 * n, -2.0 * n, -n * n
    whole = scipy.linalg.expm(STEP * np.block([[system, command], [np.zeros((3, 9))]]))
    # The law takes the natural acceleration away and adds a spring and a damper.
    gain = system[3:] + np.hstack((0.01**2 * np.eye(3), 2.0 * 0.7 * 0.01 * np.eye(3)))
    return np.linalg.matrix_power(whole[:6, :6] - whole[:6, 6:] @ gain, STEPS)


def test_a_gaussian_start_ends_with_the_mean_and_covariance_of_the_closed_form() -> None:
    found = fly_chunk(study(), range(RUNS))
    assert [result.reason for result in found if not result.success] == []
    final = np.array(
        [
            np.concatenate((result.series["position"][-1, 0], result.series["velocity"][-1, 0]))
            for result in found
        ]
    )
    transition = closed_loop()
    start = np.array([100.0, -200.0, 50.0, 0.1, 0.0, -0.2])
    covariance = np.diag(DEVIATIONS**2)
    covariance[0, 3] = covariance[3, 0] = CORRELATION[0, 1] * DEVIATIONS[0] * DEVIATIONS[3]
    mean, covariance = transition @ start, transition @ covariance @ transition.T
    # Whitened, the final states are standard normal: mean and covariance have known spreads.
    white = np.linalg.solve(np.linalg.cholesky(covariance), (final - mean).T).T
    assert np.all(np.abs(white.mean(axis=0)) < 4.0 / np.sqrt(RUNS))
    spread = np.abs(np.cov(white.T) - np.eye(6))
    assert np.all(spread < 4.5 * np.sqrt((1.0 + np.eye(6)) / RUNS))
    assert scipy.stats.kstest((white**2).sum(axis=1), scipy.stats.chi2(6).cdf).pvalue > 1e-3
