# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Resilient consensus: liars among the neighbours, against intervals and the plain law."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from flights import shortened
from satform.consensus.arc_length import ArcLengthConsensusSpec, NeighbourPhases, propagate
from satform.consensus.byzantine_robustness import robustness
from satform.consensus.graph import CompleteSpec, Graph, RingSpec
from satform.consensus.resilient import ResilientArcLengthConsensusSpec, outliers
from satform.flight.simulate import simulate
from satform.numeric.stacking import stack

NOMINAL = 80.0
ORDINARY = [0.0, 1.0, -1.0, 1e3, -1e3, 1e6, -1e6]
SPECIAL = [1e15, -1e15, 1e308, -1e308, np.inf, -np.inf, np.nan]


def resilient(liars, tracking=0.2, rate=0.1, share=1.0, **others):
    """The law with `coupling_gain` a share of the largest that keeps the interval."""
    return ResilientArcLengthConsensusSpec(
        tracking_gain=tracking,
        coupling_gain=share * tracking * rate,
        rate_gain=rate,
        tolerated_byzantine=liars,
        **others,
    )


def plain(spec):
    return ArcLengthConsensusSpec(**spec.model_dump(exclude={"kind", "tolerated_byzantine"}))


def attached(count, links, generator):
    """A robust graph by preferential attachment: each newcomer joins `links` of those already there."""
    core = max(2, 2 * links - 1)
    adjacency = np.zeros((count, count))
    adjacency[:core, :core] = 1.0 - np.eye(core)
    for newcomer in range(core, count):
        share = adjacency[:newcomer].sum(axis=1)
        others = generator.choice(newcomer, links, replace=False, p=share / share.sum())
        adjacency[newcomer, others] = adjacency[others, newcomer] = 1.0
    return Graph(adjacency)


def links(graph):
    """Who is heard and whether it counts, each of shape (N, K)."""
    heard = [graph.neighbours(i) for i in range(len(graph))]
    width = max(len(row) for row in heard)
    index = np.array([[*row, *([i] * (width - len(row)))] for i, row in enumerate(heard)])
    return index, (np.arange(width) < [[len(row)] for row in heard]).astype(float)


def flown(spec, graph, phase, rate, liars, lie, steps):
    """z and q of the honest satellites, shape (steps + 1, 2, honest): see the law's module."""
    law = stack([spec.build()] * len(graph))
    index, weight = links(graph)
    lying = np.isin(np.arange(len(graph)), liars)
    ahead = spec.rate_gain / spec.coupling_gain
    states = np.empty((steps + 1, 2, np.sum(~lying)))
    for step in range(steps + 1):
        place = phase[~lying] - NOMINAL * step
        states[step] = place, place + ahead * (rate[~lying] - NOMINAL)
        said = phase[index], rate[index]
        for listener, slot in zip(*np.nonzero(lying[index] & (weight > 0)), strict=True):
            said[0][listener, slot], said[1][listener, slot] = lie(step, listener, phase, rate)
        heard = NeighbourPhases(*said, np.full_like(weight, step), weight)
        change = law.acceleration(phase, rate, np.full(len(graph), NOMINAL), heard, float(step))
        phase, rate = propagate(phase, rate, np.where(lying, 0.0, change), 1.0)
    return states


def some_lie(generator):
    """Another lie at each step for each listener: wild, impossible, or close to what the listener knows."""

    def lie(_step, listener, phase, rate):
        style = generator.integers(4)
        if style == 0:
            return generator.choice(SPECIAL, 2)
        if style == 1:
            return phase[listener] + generator.choice(ORDINARY), rate[listener] + generator.choice(SPECIAL)
        if style == 2:
            return phase[listener] + generator.choice(SPECIAL), rate[listener]
        return phase[listener] + generator.normal(0.0, 2e3), rate[listener] + generator.normal(0.0, 1e2)

    return lie


@pytest.mark.unmeasured
@settings(max_examples=8, deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32),
    st.sampled_from([(0, 5), (1, 7), (1, 9), (2, 10)]),
    st.sampled_from([0.2, 0.7, 1.0]),
)
def test_honest_satellites_agree_within_their_interval_whatever_the_tolerated_liars_say(seed, size, share):
    liars_near_each, count = size
    generator = np.random.default_rng(seed)
    graph = attached(count, 2 * liars_near_each + 1, generator)
    assert robustness(graph).r >= 2 * liars_near_each + 1
    liars = generator.choice(count, liars_near_each, replace=False)
    spec = resilient(liars_near_each, tracking=0.4, rate=0.6 / (count - 1), share=share)
    assert spec.doubts(count - 1, 1.0) == []
    phase, rate = generator.normal(0.0, 1e3, count), NOMINAL + generator.normal(0.0, 10.0, count)
    states = flown(spec, graph, phase, rate, liars, some_lie(generator), 800)
    slack = 1e-9 * np.abs(states[0]).max() + 1e-7
    assert states.min() >= states[0].min() - slack
    assert states.max() <= states[0].max() + slack
    assert np.ptp(states[-1]) < 1e-3 * np.ptp(states[0])


def test_the_interval_shrinks_at_every_step_and_never_grows():
    generator = np.random.default_rng(3)
    graph, spec = attached(9, 3, generator), resilient(1, rate=0.1)
    phase, rate = generator.normal(0.0, 1e3, 9), np.full(9, NOMINAL)
    states = flown(spec, graph, phase, rate, [4], some_lie(generator), 400)
    assert np.all(np.diff(states.max(axis=(1, 2))) <= 1e-7)
    assert np.all(np.diff(states.min(axis=(1, 2))) >= -1e-7)


def test_satellites_that_start_at_the_nominal_rate_end_among_the_phases_of_the_honest():
    generator = np.random.default_rng(5)
    graph, spec = CompleteSpec().build(7), resilient(1)
    phase = generator.normal(0.0, 1e3, 7)
    end = flown(spec, graph, phase, np.full(7, NOMINAL), [2], some_lie(generator), 600)[-1]
    honest = np.delete(phase, 2)
    assert honest.min() < end.min() <= end.max() < honest.max()
    assert np.ptp(end) < 1.0


@pytest.mark.parametrize("lie", [(1e5, NOMINAL), (0.0, 1e5)])
def test_one_liar_drags_the_plain_law_off_and_not_the_resilient_one(lie):
    graph, phase = CompleteSpec().build(6), np.linspace(-100.0, 100.0, 6)

    def steady(step, _listener, _phase, _rate):
        return lie[0] + NOMINAL * step, lie[1]

    ends = [
        flown(spec, graph, phase, np.full(6, NOMINAL), [3], steady, 400)[-1, 0]
        for spec in (plain(resilient(1)), resilient(1))
    ]
    assert np.min(np.abs(ends[0])) > 1e3
    assert np.max(np.abs(ends[1])) <= 100.0
    assert np.ptp(ends[1]) < 0.1


def test_a_liar_more_than_tolerated_drags_the_formation_off():
    def far(step, _listener, _phase, _rate):
        return 1e6 + NOMINAL * step, NOMINAL

    start = np.linspace(-100.0, 100.0, 7)
    end = flown(resilient(1), CompleteSpec().build(7), start, np.full(7, NOMINAL), [0, 3], far, 400)[-1, 0]
    assert np.all(end > 1e3)


def test_on_a_ring_two_halves_never_agree_once_one_liar_is_tolerated():
    start = np.array([0.0, 0.0, 0.0, 1e3, 1e3, 1e3])
    end = flown(resilient(1), RingSpec().build(6), start, np.full(6, NOMINAL), [], None, 200)[-1, 0]
    assert end == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize(
    ("spec", "degree", "step", "words"),
    [
        (resilient(1, share=1.01), 6, 1.0, "coupling_gain 0.0202 is more than"),
        (resilient(1), 9, 1.0, "a step of 1 s is longer than"),
    ],
)
def test_gains_and_steps_that_may_leave_the_interval_are_named(spec, degree, step, words):
    (doubt,) = spec.doubts(degree, step)
    assert words in doubt


def test_gains_that_are_doubted_do_leave_the_interval_among_honest_satellites():
    spec, start = resilient(0, share=30.0), np.array([-100.0, 100.0])
    assert spec.doubts(1, 1.0)
    states = flown(spec, CompleteSpec().build(2), start, np.full(2, NOMINAL), [], None, 100)
    assert np.max(states[:, 0]) > 101.0 or np.max(states[:, 1]) > 101.0


def test_extrapolated_values_no_older_than_the_look_ahead_stay_within_the_interval():
    spec = resilient(0, neighbour_values="extrapolate")
    ahead = spec.rate_gain / spec.coupling_gain
    generator = np.random.default_rng(8)
    for age in (0.0, 0.5 * ahead, ahead):
        place, late = generator.normal(0.0, 1e3), generator.normal(0.0, 30.0)
        said = NeighbourPhases(
            *(np.array([value]) for value in (place - NOMINAL * age, NOMINAL + late, -age, 1.0))
        )
        coupling = spec.build().couplings(np.float64(0.0), np.float64(NOMINAL), said, 0.0)[0]
        reached = -coupling / spec.coupling_gain - (ahead + age) * late
        assert reached == pytest.approx(place, abs=1e-6)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.lists(st.sampled_from([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0]), min_size=1, max_size=8),
    st.integers(0, 4),
)
def test_up_to_f_are_ignored_on_either_side_and_they_are_the_most_extreme(couplings, liars):
    coupling = np.array(couplings)
    ignored = outliers(coupling, liars)
    for side in (coupling > 0.0, coupling < 0.0):
        assert np.sum(ignored & side) == min(liars, np.sum(side))
        if np.any(ignored & side) and np.any(side & ~ignored):
            assert np.abs(coupling[ignored & side]).min() >= np.abs(coupling[side & ~ignored]).max()
    assert not np.any(ignored & (coupling == 0.0))


def test_without_tolerated_liars_the_law_has_the_bits_of_the_plain_one():
    generator = np.random.default_rng(2)
    spec = resilient(0, neighbour_values="extrapolate")
    values = generator.normal(100.0, 30.0, (4, 12, 5))
    values[3] = np.arange(5) < generator.integers(1, 6, 12)[:, None]
    place, rate = generator.normal(0.0, 1e5, 12), generator.normal(80.0, 5.0, 12)
    laws = [stack([one.build()] * 12) for one in (spec, plain(spec))]
    found = [law.acceleration(place, rate, np.full(12, 80.0), NeighbourPhases(*values), 7.0) for law in laws]
    assert found[0].tobytes() == found[1].tobytes()


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.integers(0, 2**32), st.integers(0, 3))
def test_one_satellite_and_many_get_the_same_bits_whatever_the_padding_and_ties(seed, liars):
    generator = np.random.default_rng(seed)
    values = np.stack([generator.choice(ORDINARY + SPECIAL, (6, 7)) for _ in range(4)])
    values[2], known = 0.0, generator.integers(0, 8, 6)
    values[3] = np.arange(7) < known[:, None]
    place, rate = generator.choice(ORDINARY, 6), generator.choice(ORDINARY, 6)
    law = resilient(liars).build()
    stacked = stack([law] * 6).acceleration(place, rate, np.zeros(6), NeighbourPhases(*values), 0.0)
    assert np.all(np.isfinite(stacked))
    for i in range(6):
        heard = NeighbourPhases(*values[:, i, : known[i]])
        single = law.acceleration(place[i], rate[i], np.float64(0.0), heard, 0.0)
        assert np.float64(single) == stacked[i]


def test_who_is_not_heard_does_not_count_among_the_ignored():
    heard = NeighbourPhases(*np.array([[5.0, 9.0, 1e9], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]))
    change = resilient(1).build().acceleration(np.float64(0.0), np.float64(0.0), 0.0, heard, 0.0)
    # 9 m ahead is ignored as the furthest; 5 m ahead remains.
    assert change == pytest.approx(0.02 * 5.0, rel=1e-12)


def test_a_formation_flies_the_resilient_law_with_the_bits_of_the_plain_one_where_nobody_is_ignored():
    scenario = shortened("complete_six", 60.0)
    gains = scenario.consensus.model_dump(exclude={"kind"})
    other = replace_consensus(scenario, ResilientArcLengthConsensusSpec(**gains, tolerated_byzantine=0))
    assert np.array_equal(simulate(other).position, simulate(scenario).position)
    wary = replace_consensus(scenario, ResilientArcLengthConsensusSpec(**gains, tolerated_byzantine=1))
    assert not np.array_equal(simulate(wary).arc_length, simulate(scenario).arc_length)


def replace_consensus(scenario, law):
    return scenario.model_copy(update={"consensus": law})


@pytest.mark.parametrize("liars", [-1, 1.5, 10_001])
def test_the_number_of_liars_is_a_small_whole_number(liars):
    with pytest.raises(ValidationError, match="tolerated_byzantine"):
        resilient(liars)
