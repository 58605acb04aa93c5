# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Topologies against closed-form spectra and networkx."""

import networkx
import numpy as np
import pytest
from pydantic import ValidationError

from satform.consensus.graph import (
    CompleteSpec,
    Graph,
    LineSpec,
    MatrixSpec,
    NoneSpec,
    RingSpec,
    StarSpec,
)
from satform.consensus.random_graphs import RandomRegularSpec

SIZES = [1, 2, 3, 6, 25]


@pytest.mark.parametrize("count", SIZES)
def test_complete_graph_has_eigenvalues_zero_and_the_count(count):
    expected = [0.0] + [float(count)] * (count - 1)
    assert CompleteSpec().build(count).eigenvalues == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("count", [3, 4, 6, 25])
def test_ring_has_the_spectrum_of_a_circulant(count):
    expected = np.sort(2.0 - 2.0 * np.cos(2.0 * np.pi * np.arange(count) / count))
    assert RingSpec().build(count).eigenvalues == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("count", SIZES)
def test_line_has_the_spectrum_of_a_path(count):
    expected = 2.0 - 2.0 * np.cos(np.pi * np.arange(count) / count)
    assert LineSpec().build(count).eigenvalues == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("centre", [0, 2, 5])
def test_star_has_eigenvalues_zero_ones_and_the_count(centre):
    assert StarSpec(centre=centre).build(6).eigenvalues == pytest.approx([0, 1, 1, 1, 1, 6], abs=1e-12)


def test_three_satellites_in_a_line_or_star_have_eigenvalues_zero_one_three():
    for topology in (LineSpec(), StarSpec(), StarSpec(centre=1)):
        assert topology.build(3).eigenvalues == pytest.approx([0.0, 1.0, 3.0], abs=1e-14)


def test_six_satellites_in_a_line_have_the_known_algebraic_connectivity():
    assert LineSpec().build(6).algebraic_connectivity == pytest.approx(0.267949, abs=5e-7)


def test_two_satellites_in_a_ring_hear_each_other_once():
    assert np.array_equal(RingSpec().build(2).adjacency, [[0.0, 1.0], [1.0, 0.0]])


def test_nobody_hears_anybody_without_a_graph():
    graph = NoneSpec().build(4)
    assert graph.edges == ()
    assert not graph.connected()
    assert graph.algebraic_connectivity == 0.0


def test_a_lone_satellite_is_connected():
    assert NoneSpec().build(1).connected()


def test_rows_say_whom_a_satellite_hears_and_columns_who_hears_it():
    graph = MatrixSpec(rows=((0, 1, 1), (0, 0, 1), (0, 0, 0))).build(3)
    assert graph.neighbours(0) == (1, 2)
    assert graph.neighbours(2) == ()
    assert graph.receivers(2) == (0, 1)
    assert graph.edges == ((1, 0), (2, 0), (2, 1))
    assert graph.directed


def test_a_chain_of_followers_agrees_with_its_leader():
    graph = MatrixSpec(rows=((0, 0, 0), (1, 0, 0), (0, 1, 0))).build(3)
    assert graph.connected()
    assert graph.algebraic_connectivity == pytest.approx(1.0)


def test_two_leaders_cannot_be_brought_to_agree():
    graph = MatrixSpec(rows=((0, 0, 0), (0, 0, 0), (1, 1, 0))).build(3)
    assert not graph.connected()
    assert graph.algebraic_connectivity == 0.0


def test_a_directed_cycle_has_the_complex_spectrum_of_its_shift():
    graph = MatrixSpec(rows=((0, 1, 0), (0, 0, 1), (1, 0, 0))).build(3)
    expected = [0.0, 1.5 - 1j * np.sqrt(0.75), 1.5 + 1j * np.sqrt(0.75)]
    assert graph.eigenvalues == pytest.approx(expected, abs=1e-12)


def test_a_line_falls_apart_without_its_middle():
    line = LineSpec().build(5)
    alive = np.array([True, True, False, True, True])
    assert not line.subgraph(alive).connected()
    assert line.subgraph([1, 2, 3]).edges == ((1, 0), (0, 1), (2, 1), (1, 2))


@pytest.mark.parametrize("seed", range(40))
def test_random_directed_graphs_are_judged_as_networkx_judges_them(seed):
    generator = np.random.default_rng(seed)
    adjacency = (generator.random((7, 7)) < generator.uniform(0.05, 0.35)).astype(float)
    np.fill_diagonal(adjacency, 0.0)
    graph = Graph(adjacency)
    other = networkx.DiGraph()
    other.add_nodes_from(range(7))
    other.add_edges_from(graph.edges)
    reaches_all = any(len(networkx.descendants(other, node)) == 6 for node in other)
    assert graph.connected() == reaches_all
    assert (graph.algebraic_connectivity > 1e-9) == reaches_all


def test_laplacian_rows_sum_to_zero():
    assert np.all(StarSpec().build(9).laplacian().sum(axis=1) == 0.0)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: MatrixSpec(rows=((0, 1), (1, 0, 0))), "row 1 has 3 entries, but there are 2 rows"),
        (lambda: MatrixSpec(rows=((1, 1), (1, 0))), "row 0 has a 1 in column 0"),
        (lambda: MatrixSpec(rows=((0, 2), (1, 0))), "Input should be 0 or 1"),
        (lambda: MatrixSpec(rows=((0, 1), (1, 0))).build(3), "it has 2 rows, but there are 3 satellites"),
        (lambda: StarSpec(centre=3).build(3), "centre is 3, but the 3 satellites are numbered 0 to 2"),
    ],
)
def test_an_impossible_graph_is_refused_with_the_reason(build, words):
    with pytest.raises((ValueError, ValidationError), match=words):
        build()


def test_a_thousand_satellites_are_judged_quickly():
    graph = RingSpec().build(1000)
    assert graph.connected()
    assert graph.neighbours(999) == (0, 998)


@pytest.mark.parametrize(
    ("count", "degree"),
    [
        (2, 1),
        (3, 2),
        (9, 2),
        (8, 3),
        (7, 4),
        (8, 5),
        (9, 6),
        (10, 8),
        (10, 9),
        (40, 11),
        (101, 50),
        (201, 100),
        (500, 2),
    ],
)
def test_a_random_regular_graph_is_regular_undirected_and_connected_as_networkx_judges_it(count, degree):
    for seed in range(5):
        graph = RandomRegularSpec(degree=degree, seed=seed).build(count)
        network = networkx.from_numpy_array(graph.adjacency)
        assert not graph.directed
        assert networkx.number_of_selfloops(network) == 0
        assert networkx.is_k_regular(network, degree)
        assert networkx.is_connected(network)


def test_a_thousand_satellites_in_a_random_regular_graph_hear_ten_each_and_are_well_connected():
    network = networkx.from_numpy_array(RandomRegularSpec(degree=10).build(1000).adjacency)
    assert networkx.is_k_regular(network, 10)
    # A ring of as many has a diameter of 100; chance makes the way short.
    assert networkx.diameter(network) <= 6


def test_a_seed_chooses_the_random_graph():
    graphs = [RandomRegularSpec(degree=3, seed=seed).build(30).adjacency for seed in (0, 0, 1)]
    assert np.array_equal(graphs[0], graphs[1])
    assert not np.array_equal(graphs[0], graphs[2])


def test_every_pair_is_as_likely_to_be_linked_as_any_other():
    total = sum(RandomRegularSpec(degree=3, seed=seed).build(8).adjacency for seed in range(700))
    share = total[np.triu_indices(8, 1)] / 700
    # Binomial with probability 3/7: four and a half standard deviations.
    assert share == pytest.approx(np.full(28, 3 / 7), abs=0.085)


def test_a_random_regular_graph_stays_the_same_from_release_to_release():
    assert RandomRegularSpec(degree=3, seed=1).build(8).edges[:6] == (
        (2, 0),
        (3, 0),
        (5, 0),
        (5, 1),
        (6, 1),
        (7, 1),
    )


@pytest.mark.parametrize(
    ("count", "degree", "words"),
    [
        (4, 4, "degree is 4, but each of 4 satellites has only 3 others"),
        (5, 3, "5 satellites with 3 neighbours each make half a link too many"),
        (6, 1, "6 satellites with one neighbour each are pairs that nobody connects"),
    ],
)
def test_a_random_regular_graph_that_does_not_exist_is_refused_with_the_reason(count, degree, words):
    with pytest.raises(ValueError, match=words):
        RandomRegularSpec(degree=degree).build(count)


def test_a_graph_is_what_its_edges_say() -> None:
    graph = Graph.of_edges(4, [0, 0, 2], [1, 3, 0])
    assert graph.adjacency.tolist() == [[0, 1, 0, 1], [0, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]]
    assert Graph.of_edges(2, [], []).adjacency.tolist() == [[0, 0], [0, 0]]


@pytest.mark.parametrize(
    ("listeners", "speakers", "sentence"),
    [
        ([0, 1], [1], "2 receivers and 1 senders"),
        ([0], [3], "none of the 3 satellites"),
        ([-1], [0], "none of the 3 satellites"),
        ([1], [1], "cannot receive from itself"),
    ],
)
def test_edges_of_no_graph_are_refused(listeners: list[int], speakers: list[int], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        Graph.of_edges(3, listeners, speakers)
