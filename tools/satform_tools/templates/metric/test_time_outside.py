# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The figure is the time for which a satellite is outside, and the scenario flies as it expects."""

from pathlib import Path

from time_outside import TimeOutside

from satform import evaluate, load_scenario, simulate

SCENARIO = Path(__file__).with_name("time_outside.yaml")


def test_the_figure_is_the_number_of_steps_outside_times_the_step() -> None:
    scenario = load_scenario(SCENARIO)
    record = simulate(scenario)
    outside = (record.tracking_error > 9.0).sum(axis=0).max()
    assert TimeOutside(level=9.0).measure(record) == record.step * outside > 0.0


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
