# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every satellite but the first has one in-neighbour, and the scenario flies as it expects."""

from pathlib import Path

from binary_tree import BinaryTreeSpec

from satform import evaluate, load_scenario, simulate

SCENARIO = Path(__file__).with_name("binary_tree.yaml")


def test_every_satellite_receives_from_its_parent() -> None:
    graph = BinaryTreeSpec().build(6)
    assert [graph.neighbours(index) for index in range(6)] == [(), (0,), (0,), (1,), (1,), (2,)]
    assert graph.connected()


def test_the_scenario_meets_its_expectations() -> None:
    scenario = load_scenario(SCENARIO)
    assert [verdict for verdict in evaluate(scenario, simulate(scenario)) if not verdict.met] == []
