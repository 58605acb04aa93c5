# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight in blocks of steps: what they hold and what follows from it has the bits of the whole record."""

from dataclasses import replace

import numpy as np
import pytest

from flights import shortened
from satform import FlightRecord, simulate
from satform.record.derived import COLUMNS, DERIVED, absent_of_rows
from satform.record.flight_block import FlightBlock, base_quantities
from satform.record.quantities import QUANTITIES

STEPS = 400
"""Of the flight that is cut into blocks."""


@pytest.fixture(scope="module")
def record() -> FlightRecord:
    """A flight with sensors, filters and thrusters, in which a satellite does not fly for some steps."""
    flown = simulate(shortened("noisy_navigation", 800.0))
    reference, acceleration = flown.reference_position.copy(), flown.acceleration.copy()
    reference[STEPS - 150 :, 1], acceleration[STEPS - 150 :, 1] = np.nan, 0.0
    return replace(flown, reference_position=reference, acceleration=acceleration)


def part(record: FlightRecord, first: int, steps: int, runs: int = 1) -> FlightBlock:
    """Some steps of a record, as often side by side as there are runs."""
    last = first + steps == record.steps
    rows = {record.steps: steps, record.steps + 1: steps + last}
    quantities = {
        name: np.repeat(values[first : first + rows.get(len(values), 0), None], runs, axis=1)
        for name, values in record.quantities().items()
    }
    return FlightBlock(record.satellites, record.step, first, steps, runs, last, quantities)


def test_a_whole_record_is_one_last_block(record: FlightRecord) -> None:
    block = FlightBlock.of(record)
    assert (block.first_step, block.steps, block.runs, block.last) == (0, record.steps, 1, True)
    assert block.position.shape == (record.steps + 1, 1, len(record.satellites), 3)
    assert all(np.shares_memory(getattr(block, name), getattr(record, name)) for name in ("position", "rate"))


def test_the_numbers_of_a_row_are_known_without_a_record(record: FlightRecord) -> None:
    for name in COLUMNS:
        assert COLUMNS[name].components == np.prod(getattr(record, name).shape[2:]), name


@pytest.mark.parametrize("name", sorted({*DERIVED} - {"effort"}))
def test_derived_quantities_have_the_bits_of_the_record(record: FlightRecord, name: str) -> None:
    expected = getattr(record, name)
    for runs in (1, 2):
        blocks = [part(record, 0, 1, runs), part(record, 1, 70, runs), part(record, 71, STEPS - 71, runs)]
        found = np.concatenate([getattr(block, name) for block in blocks])
        assert found.shape == (len(expected), runs, *expected.shape[1:])
        assert all(found[:, run].tobytes() == expected.tobytes() for run in range(runs))


def test_who_does_not_fly_at_states_is_as_in_the_record(record: FlightRecord) -> None:
    assert record.absent.any()
    blocks = [part(record, 0, 100), part(record, 100, STEPS - 100)]
    found = np.concatenate([absent_of_rows(block.absent, block.steps + block.last) for block in blocks])
    assert np.array_equal(found[:, 0], absent_of_rows(record.absent, record.steps + 1))
    assert [block.any_absent for block in blocks] == [bool(block.absent.any()) for block in blocks]


def test_a_quantity_that_a_block_does_not_hold_is_named(record: FlightRecord) -> None:
    block = FlightBlock(record.satellites, record.step, 0, 1, 1, False, {"rate": record.rate[:1, None]})
    with pytest.raises(AttributeError, match="holds no position; it holds rate"):
        block.position  # noqa: B018 - the access is what fails
    with pytest.raises(AttributeError, match="holds no position, reference_position; it holds rate"):
        block.tracking_error  # noqa: B018


def test_every_derived_quantity_says_what_it_is_made_of(record: FlightRecord) -> None:
    assert {*DERIVED} == {*COLUMNS} - {*QUANTITIES}
    assert base_quantities(["rate", "tracking_error"]) == {"rate", "position", "reference_position"}
    with pytest.raises(KeyError, match="speed"):
        base_quantities(["speed"])
    for name in {*DERIVED} - {"effort"}:
        made_of = {own: getattr(record, own)[:, None] for own in base_quantities([name])}
        alone = FlightBlock(record.satellites, record.step, 0, record.steps, 1, True, made_of)
        assert getattr(alone, name).tobytes() == getattr(record, name).tobytes()
