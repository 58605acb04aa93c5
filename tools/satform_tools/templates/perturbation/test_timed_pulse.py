# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The pulse acts from its beginning to its end, and the scenario flies as it expects."""

from pathlib import Path

from timed_pulse import TimedPulseSpec

from satform import evaluate, load_scenario, simulate
from satform.dynamics.prescribed_disturbances import PerturbationSetting

SCENARIO = Path(__file__).with_name("timed_pulse.yaml")


def test_it_acts_on_every_satellite_from_its_beginning_to_its_end() -> None:
    setting = PerturbationSetting(mean_motion=1e-3, step=2.0, satellite_count=2, seed=0, index=0)
    pulse = TimedPulseSpec(value=(1.0, 0.0, 0.0), begin=4.0, duration=2.0).build(setting)
    assert pulse.acceleration(1, 1.9).tolist() == [[0.0] * 3] * 2
    assert pulse.acceleration(2, 0.0).tolist() == [[1.0, 0.0, 0.0]] * 2
    assert pulse.acceleration(3, 0.0).tolist() == [[0.0] * 3] * 2


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
