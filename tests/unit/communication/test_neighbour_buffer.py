# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a satellite knows of its neighbours: kept until something newer comes, counted until it is too old."""

import numpy as np

from satform.communication.neighbour_buffer import NeighbourBuffer, Received


def told(values: list[float], fresh: list[float], linked: list[float], stamp: float = 0.0) -> Received:
    """Words of three neighbours, each of one number."""
    return Received(
        np.array(values)[:, None], np.full(3, stamp), np.array(fresh), np.array(linked), complete=False
    )


def test_at_first_nobody_is_known() -> None:
    inbox = NeighbourBuffer.empty((3,), 2)
    assert inbox.values.shape == (3, 2)
    assert not inbox.counted(0.0, 60.0).any()


def test_the_last_word_is_held_until_a_newer_one_comes() -> None:
    inbox = NeighbourBuffer.empty((3,), 1).after(told([5.0, 6.0, 7.0], [1, 1, 0], [1, 1, 1], 1.0))
    inbox = inbox.after(told([50.0, 60.0, 70.0], [0, 1, 0], [1, 1, 1], 2.0))
    assert inbox.values[:2, 0].tolist() == [5.0, 60.0]
    assert inbox.stamp[:2].tolist() == [1.0, 2.0]
    assert inbox.known.tolist() == [1.0, 1.0, 0.0]


def test_a_word_counts_up_to_its_bound_and_not_beyond() -> None:
    inbox = NeighbourBuffer.empty((3,), 1).after(told([5.0, 6.0, 7.0], [1, 1, 1], [1, 1, 1], 10.0))
    assert inbox.counted(70.0, 60.0).tolist() == [1.0, 1.0, 1.0]
    assert inbox.counted(70.5, 60.0).tolist() == [0.0, 0.0, 0.0]


def test_a_rounding_does_not_decide_about_a_word_at_its_bound() -> None:
    step = 0.1
    inbox = NeighbourBuffer.empty((3,), 1).after(told([5.0] * 3, [1, 1, 1], [1, 1, 1], 3 * step))
    # As numbers, 6 tenths less 3 tenths are a little more than 3 tenths or a little less.
    assert inbox.counted(6 * step, 0.3).tolist() == [1.0, 1.0, 1.0]
    assert inbox.counted(7 * step, 0.3).tolist() == [0.0, 0.0, 0.0]


def test_a_neighbour_heard_again_counts_again() -> None:
    inbox = NeighbourBuffer.empty((3,), 1).after(told([5.0] * 3, [1, 1, 1], [1, 1, 1], 0.0))
    assert not inbox.counted(100.0, 60.0).any()
    inbox = inbox.after(told([9.0] * 3, [0, 1, 0], [1, 1, 1], 100.0))
    assert inbox.counted(100.0, 60.0).tolist() == [0.0, 1.0, 0.0]


def test_whom_the_graph_no_longer_links_is_forgotten_at_once_and_for_good() -> None:
    inbox = NeighbourBuffer.empty((3,), 1).after(told([5.0, 6.0, 7.0], [1, 1, 1], [1, 1, 1]))
    inbox = inbox.after(told([0.0] * 3, [0, 0, 0], [1, 0, 1]))
    assert inbox.known.tolist() == [1.0, 0.0, 1.0]
    # Linked again, but not heard again yet.
    inbox = inbox.after(told([0.0] * 3, [0, 0, 0], [1, 1, 1]))
    assert inbox.known.tolist() == [1.0, 0.0, 1.0]


def test_post_that_is_complete_gives_the_same_inbox_as_post_taken_in_one_by_one() -> None:
    values, stamp = np.arange(6.0).reshape(3, 2), np.full(3, 4.0)
    linked = np.array([1.0, 1.0, 0.0])
    whole = Received.whole(values, stamp, linked)
    single = Received(values, stamp, linked, linked, complete=False)
    at_once, one_by_one = (NeighbourBuffer.empty((3,), 2).after(post) for post in (whole, single))
    assert np.array_equal(at_once.known, one_by_one.known)
    assert np.array_equal(at_once.values[:2], one_by_one.values[:2])
    assert np.array_equal(at_once.counted(4.0, 60.0), one_by_one.counted(4.0, 60.0))


def test_another_list_of_neighbours_keeps_what_was_known_of_those_in_both() -> None:
    inbox = NeighbourBuffer.empty((3,), 1).after(told([5.0, 6.0, 7.0], [1, 1, 0], [1, 1, 1], 2.0))
    changed = inbox.rearranged([1, None, 0, 2])
    assert changed.values[:, 0].tolist() == [6.0, 0.0, 5.0, 0.0]
    assert changed.stamp.tolist() == [2.0, 0.0, 2.0, 0.0]
    assert changed.known.tolist() == [1.0, 0.0, 1.0, 0.0]
