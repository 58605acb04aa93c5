# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Communication graphs that a service asks for, which the plant takes or rejects with a sentence."""

import pytest

from satform.flight.compile import FormationPlan, compile_scenario
from satform.scenario import parse_scenario
from satform_nodes.plant.services import wanted_graph
from satform_tools.bench.scaling import ring


@pytest.fixture(scope="module")
def plan() -> FormationPlan:
    """Four satellites on a ring."""
    return compile_scenario(parse_scenario(ring(4, 5).to_json()))


def rows(*edges: tuple[int, int]) -> list[int]:
    """Row-major adjacency with edges to the first from the second."""
    found = [0] * 16
    for receiver, sender in edges:
        found[4 * receiver + sender] = 1
    return found


def test_a_graph_has_new_edges_only_between_satellites_that_have_discovered_each_other(
    plan: FormationPlan,
) -> None:
    discovered = plan.membership.possible_graph
    across = rows((0, 1), (0, 2))
    assert wanted_graph(across, plan).edges == ((1, 0), (2, 0))
    assert wanted_graph(rows((0, 1)), plan, discovered=discovered).edges == ((1, 0),)
    with pytest.raises(ValueError, match=r"^s0 has not discovered s2: .*the field graph_schedule$"):
        wanted_graph(across, plan, discovered=discovered)
