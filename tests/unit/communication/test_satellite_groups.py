# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Groups of satellites cut few edges, and each sends another one exactly what is needed there."""

import networkx
import numpy as np
import pytest

from satform.communication.satellite_groups import SatelliteGroups, divide
from satform.consensus.graph import Graph, RingSpec
from satform.consensus.random_graphs import RandomRegularSpec


def mesh_in_random_order(width: int) -> Graph:
    """A square grid whose points are numbered at random."""
    adjacency = networkx.to_numpy_array(networkx.grid_2d_graph(width, width))
    order = np.random.default_rng(3).permutation(width * width)
    return Graph(adjacency[order][:, order])


def cut(groups: SatelliteGroups) -> int:
    """Undirected edges between groups, counted by networkx."""
    graph = networkx.from_numpy_array(groups.graph.adjacency)
    total = sum(networkx.cut_size(graph, members) for members in groups.members)
    return int(total) // 2


@pytest.mark.parametrize(("count", "size"), [(12, 4), (1000, 250), (10, 4)])
def test_a_ring_is_cut_once_for_each_group(count: int, size: int) -> None:
    groups = divide(RingSpec().build(count), size)
    assert cut(groups) == len(groups.members)
    assert max(map(len, groups.members)) <= size
    assert max(map(len, groups.members)) - min(map(len, groups.members)) <= 1


def test_a_mesh_in_random_order_is_cut_along_about_one_side_for_each_pair() -> None:
    width = 16
    groups = divide(mesh_in_random_order(width), width * width // 4)
    # Pieces of the random order cut three of four of the 480 edges; straight lines cut 3 * 16.
    assert cut(groups) <= 2 * 3 * width


def test_halos_hold_the_satellites_with_out_neighbours_in_another_group_and_no_others() -> None:
    graph = RandomRegularSpec(degree=4, seed=7).build(30)
    groups = divide(graph, 8)
    group_of = {satellite: index for index, own in enumerate(groups.members) for satellite in own}
    expected: dict[tuple[int, int], set[int]] = {}
    for sender, receiver in networkx.from_numpy_array(graph.adjacency.T, create_using=networkx.DiGraph).edges:
        if group_of[sender] != group_of[receiver]:
            expected.setdefault((group_of[sender], group_of[receiver]), set()).add(sender)
    assert {pair: set(halo) for pair, halo in groups.halos.items()} == expected
    assert all(list(halo) == sorted(halo) for halo in groups.halos.values())
    for index in range(len(groups.members)):
        assert {(sender, index) for sender in groups.senders_to(index)} == {
            pair for pair in expected if pair[1] == index
        }


def test_groups_survive_their_text() -> None:
    groups = divide(RingSpec().build(7), 3)
    assert SatelliteGroups.of_text(groups.to_text(), groups.graph).members == groups.members


@pytest.mark.parametrize("text", ["", "[[0, 1]]", "[[0, 1], [1, 2]]", "[[0, 1], [3]]", "{}", '[["a"]]'])
def test_a_text_that_does_not_divide_the_satellites_is_rejected(text: str) -> None:
    with pytest.raises(ValueError, match="group"):
        SatelliteGroups.of_text(text, RingSpec().build(3))
