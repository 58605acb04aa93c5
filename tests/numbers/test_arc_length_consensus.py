# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Consensus on the generalised arc length: modes, margins, and simulated graphs, delays and losses."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.linalg import expm
from scipy.optimize import newton

from satform.consensus.arc_length import (
    ArcLengthConsensus,
    ArcLengthConsensusSpec,
    NeighbourPhases,
    modal_roots,
    propagate,
)
from satform.consensus.graph import CompleteSpec, LineSpec, MatrixSpec, NoneSpec, RingSpec, StarSpec
from satform.numeric.stacking import stack

SLOW, MID, FAST = (1e-3, 1e-6, 1e-3), (1e-2, 1e-4, 1e-2), (0.1, 0.01, 0.1)
NOMINAL = 484422.4110 / 6000.0
THREE = np.array([0.0, 30e3, -20e3])
SIX = np.array([0.0, 30e3, -20e3, 10e3, -35e3, 25e3])
COMPLETE = CompleteSpec().build(3)
DELAYS = (5, 50, 200, 500, 1000)


def law(gains=SLOW, neighbour_values="hold"):
    return ArcLengthConsensus(*(np.asarray(gain) for gain in gains), neighbour_values=neighbour_values)


def links(graphs):
    """Neighbours' indices and weights of several formations of equal size, padded to one shape."""
    count = len(graphs[0])
    heard = [[graph.neighbours(i) for i in range(count)] for graph in graphs]
    width = max(1, *(len(row) for rows in heard for row in rows))
    index = np.array([[[*row, *([i] * (width - len(row)))] for i, row in enumerate(rows)] for rows in heard])
    weight = np.array([[[1.0] * len(row) + [0.0] * (width - len(row)) for row in rows] for rows in heard])
    return index, weight


def fly(graphs, start, steps, *, gains=SLOW, step=1.0):
    """Arc length and rate of formations side by side, each of shape (steps + 1, formations, N)."""
    index, weight = links(graphs)
    formation, consensus = np.arange(len(graphs))[:, None, None], law(gains)
    place, rate = np.tile(start, (len(graphs), 1)), np.full((len(graphs), len(start)), NOMINAL)
    places = np.empty((steps + 1, *place.shape))
    rates = np.empty_like(places)
    stamp = np.zeros_like(weight)
    for number in range(steps + 1):
        places[number], rates[number] = place, rate
        heard = NeighbourPhases(place[formation, index], rate[formation, index], stamp, weight)
        place, rate = propagate(place, rate, consensus.acceleration(place, rate, NOMINAL, heard, 0.0), step)
    return places, rates


def fly_delayed(graphs, delays, steps, *, neighbour_values="hold", own_delayed=False):
    """The same for three satellites with slow gains, a step of 1 s, and old values of the neighbours.

    Before the start everybody has flown at the nominal rate. With `own_delayed` a satellite also
    compares its neighbours with its own old values.
    """
    index, weight = links(graphs)
    formation, consensus, delays = np.arange(len(graphs)), law(SLOW, neighbour_values), np.array(delays)
    past = int(delays.max())
    places = np.empty((past + steps + 1, len(graphs), 3))
    rates = np.full_like(places, NOMINAL)
    places[: past + 1] = THREE + NOMINAL * np.arange(-past, 1)[:, None, None]
    ones = np.ones_like(weight)
    for number in range(steps):
        now = past + number
        place, rate, old_place, old_rate = (
            places[now],
            rates[now],
            *(values[now - delays, formation] for values in (places, rates)),
        )
        stamp = (number - delays)[:, None, None] * ones
        by_listener = formation[:, None, None], index
        heard = NeighbourPhases(old_place[by_listener], old_rate[by_listener], stamp, weight)
        if own_delayed:
            # This nominal rate leaves the pull on the own rate undelayed.
            change = consensus.acceleration(old_place, old_rate, old_rate - (rate - NOMINAL), heard, 0.0)
        else:
            change = consensus.acceleration(place, rate, NOMINAL, heard, float(number))
        places[now + 1], rates[now + 1] = propagate(place, rate, change, 1.0)
    return places[past:], rates[past:]


@pytest.fixture(scope="module")
def held():
    """Complete graphs of each of `DELAYS`, and a line with 50 s, holding old values."""
    return fly_delayed([COMPLETE] * 5 + [LineSpec().build(3)], [*DELAYS, 50], 16000)


@pytest.fixture(scope="module")
def extrapolated():
    """Complete graphs of each of `DELAYS`, and one with 2000 s, extrapolating old values."""
    return fly_delayed([COMPLETE] * 6, [*DELAYS, 2000], 20000, neighbour_values="extrapolate")


def spread(places):
    return np.ptp(places, axis=-1)


def settling(places, step=1.0):
    """First time from which the spread stays within 1% of its start, of each formation."""
    spreads = spread(places)
    outside = spreads > 0.01 * spreads[0]
    return (len(spreads) - np.argmax(outside[::-1], axis=0)) * step


@pytest.mark.parametrize(("gains", "size"), [(SLOW, 1e-3), (MID, 1e-2), (FAST, 0.1)])
def test_roots_of_three_complete_satellites(gains, size):
    roots = modal_roots(COMPLETE.eigenvalues, *gains)
    assert roots[0] == pytest.approx([0.0, -size], abs=1e-9 * size)
    assert roots[1:] == pytest.approx(np.array([[-size, -3.0 * size]] * 2), rel=1e-9)


def test_slowest_root_of_six_satellites_in_a_line():
    roots = modal_roots(LineSpec().build(6).eigenvalues, *SLOW)
    assert roots[1:].real.max() == pytest.approx(-2.67949e-4, rel=1e-5)


@pytest.mark.parametrize(
    "graph", [RingSpec().build(5), MatrixSpec(rows=((0, 1, 0), (0, 0, 1), (1, 0, 0))).build(3)]
)
def test_modal_roots_are_the_eigenvalues_of_the_whole_system(graph):
    count, laplacian = len(graph), graph.laplacian()
    gains = (2e-3, 5e-6, 1e-3)
    identity = np.eye(count)
    system = np.block(
        [
            [np.zeros((count, count)), identity],
            [-gains[1] * laplacian, -gains[0] * identity - gains[2] * laplacian],
        ]
    )
    found = modal_roots(graph.eigenvalues, *gains).ravel()
    for expected in np.linalg.eigvals(system):
        assert np.abs(found - expected).min() < 1e-9
    for root in found:
        assert np.abs(np.linalg.eigvals(system) - root).min() < 1e-9


def test_three_satellites_settle_as_known_on_each_graph():
    topologies = [CompleteSpec(), RingSpec(), LineSpec(), StarSpec(), NoneSpec()]
    places, rates = fly([topology.build(3) for topology in topologies], THREE, 12000)
    assert settling(places)[:4] == pytest.approx([5011.0, 5011.0, 5572.0, 6639.0], rel=5e-3)
    assert np.all(spread(places)[:, 4] == pytest.approx(50e3, abs=1e-6))
    mean = places[:, :4].mean(axis=-1) - NOMINAL * np.arange(12001)[:, None]
    assert mean == pytest.approx(np.full((12001, 4), 10e3 / 3.0), abs=1e-3)
    assert np.abs(rates[-1, 0] - NOMINAL).max() < 1e-3


def test_spread_of_three_complete_satellites_is_the_closed_form():
    places, _ = fly([COMPLETE], THREE, 30000)
    q = 1e-3 * np.array([0.0, 3000.0, 6000.0, 12000.0])
    expected = 50e3 * (3.0 * np.exp(-q) - np.exp(-3.0 * q)) / 2.0
    found = spread(places)[[0, 3000, 6000, 12000], 0]
    assert found == pytest.approx(expected, rel=2e-3)
    assert found[2:] == pytest.approx([185.93, 0.461], rel=5e-3)
    assert spread(places)[30000, 0] < 1e-6


@pytest.mark.parametrize(
    ("gains", "step", "settled", "spreads", "tolerance"),
    [
        (MID, 0.1, 501.5, {1000: 26345.0, 2000: 10087.0, 5000: 505.3}, 5e-3),
        (FAST, 0.02, 50.2, {5000: 3.409, 10000: 1.55e-4}, 0.05),
    ],
)
def test_faster_gains_settle_as_known(gains, step, settled, spreads, tolerance):
    places, _ = fly([COMPLETE], THREE, max(spreads), gains=gains, step=step)
    assert settling(places, step)[0] == pytest.approx(settled, rel=5e-3)
    for number, expected in spreads.items():
        assert spread(places)[number, 0] == pytest.approx(expected, rel=tolerance)


def test_six_satellites_settle_as_known_on_each_graph():
    topologies = [CompleteSpec(), RingSpec(), StarSpec(), LineSpec()]
    places, _ = fly([topology.build(6) for topology in topologies], SIX, 11500)
    assert settling(places) == pytest.approx([4788.0, 5845.0, 6639.0, 10985.0], rel=5e-3)
    assert spread(places)[6000] == pytest.approx([193.3, 566.0, 1127.8, 2353.1], rel=0.01)


def delayed_root(delay):
    """Rightmost root of three complete satellites with slow gains that compare equally old values."""
    k1, k2, k3 = SLOW
    return newton(lambda s: s * s + k1 * s + 3.0 * (k2 + k3 * s) * np.exp(-s * delay), 3e-3j, tol=1e-15)


def test_when_all_values_are_delayed_disagreement_decays_below_the_margin_and_grows_above_it():
    assert [delayed_root(508.0).real, delayed_root(539.0).real] == pytest.approx(
        [-4.23e-5, 3.83e-5], rel=5e-3
    )
    places, _ = fly_delayed([COMPLETE] * 2, [508, 539], 20000, own_delayed=True)
    apart = np.abs(places - places.mean(axis=-1, keepdims=True))[..., 1]
    growth = []
    for swing in apart.T:
        peaks = np.flatnonzero((swing[1:-1] > swing[:-2]) & (swing[1:-1] > swing[2:]))[6:] + 1
        growth.append(np.polyfit(peaks, np.log(swing[peaks]), 1)[0])
    # Holding the decision over a step of 1 s makes every value half a second older on the average.
    assert growth == pytest.approx([delayed_root(508.5).real, delayed_root(539.5).real], rel=0.03)


def test_holding_delayed_values_slows_the_whole_formation(held):
    expected = 1e-3 / (1e-3 + 1e-6 * 2.0 * np.array(DELAYS))
    assert expected == pytest.approx([0.990099, 0.909091, 0.714286, 0.5, 0.333333], abs=5e-7)
    assert held[1][-1, :5] / NOMINAL == pytest.approx(np.tile(expected[:, None], 3), abs=1e-4)


def test_holding_delayed_values_biases_the_phase_on_an_irregular_graph(held):
    places, rates = held
    assert rates[-1, 5] / NOMINAL == pytest.approx(np.full(3, 0.9375), rel=0.01)
    assert places[-1, 5, 1] - places[-1, 5, [0, 2]] == pytest.approx([-1261.5, -1261.5], rel=0.01)


def test_extrapolating_delayed_values_keeps_the_rate_and_settles_as_known(extrapolated):
    places, rates = extrapolated
    assert settling(places)[:5] == pytest.approx([5019.0, 5088.0, 5335.0, 5885.0, 8580.0], rel=0.01)
    assert rates[-1, :4] / NOMINAL == pytest.approx(np.ones((4, 3)), abs=1e-6)


def extrapolation_root(delay, neighbour_mode, guess):
    """Root of a mode of three complete satellites with slow gains and extrapolated neighbours."""
    k1, k2, k3 = SLOW

    def characteristic(s):
        late = neighbour_mode * np.exp(-s * delay)
        return s * s + k1 * s + k2 * (2.0 - late * (1.0 + s * delay)) + k3 * s * (2.0 - late)

    return newton(characteristic, guess, tol=1e-15, maxiter=200)


def test_extrapolation_of_an_old_disagreement_becomes_unstable_between_1925_and_1965_seconds(extrapolated):
    assert extrapolation_root(1925.0, -1.0, 1.5e-3j).real < 0.0
    assert extrapolation_root(1965.0, -1.0, 1.5e-3j).real > 0.0
    spreads = spread(extrapolated[0])
    late, later = spreads[10000:15000].max(axis=0), spreads[15000:].max(axis=0)
    assert later[4] < 0.2 * late[4]
    assert later[5] > late[5]


def test_extrapolation_of_a_common_rate_error_becomes_unstable_already_before_1325_seconds():
    assert extrapolation_root(1300.0, 2.0, 4.1e-3j).real < 0.0
    assert extrapolation_root(1325.0, 2.0, 4.1e-3j).real > 0.0


def lossy(loss, every, neighbour_values, steps, *, seeds=range(5)):
    """Settling time, late mean rate and late spread of each loss probability and seed.

    Each directed link loses each message with the given probability; what was heard last is used.
    """
    cases = [(probability, seed) for probability in loss for seed in seeds]
    index = links([COMPLETE])[0][0]
    messages = steps // every + 1
    listener = np.arange(3)[:, None]
    arrived = np.stack(
        [np.random.default_rng(s).random((messages, 3, 3))[:, listener, index] >= p for p, s in cases], axis=1
    )
    consensus = law(SLOW, neighbour_values)
    place, rate = np.tile(THREE, (len(cases), 1)), np.full((len(cases), 3), NOMINAL)
    weight = np.ones((len(cases), 3, 2))
    heard = NeighbourPhases(place[:, index], rate[:, index], np.zeros_like(weight), weight)
    places, rates = np.empty((steps + 1, len(cases), 3)), np.empty((steps + 1, len(cases), 3))
    for number in range(steps + 1):
        places[number], rates[number] = place, rate
        if number % every == 0 and number > 0:
            here = arrived[number // every]
            heard = NeighbourPhases(
                np.where(here, place[:, index], heard.arc_length),
                np.where(here, rate[:, index], heard.rate),
                np.where(here, float(number), heard.stamp),
                weight,
            )
        change = consensus.acceleration(place, rate, NOMINAL, heard, float(number))
        place, rate = propagate(place, rate, change, 1.0)
    shape = (len(loss), len(seeds))
    late = steps // 2
    return (
        settling(places).reshape(shape).mean(axis=-1),
        rates[late:].mean(axis=(0, 2)).reshape(shape) / NOMINAL,
        spread(places)[late:].max(axis=0).reshape(shape),
    )


def test_losing_messages_slows_a_formation_that_holds_values():
    _, rate, _ = lossy((0.2, 0.5, 0.8, 0.95), 1, "hold", 12000)
    assert rate.mean(axis=-1) == pytest.approx([0.9995, 0.9980, 0.9921, 0.9637], abs=0.002)


def test_losing_messages_hardly_delays_a_formation_that_extrapolates():
    settled, _, _ = lossy((0.0, 0.5, 0.8, 0.95, 0.99), 1, "extrapolate", 8000)
    assert settled == pytest.approx([5011.0, 5013.0, 5017.0, 5042.0, 5196.0], rel=0.01)


def test_rare_messages_hardly_delay_a_formation_that_extrapolates():
    settled, rate, _ = lossy((0.5, 0.8, 0.95), 10, "extrapolate", 14000)
    assert settled == pytest.approx([5033.0, 5076.0, 5390.0], rel=0.02)
    assert rate == pytest.approx(np.ones((3, 5)), abs=1e-3)


def test_rare_messages_leave_a_formation_that_holds_values_slow_and_apart():
    _, rate, apart = lossy((0.8,), 10, "hold", 12000)
    assert rate.mean() == pytest.approx(0.915, abs=0.01)
    assert 500.0 < apart.mean() < 1500.0


def test_satellites_that_announce_their_place_less_an_offset_end_up_apart_by_it():
    offset, (index, weight) = np.array([0.0, 40e3, -10e3]), links([COMPLETE])
    place, rate = THREE, np.full(3, NOMINAL)
    for _ in range(1500):
        phase = place - offset
        heard = NeighbourPhases(phase[index[0]], rate[index[0]], np.zeros((3, 2)), weight[0])
        place, rate = propagate(place, rate, law(MID).acceleration(phase, rate, NOMINAL, heard, 0.0), 1.0)
    assert np.diff(place) == pytest.approx([40e3, -50e3], abs=0.1)


def test_propagation_is_that_of_a_double_integrator():
    exact = expm(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]) * 0.7) @ [5.0, -2.0, 0.3]
    found = propagate(np.float64(5.0), np.float64(-2.0), np.float64(0.3), 0.7)
    assert found == pytest.approx(exact[:2], rel=1e-14)


def test_a_satellite_that_hears_nobody_returns_to_the_nominal_rate():
    nothing = NeighbourPhases(*(np.zeros(0) for _ in range(4)))
    change = law().acceleration(np.float64(7.0), np.float64(NOMINAL + 2.0), NOMINAL, nothing, 0.0)
    assert change == pytest.approx(-2e-3, rel=1e-12)


def test_extrapolation_carries_a_neighbour_on_by_the_age_of_its_stamp():
    heard = NeighbourPhases(*(np.array([value]) for value in (1000.0, 50.0, 20.0, 1.0)))
    gains = (1e-3, 1e-2, 1e-9)
    change = law(gains, "extrapolate").acceleration(np.float64(1500.0), np.float64(50.0), 50.0, heard, 30.0)
    assert change == pytest.approx(0.0, abs=1e-12)
    held = law(gains).acceleration(np.float64(1500.0), np.float64(50.0), 50.0, heard, 30.0)
    assert held == pytest.approx(-5.0, rel=1e-12)


def test_one_satellite_and_many_get_the_same_bits_whatever_the_padding():
    generator = np.random.default_rng(9)
    specs = [
        ArcLengthConsensusSpec(
            tracking_gain=1e-3 * (1 + i),
            coupling_gain=1e-6,
            rate_gain=1e-3,
            neighbour_values="extrapolate",
        )
        for i in range(12)
    ]
    laws = [spec.build() for spec in specs]
    place, rate = generator.normal(0.0, 1e5, 12), generator.normal(80.0, 5.0, 12)
    values = generator.normal(100.0, 30.0, (4, 12, 9))
    known = generator.integers(0, 10, 12)
    values[3] = np.arange(9) < known[:, None]
    stacked = stack(laws).acceleration(place, rate, np.full(12, 80.0), NeighbourPhases(*values), 7.0)
    for i, single in enumerate(laws):
        heard = NeighbourPhases(*values[:, i, : known[i]])
        assert single.acceleration(place[i], rate[i], np.float64(80.0), heard, 7.0) == stacked[i]


@pytest.mark.parametrize("field", ["tracking_gain", "coupling_gain", "rate_gain"])
def test_gains_have_to_be_positive(field):
    gains = {"tracking_gain": 1e-3, "coupling_gain": 1e-6, "rate_gain": 1e-3, field: 0.0}
    with pytest.raises(ValidationError, match=field):
        ArcLengthConsensusSpec(**gains)
