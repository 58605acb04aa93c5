# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every figure by its formula over whole arrays, for any blocks of steps and any runs side by side."""

import math
from typing import Any

import numpy as np
import pytest

from figure_formulas import FORMULAS
from figure_reductions import total
from random_flights import (
    bits,
    blocks,
    expectation_of,
    fewest_satellites,
    flights,
    one_flight,
    reduced,
    shape,
)
from satform.common.spec import specs
from satform.evaluation.evaluate import figures_of
from satform.evaluation.flight_figures import FlightFigures
from satform.evaluation.reducers import added_in_order
from satform.scenario.expectation import ComputedFrom

KINDS = sorted(
    kind for kind, spec in specs("satform.metrics").items() if spec.computed_from is ComputedFrom.BLOCKS
)
SEEDS = range(8)
NAMES = ("a", "b", "c", "d")


@pytest.mark.parametrize("kind", KINDS)
def test_a_figure_is_that_of_its_formula_for_any_blocks_and_any_runs_beside(kind: str) -> None:
    known = 0
    for seed in SEEDS:
        rng = np.random.default_rng([seed, *kind.encode()])
        flown = flights(rng, 3, fewest_satellites(kind))
        steps = flown[0].steps
        expectation = expectation_of(kind, rng, flown[0])
        expected = [FORMULAS[kind](expectation, flight) for flight in flown]
        measured = [figures_of([expectation], flight.record, None, flight.setting)[0] for flight in flown]
        # A zero has no sign here.
        assert bits(np.array(measured) + 0.0) == bits(np.array(expected) + 0.0), f"seed {seed}"
        known += sum(not math.isnan(figure) for figure in measured)
        some = sorted(set(rng.integers(1, steps, 4).tolist())) if steps > 1 else []
        for cuts in (some, list(range(1, steps))):
            found = reduced(expectation.reducer(shape(*flown)), flown, cuts)
            assert bits(found) == bits(measured), f"seed {seed}, blocks from {cuts}"
        alone = [reduced(expectation.reducer(shape(flight)), [flight], some) for flight in flown]
        assert bits(np.concatenate(alone)) == bits(measured), f"seed {seed}, alone"
    # Where no figure was known there would be nothing to compare.
    assert known >= 2


def test_every_kind_has_a_formula_and_a_reducer_but_those_of_loops_and_of_links() -> None:
    assert sorted(FORMULAS) == KINDS
    others = {
        kind: spec.computed_from for kind, spec in specs("satform.metrics").items() if kind not in KINDS
    }
    # The figures of links are those of test_link_figures.py, those of navigation of two modules of their own.
    assert others == {
        "spectral_radius": ComputedFrom.LOOPS,
        "delivered_connectivity": ComputedFrom.RECORD,
        "delivered_fraction": ComputedFrom.RECORD,
        "link_margin": ComputedFrom.RECORD,
        "relative_navigation_error": ComputedFrom.RECORD,
        "relative_range_error": ComputedFrom.RECORD,
        "central_error_ratio": ComputedFrom.RECORD,
    }


def held_bytes(thing: Any, seen: set[int]) -> int:
    """Bytes of all arrays that an object refers to, and of the arrays that these are views of."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        return thing.nbytes if thing.base is None else held_bytes(thing.base, seen)
    if isinstance(thing, dict):
        return sum(held_bytes(own, seen) for own in thing.values())
    cells = [cell.cell_contents for cell in getattr(thing, "__closure__", None) or ()]
    return sum(held_bytes(own, seen) for own in (*cells, *getattr(thing, "__dict__", {}).values()))


@pytest.mark.parametrize("kind", KINDS)
def test_the_memory_of_a_figure_does_not_grow_with_the_flight_nor_with_its_blocks(kind: str) -> None:
    rng = np.random.default_rng([1, *kind.encode()])
    expectation = expectation_of(kind, rng, one_flight(rng, 10, NAMES, 1.0, turning=True))
    held = []
    for steps, size in ((20, 10), (400, 10), (400, 100)):
        flight = one_flight(np.random.default_rng(7), steps, NAMES, 1.0, turning=True)
        reducer = expectation.reducer(shape(flight))
        reduced(reducer, [flight], list(range(size, steps, size)))
        held.append(held_bytes(reducer, set()))
    assert max(held) <= held[0] + 64


def test_several_expectations_are_figured_together() -> None:
    rng = np.random.default_rng(5)
    flown = flights(rng, 4, fewest=4)
    expectations = [expectation_of(kind, rng, flown[0]) for kind in KINDS]
    figures = FlightFigures(expectations, shape(*flown))
    for block in blocks(flown, list(range(1, flown[0].steps)), figures.needs):
        figures.update(block)
    expected = [figures_of(expectations, flight.record, None, flight.setting) for flight in flown]
    assert bits(figures.figures().T.ravel()) == bits(np.ravel(expected))
    assert (figures.whole_records, figures.of_loops) == ((), ())


@pytest.mark.parametrize("width", [1, 3, 63, 64, 200])
def test_rows_are_added_in_order_however_many_numbers_they_have(width: int) -> None:
    values = np.random.default_rng(width).standard_normal((40, width)) * 10.0 ** np.arange(-20, 20)[:, None]
    expected = [total(column) for column in values.T.tolist()]
    assert added_in_order(np.zeros(()), values).tolist() == expected
    assert added_in_order(added_in_order(np.zeros(()), values[:7]), values[7:]).tolist() == expected
