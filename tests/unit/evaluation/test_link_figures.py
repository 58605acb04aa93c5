# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of links by their definitions, counted message by message and window by window."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from random_flights import one_flight
from satform.common.spec import specs
from satform.communication.physical_links import LinkStates
from satform.record.flight_record import FlightRecord
from satform.record.link_history import LinkHistory

NAMES = ("a", "b", "c", "d")
STEPS = 12
STEP = 0.5
SEEDS = range(25)


def random_links(rng: np.random.Generator) -> LinkHistory:
    """Some edges of four satellites, some of them physical; each sends and delivers at random."""
    pairs = [(sender, receiver) for sender in range(4) for receiver in range(4) if sender != receiver]
    edges = np.array([pair for pair in pairs if rng.random() < 0.8] or pairs)
    physical = np.flatnonzero(rng.random(len(edges)) < 0.5)
    linked = rng.random((STEPS, len(edges))) < 0.9
    sent = linked & (rng.random(linked.shape) < 0.8)
    delivered = sent & (rng.random(linked.shape) < 0.5)
    any_numbers = rng.standard_normal((STEPS, len(physical)))
    margin = 5.0 * rng.standard_normal(any_numbers.shape)
    if margin.size and rng.random() < 0.3:
        margin[tuple(int(rng.integers(size)) for size in margin.shape)] = -math.inf
    states = LinkStates(any_numbers, np.isinf(margin), any_numbers, margin, any_numbers, any_numbers)
    return LinkHistory(NAMES, edges, physical, states if len(physical) else None, linked, sent, delivered)


def steps_of(expectation: Any) -> list[int]:
    """Steps that begin in the stretch; none where the flight ends before the stretch does."""
    end = STEPS * STEP if expectation.before is None else expectation.before
    if end > STEPS * STEP:
        return []
    return [k for k in range(STEPS) if expectation.after <= k * STEP < end]


def edges_of(expectation: Any, links: LinkHistory) -> list[int]:
    """Edges between two satellites that are meant."""
    meant = expectation.satellites or NAMES
    return [e for e, pair in enumerate(links.edges.tolist()) if all(NAMES[own] in meant for own in pair)]


def statistic(expectation: Any, values: list[float]) -> float:
    if not values:
        return math.nan
    return {"minimum": min(values), "mean": math.fsum(values) / len(values), "maximum": max(values)}[
        expectation.statistic
    ]


def delivered_fraction(expectation: Any, links: LinkHistory) -> float:
    messages = [(k, e) for k in steps_of(expectation) for e in edges_of(expectation, links)]
    sent = sum(bool(links.sent[message]) for message in messages)
    return sum(bool(links.delivered[message]) for message in messages) / sent if sent else math.nan


def delivered_connectivity(expectation: Any, links: LinkHistory) -> float:
    window = 1 if expectation.window_length is None else round(expectation.window_length / STEP)
    steps, members = steps_of(expectation), list(expectation.satellites or NAMES)
    found = []
    for begin in range(0, len(steps) - window + 1, window):
        laplacian = np.zeros((len(members), len(members)))
        for e in edges_of(expectation, links):
            if any(links.delivered[k, e] for k in steps[begin : begin + window]):
                sender, receiver = (members.index(NAMES[own]) for own in links.edges[e])
                laplacian[receiver, receiver] += 1.0
                laplacian[receiver, sender] -= 1.0
        found.append(sorted(np.linalg.eigvals(laplacian).real.tolist())[1])
    return statistic(expectation, found)


def link_margin(expectation: Any, links: LinkHistory) -> float:
    if links.states is None:
        return math.nan
    meant = [p for p, e in enumerate(links.physical.tolist()) if e in edges_of(expectation, links)]
    margins = [float(links.states.margin[k, p]) for k in steps_of(expectation) for p in meant]
    if expectation.statistic != "minimum":
        margins = [margin for margin in margins if margin != -math.inf]
    return statistic(expectation, margins)


FORMULAS = {
    "delivered_connectivity": delivered_connectivity,
    "delivered_fraction": delivered_fraction,
    "link_margin": link_margin,
}


def record_of(rng: np.random.Generator, links: LinkHistory) -> FlightRecord:
    flown = one_flight(rng, STEPS, NAMES, STEP, turning=False).record
    return replace(flown, link_source=lambda _: links)


@pytest.mark.parametrize("kind", sorted(FORMULAS))
def test_a_figure_of_links_is_that_of_its_definition(kind: str) -> None:
    known = 0
    for seed in SEEDS:
        rng = np.random.default_rng([seed, *kind.encode()])
        links, spec = random_links(rng), specs("satform.metrics")[kind]
        fields: dict[str, Any] = {
            "satellites": [None, tuple(rng.permutation(NAMES)[: rng.integers(2, 5)].tolist())][
                rng.integers(2)
            ],
            "after": float(rng.choice([0.0, 1.5, 2.2])),
            "before": [None, 4.0, 5.2, STEPS * STEP, 7.0][rng.integers(5)],
            "statistic": str(rng.choice(["minimum", "mean", "maximum"])),
            "window_length": [None, 1.0, 2.0][rng.integers(3)],
        }
        data = {name: own for name, own in fields.items() if name in spec.model_fields}
        expectation = spec.model_validate({"below": 1.0, "source": "none", **data})
        expected = FORMULAS[kind](expectation, links)
        measured = expectation.measure(record_of(rng, links))  # type: ignore[attr-defined]
        assert measured == pytest.approx(expected, abs=1e-9, nan_ok=True), f"seed {seed}, {data}"
        known += not math.isnan(measured)
    assert known >= 10


@pytest.mark.parametrize("kind", sorted(FORMULAS))
def test_a_record_without_links_has_no_figure_of_them(kind: str) -> None:
    flown = one_flight(np.random.default_rng(1), STEPS, NAMES, STEP, turning=False).record
    expectation = specs("satform.metrics")[kind].model_validate({"below": 1.0, "source": "none"})
    assert math.isnan(expectation.measure(flown))  # type: ignore[attr-defined]
