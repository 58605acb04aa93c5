# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Consensus over links that lose messages: mean square disagreement, and the loss at which it grows."""

import numpy as np
import pytest

from flights import shipped
from satform.consensus.graph import CompleteSpec, Graph, LineSpec, RingSpec
from satform.consensus.lossy_links import LossyConsensus
from satform.consensus.stability import Gains, sampled_modes
from satform.evaluation.stability_borders import lossy_consensus
from satform.flight.simulate import simulate

GAINS = Gains(1.0e-2, 1.0e-4, 1.0e-2)
PHASES = np.array([0.0, 3000.0, -2000.0])


@pytest.mark.parametrize("graph", [CompleteSpec().build(3), RingSpec().build(5), LineSpec().build(4)])
def test_without_loss_the_mean_square_decays_as_the_square_of_the_slowest_mode(graph: Graph) -> None:
    lossless = LossyConsensus.of(graph, GAINS, 20.0)
    slowest = float(sampled_modes(graph.eigenvalues, GAINS, 20.0).max())
    assert lossless.mean_square_radius(0.0) == pytest.approx(slowest**2, rel=1e-9)


def test_the_radius_is_that_of_the_whole_map_of_second_moments() -> None:
    pair = LossyConsensus.of(CompleteSpec().build(2), GAINS, 20.0, 5)
    loss = 0.6
    mean = pair.mean(loss)
    whole = np.kron(mean, mean) + loss * (1.0 - loss) * sum(np.kron(one, one) for one in pair.arrivals)
    assert pair.mean_square_radius(loss) == pytest.approx(np.abs(np.linalg.eigvals(whole)).max(), rel=1e-9)


@pytest.mark.parametrize("loss", [0.0, 0.3, 0.6])
def test_the_mean_square_is_that_of_many_flights_of_the_law(loss: float) -> None:
    """The law written down once more, for 4000 flights side by side."""
    step, every, messages, runs = 20.0, 5, 12, 4000
    k1, k2, k3 = GAINS.tracking, GAINS.coupling, GAINS.rate
    generator = np.random.default_rng(3)
    phase = np.tile(PHASES, (runs, 1))
    rate = np.zeros((runs, 3))
    held, held_rate = np.tile(PHASES, (runs, 3, 1)), np.zeros((runs, 3, 3))
    other = 1.0 - np.eye(3)
    found = []
    for number in range(messages * every + 1):
        if number % every == 0:
            found.append(np.sqrt(np.mean((phase - phase.mean(axis=1, keepdims=True)) ** 2)))
            arrived = generator.random((runs, 3, 3)) >= loss
            held = np.where(arrived, phase[:, None, :], held)
            held_rate = np.where(arrived, rate[:, None, :], held_rate)
        pull = k2 * (phase[:, :, None] - held) + k3 * (rate[:, :, None] - held_rate)
        acceleration = -k1 * rate - (other * pull).sum(axis=2)
        phase = phase + step * rate + 0.5 * step**2 * acceleration
        rate = rate + step * acceleration
        held = held + step * held_rate
    theory = LossyConsensus.of(CompleteSpec().build(3), GAINS, step, every)
    expected = theory.rms_disagreement(PHASES, np.zeros(3), loss, messages)
    # Without loss to rounding; the mean square of a few thousand flights else.
    np.testing.assert_allclose(found, expected, rtol=1e-9 if loss == 0.0 else 0.12)


def test_a_flight_without_loss_has_the_disagreement_of_the_theory() -> None:
    scenario = shipped("lossy_links").with_(
        {
            "timing.step": 20.0,
            "timing.duration": 1000.0,
            "consensus.tracking_gain": 1.0e-2,
            "consensus.coupling_gain": 1.0e-4,
            "consensus.rate_gain": 1.0e-2,
            "links": {"default": {"loss": 0.0, "period": 100.0}},
            "satellite_defaults.controller": {"kind": "lqr"},
            "expect": [],
        }
    )
    phases = simulate(scenario).arc_length[::5]
    found = np.sqrt(np.mean((phases - phases.mean(axis=1, keepdims=True)) ** 2, axis=1))
    theory = lossy_consensus(scenario)
    start = np.array([own.arc_length for own in scenario.satellites])
    # Satellites begin at the nominal rate of their own perimeter, which is that of all but for rounding.
    expected = theory.rms_disagreement(start, np.zeros(3), 0.0, 10)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


def test_loss_has_a_border_beyond_which_the_mean_square_grows() -> None:
    theory = LossyConsensus.of(CompleteSpec().build(3), GAINS, 20.0, 5)
    border = theory.largest_loss()
    assert 0.7 < border < 0.85
    assert theory.mean_square_radius(border - 0.01) < 1.0 < theory.mean_square_radius(border + 0.01)
    beyond = theory.rms_disagreement(PHASES, np.zeros(3), border + 0.1, 400)
    below = theory.rms_disagreement(PHASES, np.zeros(3), border - 0.1, 400)
    assert beyond[400] > beyond[200] > 2.0 * beyond[100]
    assert below[400] < 0.5 * below[200]


def test_lower_gains_bear_more_loss() -> None:
    low = Gains(1.0e-3, 1.0e-6, 1.0e-3)
    graph = CompleteSpec().build(3)
    assert LossyConsensus.of(graph, low, 20.0, 5).largest_loss() > 0.97
    assert LossyConsensus.of(graph, Gains(1.0e-1, 1.0e-2, 1.0e-1), 20.0, 5).largest_loss() == 0.0


def test_held_values_and_large_formations_are_refused_in_a_sentence() -> None:
    held = LossyConsensus.of(CompleteSpec().build(3), GAINS, 20.0, 5, "hold")
    assert held.mean_square_radius(0.5) < 1.0
    with pytest.raises(ValueError, match="a lost message leaves an error at the nominal rate"):
        held.rms_disagreement(PHASES, np.zeros(3), 0.5, 3)
    with pytest.raises(ValueError, match="12 satellites with 132 edges"):
        LossyConsensus.of(CompleteSpec().build(12), GAINS, 20.0)
    with pytest.raises(ValueError, match="for the linear consensus on reference phases"):
        lossy_consensus(shipped("byzantine"))
