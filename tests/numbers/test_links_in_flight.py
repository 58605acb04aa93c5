# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Delay, loss and rare messages flown by whole satellites over links, against an independent computation."""

from typing import Any

import numpy as np
import pytest

from satform.evaluation.event_reducers import LastOutside
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

pytestmark = pytest.mark.unmeasured

PERIMETER = 484422.4110
NOMINAL = PERIMETER / 6000.0
PHASES = (0.0, 30e3, -20e3)
DELAYS = (5.0, 50.0, 200.0, 500.0, 1000.0)

Flown = tuple[np.ndarray, np.ndarray]
"""Arc lengths and rates, shape (K + 1, formations, 3)."""

COMPLETE = [[0, 1, 1], [1, 0, 1], [1, 1, 0]]
LINE = [[0, 1, 0], [1, 0, 1], [0, 1, 0]]


def triangles(
    duration: float, neighbour_values: str, links: list[dict[str, float]], graphs: list[list[list[int]]]
) -> Scenario:
    """Formations of three side by side in one flight, which do not hear each other, each with its links."""
    names = [[f"f{number}_{letter}" for letter in "abc"] for number in range(len(links))]
    count = 3 * len(links)
    hears = np.zeros((count, count), dtype=int)
    edges: list[dict[str, Any]] = []
    for number, own in enumerate(links):
        hears[3 * number : 3 * number + 3, 3 * number : 3 * number + 3] = graphs[number]
        edges += [
            {"sender": names[number][speaker], "receiver": names[number][listener], **own}
            for listener, speaker in np.argwhere(np.array(graphs[number]))
        ]
    data = {
        "name": "side_by_side",
        "title": "Formations of three side by side",
        "text": "Flown by a test.",
        "orbit": {"period": 6000.0},
        "timing": {"step": 1.0, "duration": duration},
        "dynamics": {"kind": "cw"},
        "graph": {"kind": "matrix", "rows": hears.tolist()},
        "consensus": {
            "kind": "arc_length",
            "tracking_gain": 1e-3,
            "coupling_gain": 1e-6,
            "rate_gain": 1e-3,
            "neighbour_values": neighbour_values,
            "neighbour_timeout": 1e6,
        },
        "nominal_motion": {"rate": NOMINAL},
        "satellite_defaults": {
            # Agreement on the arc length does not depend on the curve; that of a point is soon computed.
            "curve": {"kind": "fixed_point", "position": [0.0, 100e3, 0.0]},
            "controller": {"kind": "coast"},
        },
        "satellites": [
            {"name": name, "arc_length": phase}
            for own in names
            for name, phase in zip(own, PHASES, strict=True)
        ],
        "links": {"edges": edges},
        "seed": 1,
    }
    return Scenario.model_validate(data)


def formations(record: FlightRecord) -> Flown:
    """Arc lengths and rates, shape (K + 1, formations, 3)."""
    return tuple(values.reshape(len(values), -1, 3) for values in (record.arc_length, record.rate))


def settling(places: np.ndarray) -> np.ndarray:
    """Time from which the spread of each formation stays within 1 % of that at the start, s."""
    spreads, outside = np.ptp(places, axis=-1), LastOutside()
    outside.add(~(spreads <= 0.01 * spreads[0]))
    return outside.settled()


def flown(duration: float, neighbour_values: str, links: list[dict[str, float]], *others: Any) -> Flown:
    graphs = list(others) or [COMPLETE] * len(links)
    return formations(simulate(triangles(duration, neighbour_values, links, graphs)))


@pytest.fixture(scope="module")
def holding() -> Flown:
    """Formations that hold values: 6 with delays, the last in a line; 20 lossy; 5 with rare messages."""
    links = [{"delay": delay} for delay in (*DELAYS, 50.0)]
    links += [{"loss": chance} for chance in (0.2, 0.5, 0.8, 0.95) for _ in range(5)]
    links += [{"loss": 0.8, "period": 10.0}] * 5
    return flown(16000.0, "hold", links, *[COMPLETE] * 5, LINE, *[COMPLETE] * 25)


@pytest.mark.slow
def test_holding_delayed_values_slows_the_formation_to_the_known_fractions(holding: Flown) -> None:
    places, rates = holding
    fraction = rates[-1] / NOMINAL
    expected = [0.990099, 0.909091, 0.714286, 0.5, 0.333333]
    assert fraction[:5] == pytest.approx(np.tile(np.array(expected)[:, None], 3), abs=1e-4)
    assert fraction[5] == pytest.approx(np.full(3, 0.9375), rel=0.01)
    # In a line, the one in the middle, who hears two late neighbours, lags behind.
    assert places[-1, 5, 1] - places[-1, 5, [0, 2]] == pytest.approx([-1261.5, -1261.5], rel=0.01)


@pytest.mark.slow
def test_extrapolating_delayed_values_keeps_the_rate_and_settles_as_known() -> None:
    places, rates = flown(20000.0, "extrapolate", [{"delay": delay} for delay in (*DELAYS, 2000.0)])
    # Nobody is heard before the first word arrives; from then on it is as with a past of steady flight.
    expected = np.array([5019.0, 5088.0, 5335.0, 5885.0, 8580.0]) + DELAYS
    assert settling(places)[:5] == pytest.approx(expected, rel=0.01)
    assert rates[-1, :4] / NOMINAL == pytest.approx(np.ones((4, 3)), abs=1e-6)
    # Beyond 1965 s it is unstable, which takes its time to show.
    spread = np.ptp(places, axis=-1)
    assert spread[16000:, 5].max() > spread[11000:16000, 5].max()


@pytest.mark.slow
def test_losing_messages_slows_a_formation_that_holds_values_as_known(holding: Flown) -> None:
    rates = holding[1][:12001, 6:26]
    found = (rates[6000:].mean(axis=(0, 2)) / NOMINAL).reshape(4, 5).mean(axis=1)
    assert found == pytest.approx([0.9995, 0.9980, 0.9921, 0.9637], abs=0.002)


@pytest.mark.slow
def test_losing_messages_hardly_delays_a_formation_that_extrapolates() -> None:
    chances = np.repeat([0.0, 0.5, 0.8, 0.95, 0.99], 5)
    places, _ = flown(8000.0, "extrapolate", [{"loss": float(chance)} for chance in chances])
    found = settling(places).reshape(5, 5).mean(axis=1)
    known = np.array([5011.0, 5013.0, 5017.0, 5042.0, 5196.0])
    # Those figures are for satellites that know each other at the start; here they wait for the first word.
    wait = np.array([0.0, 1.0, 4.0, 19.0, 99.0])
    assert np.all(found > 0.99 * known)
    assert np.all(found < 1.01 * (known + wait))


@pytest.mark.slow
def test_rare_messages_hardly_delay_a_formation_that_extrapolates() -> None:
    chances = np.repeat([0.5, 0.8, 0.95], 5)
    links = [{"loss": float(chance), "period": 10.0} for chance in chances]
    places, rates = flown(14000.0, "extrapolate", links)
    found = settling(places).reshape(3, 5).mean(axis=1)
    known = np.array([5033.0, 5076.0, 5390.0])
    # As above: the first word takes the period times the odds of a loss.
    wait = np.array([10.0, 40.0, 190.0])
    assert np.all(found > 0.98 * known)
    assert np.all(found < 1.01 * (known + wait))
    assert rates[7000:].mean(axis=(0, 2)) / NOMINAL == pytest.approx(np.ones(15), abs=1e-3)


@pytest.mark.slow
def test_rare_messages_leave_a_formation_that_holds_values_slow_and_apart(holding: Flown) -> None:
    places, rates = (values[:12001, 26:] for values in holding)
    assert rates[6000:].mean() / NOMINAL == pytest.approx(0.915, abs=0.01)
    apart = np.ptp(places[6000:], axis=-1).max(axis=0)
    assert 500.0 < apart.mean() < 1500.0


def test_a_first_delay_of_all_links_moves_the_agreement_by_itself() -> None:
    """Cheap: with extrapolation, what comes of a delay begins when the first word has arrived."""
    places, _ = flown(400.0, "extrapolate", [{}, {"delay": 200.0}])
    spread = np.ptp(places, axis=-1)
    assert spread[:201, 1] == pytest.approx(50e3, abs=1e-6)
    # Then the disagreement that is heard is for as long that of the start, under which all fly on evenly.
    pull = np.diff(places[200:400, 1] - NOMINAL * np.arange(200, 400)[:, None], n=2, axis=0)
    assert pull[0].tolist() == pytest.approx(-1e-6 * (3.0 * np.array(PHASES) - sum(PHASES)), rel=3e-3)


def test_heavy_loss_loses_hardly_anything_to_a_formation_that_extrapolates() -> None:
    places, _ = flown(1500.0, "extrapolate", [{}, {"loss": 0.8}])
    spread = np.ptp(places, axis=-1)[1500]
    q = 1.5
    assert spread[0] == pytest.approx(50e3 * (3.0 * np.exp(-q) - np.exp(-3.0 * q)) / 2.0, rel=2e-3)
    assert spread[1] == pytest.approx(spread[0], rel=0.02)
