# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Links that lose, delay, repeat and reorder: against counts, and against a queue written out by hand."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from satform.communication.channel_model import ChannelModel, LinksSpec
from satform.communication.neighbour_buffer import NeighbourBuffer, Received

STEP = 0.5
NAMES = ("a", "b", "c", "d")


def links(edges: list[tuple[int, int]], seed: int = 3, **default: Any) -> ChannelModel:
    """Links of one receiver, or of several that hear one each, with edges as sender and receiver."""
    spec = LinksSpec.model_validate({"default": default})
    return ChannelModel.of(spec, edges, NAMES, (STEP, seed), (len(edges),))


def said(step: int, count: int = 1) -> Received:
    """Everybody says the number of the step."""
    return Received.whole(np.full((count, 2), float(step)), np.full(count, step * STEP))


def heard(line: ChannelModel, steps: int, count: int = 1) -> np.ndarray:
    """For each step and link the step of the message that arrives, or -1."""
    found = np.full((steps, count), -1)
    for step in range(steps):
        told = line.transmit(step, said(step, count))
        assert not told.complete
        arrived = told.fresh > 0.0
        found[step, arrived] = told.values[arrived, 0]
        assert np.all(told.stamp[arrived] == told.values[arrived, 0] * STEP)
    return found


def known(line: ChannelModel, steps: int, count: int = 1) -> np.ndarray:
    """For each step and link the step of the newest message that is known, or -1."""
    inbox, found = NeighbourBuffer.empty((count,), 2), np.full((steps, count), -1)
    for step in range(steps):
        inbox = inbox.after(line.transmit(step, said(step, count)))
        found[step] = np.where(inbox.known > 0.0, inbox.values[:, 0], -1.0)
    return found


def test_links_that_do_nothing_give_everything_at_once() -> None:
    assert np.array_equal(heard(links([(0, 1)]), 50)[:, 0], np.arange(50))


@pytest.mark.parametrize("loss", [0.05, 0.2, 0.5, 0.95])
def test_losses_are_as_many_as_a_binomial_distribution_has(loss: float) -> None:
    count = int(np.count_nonzero(heard(links([(0, 1)], loss=loss), 4_000) < 0))
    # Once in 10 000 seeds it would be outside.
    assert binom.ppf(5e-5, 4_000, loss) <= count <= binom.ppf(1 - 5e-5, 4_000, loss)


def test_losses_do_not_come_in_bursts() -> None:
    lost = heard(links([(0, 1)], loss=0.5), 4_000)[:, 0] < 0
    # Whether a loss follows a loss is a coin's toss, too.
    twice = int(np.count_nonzero(lost[1:] & lost[:-1]))
    among = int(np.count_nonzero(lost[:-1]))
    assert binom.ppf(5e-5, among, 0.5) <= twice <= binom.ppf(1 - 5e-5, among, 0.5)


@pytest.mark.parametrize(("loss", "count"), [(0.0, 300), (1.0, 0)])
def test_no_loss_loses_nothing_and_certain_loss_loses_all(loss: float, count: int) -> None:
    assert np.count_nonzero(heard(links([(0, 1)], loss=loss), 300) >= 0) == count


@pytest.mark.parametrize(
    ("delay", "steps"),
    [(0.0, 0), (0.5, 1), (0.6, 2), (1.0, 2), (0.1 * 15, 3), (1.5 + 1e-6, 4), (500.0, 1000)],
)
def test_a_message_is_heard_at_the_first_step_after_its_delay(delay: float, steps: int) -> None:
    found = heard(links([(0, 1)], delay=delay), steps + 20)[:, 0]
    assert np.all(found[:steps] == -1)
    assert np.array_equal(found[steps:], np.arange(20))


def test_messages_come_and_go_as_in_a_queue_written_out_by_hand() -> None:
    """Delays of 0 to 3 steps drawn by the link, replayed with a list of who is under way."""
    line = links([(0, 1)], delay=0.5, jitter=1.5, loss=0.3, reordering=0.2, duplication=0.3)
    draws = [line._draws.at(step)[0].copy() for step in range(400)]
    under_way: list[tuple[int, int]] = []
    newest, expected = -1, []
    for step, (lost, late, repeated, overtaken) in enumerate(draws):
        if lost >= 0.3:
            way = int(np.ceil((0.5 + late * 1.5) / STEP - 1e-9)) + (2 if overtaken < 0.2 else 0)
            under_way.append((step + way, step))
            if repeated < 0.3:
                under_way.append((step + way + 1, step))
        arrived = [message for arrival, message in under_way if arrival == step and message > newest]
        newest = max(arrived, default=newest)
        expected.append(max(arrived, default=-1))
    assert heard(line, 400)[:, 0].tolist() == expected
    assert expected.count(-1) > 100


@pytest.mark.unmeasured
def test_jitter_is_evenly_spread_between_nothing_and_its_bound() -> None:
    found = heard(links([(0, 1)], delay=5.0, jitter=50.0), 4_000)[:, 0]
    age = np.arange(4_000)[found >= 0] - found[found >= 0]
    assert age.min() >= 10
    assert age.max() <= 110
    # Only the newest of those that arrive are heard: hardly ever one that took nearly all the time.
    alone = links([(0, 1)], delay=5.0, jitter=50.0, period=100.0)
    rare = heard(alone, 20_000)[:, 0]
    steps = np.arange(20_000)[rare >= 0] - rare[rare >= 0]
    assert len(steps) >= 99
    assert steps.min() >= 10
    assert steps.max() <= 110
    # The mean of a uniform distribution over 100 steps, rounded up, within four of its standard errors.
    assert steps.mean() == pytest.approx(10 + 50.5, abs=4 * 100 / np.sqrt(12 * 100))


def test_an_outage_loses_exactly_what_is_said_within_it() -> None:
    window = [{"begin": 3.0, "end": 5.0}, {"begin": 10.0, "end": 10.5}]
    found = heard(links([(0, 1)], outages=window, delay=1.0), 60)[:, 0]
    silent = set(range(58)) - set(found[found >= 0].tolist())
    assert silent == {6, 7, 8, 9, 20}


def test_an_outage_s_ends_may_be_off_the_grid_by_a_rounding() -> None:
    tenths = LinksSpec.model_validate({"default": {"outages": [{"begin": 0.1 * 3, "end": 0.7}]}})
    line = ChannelModel.of(tenths, [(0, 1)], NAMES, (0.1, 3), (1,))
    gone = [step for step in range(12) if line.transmit(step, said(step)).fresh[0] == 0.0]
    assert gone == [3, 4, 5, 6]


def test_messages_that_are_sent_rarely_are_heard_rarely() -> None:
    found = heard(links([(0, 1)], period=5.0), 100)[:, 0]
    assert found[found >= 0].tolist() == list(range(0, 100, 10))


def test_duplicates_change_nothing_of_what_is_known() -> None:
    rough = {"delay": 1.0, "jitter": 4.0, "loss": 0.3, "reordering": 0.3}
    single = known(links([(0, 1)], **rough), 2000)
    assert np.array_equal(known(links([(0, 1)], duplication=0.7, **rough), 2000), single)


def test_of_messages_out_of_order_the_newest_wins() -> None:
    found = known(links([(0, 1)], jitter=10.0, reordering=0.5), 2000)[:, 0]
    assert np.all(np.diff(found) >= 0)
    # Without a memory for what is newest, it would go back many times.
    assert np.count_nonzero(np.diff(found) == 0) > 500


def test_a_message_that_is_overtaken_comes_two_steps_later() -> None:
    found = heard(links([(0, 1)], reordering=1.0), 50)[:, 0]
    assert np.array_equal(found[2:], np.arange(48))


def test_what_happens_to_a_message_depends_on_seed_and_edge_alone() -> None:
    edges = [(0, 1), (2, 1), (3, 1)]
    rough = {"loss": 0.4, "jitter": 3.0}
    together = heard(links(edges, **rough), 600, 3)
    for place, edge in enumerate(edges):
        assert np.array_equal(heard(links([edge], **rough), 600)[:, 0], together[:, place])
    assert not np.array_equal(heard(links(edges, seed=4, **rough), 600, 3), together)


def test_satellites_that_fly_as_one_have_the_links_of_satellites_that_fly_alone() -> None:
    rows = [[(1, 0), (2, 0)], [(0, 1), (2, 1)]]
    spec = LinksSpec.model_validate({"default": {"loss": 0.4, "delay": 1.0, "jitter": 2.0}})
    stacked = ChannelModel.of(spec, [edge for row in rows for edge in row], NAMES, (STEP, 9), (2, 2))
    alone = [ChannelModel.of(spec, row, NAMES, (STEP, 9), (2,)) for row in rows]
    for step in range(600):
        values = np.arange(8.0).reshape(2, 2, 2) + step
        whole = stacked.transmit(step, Received.whole(values, np.full((2, 2), step * STEP)))
        for row, own in enumerate(alone):
            single = own.transmit(step, Received.whole(values[row], np.full(2, step * STEP)))
            assert np.array_equal(whole.fresh[row], single.fresh)
            fresh = single.fresh > 0.0
            assert np.array_equal(whole.values[row][fresh], single.values[fresh])
            assert np.array_equal(whole.stamp[row][fresh], single.stamp[fresh])


def test_links_of_a_restarted_satellite_lose_the_same_messages_from_then_on() -> None:
    whole, late = links([(0, 1)], loss=0.5), links([(0, 1)], loss=0.5)
    expected = heard(whole, 700)[300:, 0]
    late.forget()
    found = [late.transmit(step, said(step)) for step in range(300, 700)]
    assert [int(told.values[0, 0]) if told.fresh[0] else -1 for told in found] == expected.tolist()


def test_what_was_under_way_to_a_satellite_that_is_lost_is_lost_with_it() -> None:
    line = links([(0, 1)], delay=5.0)
    for step in range(10):
        line.transmit(step, said(step))
    line.forget()
    found = [line.transmit(step, said(step)) for step in range(10, 30)]
    assert [int(told.values[0, 0]) for told in found if told.fresh[0]] == list(range(10, 20))


def test_edges_lose_independently_of_each_other() -> None:
    arrived = heard(links([(0, 1), (1, 0)], loss=0.5), 4_000, 2) >= 0
    same = int(np.count_nonzero(arrived[:, 0] == arrived[:, 1]))
    assert binom.ppf(5e-5, 4_000, 0.5) <= same <= binom.ppf(1 - 5e-5, 4_000, 0.5)


def test_a_link_of_its_own_takes_from_the_default_what_it_leaves_out() -> None:
    spec = LinksSpec.model_validate(
        {"default": {"loss": 0.1, "delay": 2.0}, "edges": [{"sender": "a", "receiver": "b", "loss": 0.0}]}
    )
    assert (spec.of("a", "b").loss, spec.of("a", "b").delay) == (0.0, 2.0)
    assert spec.of("b", "a").loss == 0.1


def test_nothing_passes_over_an_edge_that_the_graph_does_not_have_at_present() -> None:
    line = links([(0, 1)], delay=1.0)
    cut = np.zeros(1)
    for step in range(20):
        linked = cut if 5 <= step < 10 else None
        told = line.transmit(step, Received.whole(np.full((1, 2), float(step)), np.zeros(1), linked))
        # Neither what was sent before arrives in these steps, nor what is sent in them afterwards.
        heard_now = int(told.values[0, 0]) if told.fresh[0] else -1
        expected = step - 2 if (2 <= step < 5 or step >= 12) else -1
        assert heard_now == expected


def test_delay_and_jitter_together_are_bounded_with_what_the_default_adds() -> None:
    spec = LinksSpec.model_validate(
        {"default": {"delay": 4000.0}, "edges": [{"sender": "a", "receiver": "b", "jitter": 2000.0}]}
    )
    (place, sentence), *others = spec.complaints(NAMES, STEP)
    assert not others
    assert place == ("edges", 0)
    assert "6000 s, which is more than 10000 steps of 0.5 s" in sentence
