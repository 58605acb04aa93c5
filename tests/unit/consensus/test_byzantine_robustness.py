# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Robustness of graphs against the definitions, by enumeration with networkx, and the paper's facts."""

import itertools
import math

import networkx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from satform.consensus.byzantine_robustness import (
    MAXIMUM_SATELLITES,
    agreement_guarantee,
    lower_bound,
    robustness,
)
from satform.consensus.graph import (
    CompleteSpec,
    Graph,
    LineSpec,
    MatrixSpec,
    NoneSpec,
    RingSpec,
    StarSpec,
)


def attached(count, links, generator):
    """Each newcomer hears and is heard by `links` of those who are there, beginning with a complete graph."""
    graph = networkx.complete_graph(2 * links - 1)
    for newcomer in range(2 * links - 1, count):
        chosen = generator.choice(newcomer, links, replace=False)
        graph.add_edges_from((newcomer, int(other)) for other in chosen)
    return Graph(networkx.to_numpy_array(graph))


def by_definition(graph):
    """The largest r, and the largest s of each r, by looking at every pair of disjoint sets of nodes."""
    network = networkx.from_numpy_array(graph.adjacency.T, create_using=networkx.DiGraph)
    count = len(network)
    r, largest = 0, dict.fromkeys(range(1, count + 1), count)
    reachable = {}
    for size in range(1, count):
        for members in itertools.combinations(range(count), size):
            inside = set(members)
            reachable[members] = [len(set(network.predecessors(node)) - inside) for node in members]
    smallest = count
    for one, other in itertools.combinations(reachable, 2):
        if set(one) & set(other):
            continue
        outside = reachable[one], reachable[other]
        smallest = min(smallest, max(*outside[0], *outside[1]))
        for value, before in largest.items():
            reached = [sum(number >= value for number in numbers) for numbers in outside]
            if reached[0] < len(one) and reached[1] < len(other):
                largest[value] = min(before, sum(reached))
    r = smallest
    return r, tuple(largest[value] for value in range(1, r + 1))


def random_graph(count, density, directed, seed):
    generator = np.random.default_rng(seed)
    adjacency = (generator.random((count, count)) < density).astype(float)
    np.fill_diagonal(adjacency, 0.0)
    return Graph(adjacency if directed else np.maximum(adjacency, adjacency.T))


@pytest.mark.parametrize("count", range(2, 13))
def test_a_complete_graph_is_robust_to_half_its_size_rounded_up(count):
    found = robustness(CompleteSpec().build(count))
    assert found.r == math.ceil(count / 2)
    if count % 2 == 0:
        assert found.s[-1] == count


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.integers(2, 6), st.floats(0.1, 0.95), st.booleans(), st.integers(0, 2**32))
def test_robustness_is_that_of_the_definition_looked_up_pair_by_pair(count, density, directed, seed):
    graph = random_graph(count, density, directed, seed)
    found = robustness(graph)
    assert (found.r, found.s) == by_definition(graph)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(3, 10), st.floats(0.1, 0.95), st.booleans(), st.integers(0, 2**32))
def test_every_graph_obeys_the_general_facts_of_robustness(count, density, directed, seed):
    graph = random_graph(count, density, directed, seed)
    found = robustness(graph)
    assert lower_bound(graph) <= found.r <= math.ceil(count / 2)
    assert (found.r >= 1) == graph.connected()
    assert list(found.s) == sorted(found.s, reverse=True)
    assert all(1 <= s <= count for s in found.s)
    if found.r >= 2:
        assert found.r <= int(graph.adjacency.sum(axis=1).min())
    # (2F + 1)-robust graphs are (F + 1, F + 1)-robust.
    assert found.local_byzantine <= found.total_byzantine or found.r == 0


@pytest.mark.parametrize(("links", "count"), [(2, 9), (3, 10), (4, 11)])
def test_preferential_attachment_keeps_the_robustness_of_the_graph_it_begins_with(links, count):
    generator = np.random.default_rng(links)
    for _ in range(3):
        assert robustness(attached(count, links, generator)).r == links


@pytest.mark.parametrize("size", [2, 3, 4, 5])
def test_two_crowds_joined_one_to_one_are_well_connected_and_yet_only_1_robust(size):
    crowds = np.kron(np.eye(2), np.ones((size, size)) - np.eye(size))
    graph = Graph(crowds + np.kron([[0.0, 1.0], [1.0, 0.0]], np.eye(size)))
    assert networkx.node_connectivity(networkx.from_numpy_array(graph.adjacency)) == size
    assert robustness(graph).r == 1


@pytest.mark.parametrize(
    ("graph", "r"),
    [
        (NoneSpec().build(4), 0),
        (NoneSpec().build(1), 1),
        (LineSpec().build(6), 1),
        (StarSpec().build(6), 1),
        (RingSpec().build(3), 2),
        (RingSpec().build(6), 1),
        (MatrixSpec(rows=((0, 0, 0), (1, 0, 0), (0, 1, 0))).build(3), 1),
        (MatrixSpec(rows=((0, 0, 0), (0, 0, 0), (1, 1, 0))).build(3), 0),
    ],
)
def test_sparse_graphs_have_the_robustness_worked_out_by_hand(graph, r):
    assert robustness(graph).r == r


def test_a_wheel_is_2_robust_and_bears_a_liar_where_it_is_2_2_robust():
    wheel = Graph(networkx.to_numpy_array(networkx.wheel_graph(5)))
    found = robustness(wheel)
    assert (found.r, found.s) == by_definition(wheel)
    assert found.r == 2
    assert found.total_byzantine == (1 if found.s[1] >= 2 else 0)


def test_all_hearing_all_bears_every_second_but_one_as_liars_in_the_whole_formation():
    # Theorem 2 of the paper and the bound of a third for Byzantine agreement do not contradict each other:
    # here each liar tells everybody the same.
    for count in range(2, 12):
        assert robustness(CompleteSpec().build(count)).total_byzantine == math.ceil(count / 2) - 1


def test_the_lower_bound_is_exact_where_everybody_hears_everybody():
    for count in (2, 5, 16, 40, 101):
        assert lower_bound(CompleteSpec().build(count)) == math.ceil(count / 2)


def test_a_graph_too_large_to_look_through_is_refused_with_the_reason_and_a_lower_bound():
    with pytest.raises(ValueError, match=r"21 satellites form 2\.1e\+06 sets.*at least 11-robust"):
        robustness(CompleteSpec().build(MAXIMUM_SATELLITES + 1))


@pytest.mark.parametrize(
    ("graph", "liars", "local", "total"),
    [
        (CompleteSpec().build(5), 1, True, True),
        (CompleteSpec().build(4), 1, False, True),
        (CompleteSpec().build(5), 3, False, False),
        (RingSpec().build(6), 0, True, True),
        (RingSpec().build(6), 1, False, False),
        (NoneSpec().build(3), 0, False, False),
        (CompleteSpec().build(40), 9, True, True),
        (CompleteSpec().build(40), 10, None, None),
    ],
)
def test_a_promise_says_which_liars_the_graph_bears(graph, liars, local, total):
    found = agreement_guarantee(graph, liars)
    assert (found.local, found.total) == (local, total)
    assert found.exact == (len(graph) <= MAXIMUM_SATELLITES)
    assert found.sentence


def test_a_negative_number_of_liars_is_refused():
    with pytest.raises(ValueError, match="cannot be negative"):
        agreement_guarantee(RingSpec().build(3), -1)
