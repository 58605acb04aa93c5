# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Stability of the consensus that flies: per mode and step, and the delay of messages that it bears."""

import math

import numpy as np
import pytest

from flights import shipped
from satform.consensus.arc_length import NeighbourValues, propagate
from satform.consensus.graph import CompleteSpec, Graph, LineSpec, NoneSpec, RingSpec, StarSpec
from satform.consensus.stability import MOST_ALIKE, MOST_UNLIKE, Gains, delay_margin, sampled_modes
from satform.numeric.elementwise import Array
from satform_tools.check.consensus import margin

SLOW = Gains(1e-3, 1e-6, 1e-3)
STIFF = Gains(1e-3, 9e-6, 1e-3)
"""More coupling than tracking * rate, so that held values bear a limited delay."""

CYCLE = Graph(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]))
UNLIKE = Graph(
    np.array([[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
)
"""Directed, with one satellite that receives two others."""


def delayed_radius(graph: Graph, gains: Gains, delay: float, values: NeighbourValues, steps: int) -> float:
    """Second largest eigenvalue of the law stepped with messages that are `steps` steps old, by one step."""
    count, step = len(graph), delay / steps
    lead = gains.rate + (gains.coupling * delay if values == "extrapolate" else 0.0)
    degrees, whole = np.diag(graph.adjacency.sum(axis=1)), 2 * count * (steps + 1)
    change = np.zeros((count, whole))
    change[:, :count] = -gains.coupling * degrees
    change[:, count : 2 * count] = -gains.tracking * np.eye(count) - gains.rate * degrees
    change[:, -2 * count : -count] = gains.coupling * graph.adjacency
    change[:, -count:] = lead * graph.adjacency
    matrix = np.zeros((whole, whole))
    # xi and eta of a step, then those of the steps before.
    matrix[:count, :count] = np.eye(count)
    matrix[:count, count : 2 * count] = step * np.eye(count)
    matrix[:count] += 0.5 * step * step * change
    matrix[count : 2 * count, count : 2 * count] = np.eye(count)
    matrix[count : 2 * count] += step * change
    matrix[2 * count :, : -2 * count] = np.eye(whole - 2 * count)
    return float(np.sort(np.abs(np.linalg.eigvals(matrix)))[-2])


@pytest.mark.parametrize(
    ("graph", "gains", "values"),
    [
        (CompleteSpec().build(3), SLOW, "extrapolate"),
        (LineSpec().build(4), SLOW, "extrapolate"),
        (UNLIKE, SLOW, "extrapolate"),
        (CYCLE, SLOW, "extrapolate"),
        (CompleteSpec().build(3), STIFF, "hold"),
        (StarSpec().build(4), STIFF, "hold"),
        (UNLIKE, STIFF, "hold"),
    ],
)
def test_the_delay_margin_is_where_a_stepped_law_with_old_messages_begins_to_grow(
    graph: Graph, gains: Gains, values: NeighbourValues
) -> None:
    bound = delay_margin(graph, gains, values)
    assert bound is not None
    # Stepped, everything is up to a step later than in continuous time: 2 % of the delay, and own values too.
    assert delayed_radius(graph, gains, 0.93 * bound, values, 50) < 1.0
    assert delayed_radius(graph, gains, 1.01 * bound, values, 50) > 1.0


def test_the_delay_margin_of_extrapolated_values_is_that_of_the_reference_computation() -> None:
    # Figures of a computation apart from this project, for three satellites that all hear each other.
    assert delay_margin(CompleteSpec().build(3), SLOW, "extrapolate") == pytest.approx(1311.6, rel=1e-4)
    scenario = shipped("triangle", "consensus.neighbour_values=extrapolate")
    assert margin(scenario) == pytest.approx(1311.6, rel=1e-4)


@pytest.mark.parametrize(("coupling", "degree"), [(9e-6, 2.0), (4e-6, 2.0), (9e-6, 5.0)])
def test_held_values_slow_the_whole_formation_until_it_diverges_as_in_closed_form(
    coupling: float, degree: float
) -> None:
    # Of all that move alike: w^2 = 2 d (k2 - k1 k3) - k1^2 where |k2 + k3 j w| d is the own part's magnitude.
    k1, k3 = 1e-3, 1e-3
    frequency = math.sqrt(2.0 * degree * (coupling - k1 * k3) - k1 * k1)
    along = 1j * frequency
    loop = (coupling + k3 * along) * degree / (along**2 + k1 * along + (coupling + k3 * along) * degree)
    assert abs(loop) == pytest.approx(1.0, rel=1e-12)
    whole = (np.angle(loop) % (2.0 * math.pi)) / frequency
    found = delay_margin(CompleteSpec().build(int(degree) + 1), Gains(k1, coupling, k3), "hold")
    assert found is not None
    assert found <= whole * (1.0 + 1e-9)
    if degree == 2.0:
        assert found == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("gains", [SLOW, Gains(0.1, 0.01, 0.1), Gains(0.5, 0.1, 0.3)])
@pytest.mark.parametrize("graph", [CompleteSpec().build(3), RingSpec().build(6), UNLIKE])
def test_held_values_bear_any_delay_while_the_coupling_is_no_more_than_the_other_gains_product(
    graph: Graph, gains: Gains
) -> None:
    assert delay_margin(graph, gains, "hold") == math.inf
    for delay in (1.0, 1e3):
        assert delayed_radius(graph, gains, delay / gains.rate * 1e-3, "hold", 20) < 1.0


def test_satellites_that_hear_nobody_bear_any_delay_and_very_many_are_not_worked_out() -> None:
    assert delay_margin(NoneSpec().build(3), SLOW, "extrapolate") == math.inf
    assert delay_margin(CompleteSpec().build(MOST_ALIKE + 1), SLOW, "extrapolate") is None
    assert delay_margin(LineSpec().build(MOST_UNLIKE + 1), SLOW, "extrapolate") is None


def flown_growth(mode: float, gains: Gains, step: float) -> float:
    """Factor a step by which one mode of the graph grows, flown step after step by `propagate`."""
    place, rate = np.asarray(1.0), np.asarray(0.3)
    sizes = []
    for _ in range(4000):
        change: Array = -gains.tracking * rate - mode * (gains.coupling * place + gains.rate * rate)
        place, rate = propagate(place, rate, change, step)
        size = math.hypot(float(place), float(rate) / gains.tracking)
        place, rate = place / size, rate / size
        sizes.append(math.log(size))
    return math.exp(float(np.mean(sizes[2000:])))


@pytest.mark.parametrize(
    ("gains", "step"),
    [
        (Gains(2.5, 1e-6, 1e-3), 1.0),
        (Gains(0.1, 1e-6, 0.65), 1.0),
        (Gains(1.0, 0.4, 0.3), 1.0),
        (Gains(0.1, 0.01, 0.1), 4.0),
    ],
)
def test_the_radius_of_a_mode_is_the_growth_of_a_flown_one(gains: Gains, step: float) -> None:
    for mode in (0.7, 3.0):
        found = float(sampled_modes(np.array([mode]), gains, step)[0])
        assert found == pytest.approx(flown_growth(mode, gains, step), rel=2e-3)


def test_the_free_phase_counts_for_nothing_and_the_common_rate_decays_by_its_own_gain() -> None:
    assert sampled_modes(np.array([0.0]), Gains(2.5, 1e-6, 1e-3), 1.0) == pytest.approx([1.5])
    assert sampled_modes(np.array([0.0]), SLOW, 1.0) == pytest.approx([0.999])
