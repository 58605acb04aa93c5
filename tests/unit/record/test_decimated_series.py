# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Series that are kept while flights go on have the bits of every k-th row of the whole records."""

from dataclasses import replace

import numpy as np
import pytest

from flights import shortened
from satform import FlightRecord, simulate
from satform.record.derived import COLUMNS
from satform.record.flight_block import FlightBlock
from satform.record.quantities import QUANTITIES
from satform.record.series import DecimatedSeries

STEPS = 60


@pytest.fixture(scope="module")
def records() -> tuple[FlightRecord, FlightRecord]:
    """Two flights with sensors, filters and thrusters; in one a satellite does not fly for some steps."""
    flown = simulate(shortened("noisy_navigation", 2.0 * STEPS))
    other = simulate(shortened("noisy_navigation", 2.0 * STEPS, "seed=77"))
    reference, acceleration = flown.reference_position.copy(), flown.acceleration.copy()
    reference[20:35, 1], acceleration[20:35, 1] = np.nan, 0.0
    return replace(flown, reference_position=reference, acceleration=acceleration), other


def kept(records: tuple[FlightRecord, ...], quantity: str, every: int, cuts: list[int]) -> np.ndarray:
    series = DecimatedSeries(quantity, every)
    for begin, end in zip([0, *cuts], [*cuts, STEPS], strict=True):
        last = end == STEPS
        held = {
            name: np.stack(
                [getattr(own, name)[begin : end + (last and QUANTITIES[name].of_states)] for own in records],
                1,
            )
            for name in series.needs
        }
        first = records[0]
        series.update(FlightBlock(first.satellites, first.step, begin, end - begin, len(records), last, held))
    return series.series()


@pytest.mark.parametrize("quantity", COLUMNS)
@pytest.mark.parametrize("every", [1, 4, 7, 1000])
def test_the_kept_rows_are_those_of_the_record_for_any_blocks(
    records: tuple[FlightRecord, FlightRecord], quantity: str, every: int
) -> None:
    expected = [np.asarray(getattr(own, quantity), dtype=np.float64)[::every] for own in records]
    for cuts in ([], [1, 2, 30, 59], list(range(1, STEPS))):
        found = kept(records, quantity, every, cuts)
        assert found.shape == (2, *expected[0].shape)
        assert all(run.tobytes() == own.tobytes() for run, own in zip(found, expected, strict=True))


def test_only_what_is_needed_is_asked_for() -> None:
    assert DecimatedSeries("rate", 2).needs == {"rate"}
    assert DecimatedSeries("tracking_error", 2).needs == {"position", "reference_position"}


def test_what_cannot_be_kept_is_named() -> None:
    with pytest.raises(KeyError, match="speed"):
        DecimatedSeries("speed", 2)
    with pytest.raises(ValueError, match="every has to be 1 or more; found 0"):
        DecimatedSeries("rate", 0)
