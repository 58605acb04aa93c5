# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight's record: its derived arrays by hand, and differences down to the last bit."""

import dataclasses
import functools

import numpy as np
import pytest

from flights import shortened
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.record.quantities import OPTIONAL_EQUIPMENT, QUANTITIES, without

STEPS, COUNT = 4, 3


@functools.cache
def record() -> FlightRecord:
    """A flight of four steps and three satellites, filled with numbers that mean nothing."""
    flight = simulate(shortened("formation_pointing", 2.0))
    generator = np.random.default_rng(7)
    # No satellite has filters or plans, so that what they give has no rows; here it has.
    more = {
        name: array
        for equipment in OPTIONAL_EQUIPMENT
        for name, array in without(equipment, COUNT, STEPS).items()
    }
    arrays = {name: getattr(flight, name) for name in QUANTITIES} | more
    numbers = {name: generator.normal(size=array.shape) for name, array in arrays.items()}
    return dataclasses.replace(flight, **numbers)


def changed(name: str, place: tuple[int, ...], value: float) -> FlightRecord:
    array = getattr(record(), name).copy()
    array[place] = value
    return dataclasses.replace(record(), **{name: array})


def test_time_begins_at_zero_and_has_one_more_moment_than_steps() -> None:
    assert record().steps == STEPS
    assert record().time.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]


def test_the_position_error_leaves_out_the_state_after_the_last_step() -> None:
    flight = record()
    assert flight.position_error.shape == (STEPS, COUNT, 3)
    np.testing.assert_array_equal(
        flight.position_error[2, 1], flight.position[2, 1] - flight.reference_position[2, 1]
    )


def test_tracking_error_and_control_are_lengths() -> None:
    position, reference = np.zeros((2, 1, 3)), np.zeros((1, 1, 3))
    position[0, 0] = 1.0, 2.0, 2.0
    flight = dataclasses.replace(
        record(),
        position=position,
        reference_position=reference,
        acceleration=np.array([[[2.0, 3.0, 6.0]]]),
    )
    assert flight.tracking_error.tolist() == [[3.0]]
    assert flight.control.tolist() == [[7.0]]


def test_a_record_does_not_differ_from_its_equal() -> None:
    assert record().differences(record()) == []


@pytest.mark.parametrize("name", QUANTITIES)
def test_the_last_bit_of_one_number_is_noticed_and_its_step_named(name: str) -> None:
    place = (2, *([1] * (getattr(record(), name).ndim - 1)))
    other = changed(name, place, np.nextafter(getattr(record(), name)[place], np.inf))
    assert record().differences(other) == [f"{name}: 1 numbers differ, the first at step 2"]


def test_the_sign_of_zero_is_a_difference_and_one_nan_is_like_another() -> None:
    zero, minus = changed("rate", (3, 0), 0.0), changed("rate", (3, 0), -0.0)
    assert zero.differences(minus) == ["rate: 1 numbers differ, the first at step 3"]
    assert changed("rate", (1, 1), np.nan).differences(changed("rate", (1, 1), np.nan)) == []


def test_the_first_of_several_differences_is_named() -> None:
    array = record().velocity.copy()
    array[1:, 0, 2] += 1.0
    assert record().differences(dataclasses.replace(record(), velocity=array)) == [
        "velocity: 4 numbers differ, the first at step 1"
    ]


def test_arrays_that_do_not_lie_in_one_piece_are_compared_too() -> None:
    strided = np.repeat(record().arc_length, 2, axis=1)[:, ::2]
    assert not strided.flags.contiguous
    assert record().differences(dataclasses.replace(record(), arc_length=strided)) == []


def test_a_shorter_flight_differs_in_its_shapes() -> None:
    shorter = dataclasses.replace(record(), acceleration=record().acceleration[:-1])
    assert record().differences(shorter) == ["acceleration: shapes (4, 3, 3) and (3, 3, 3)"]


def test_other_satellites_and_another_step_are_differences() -> None:
    other = dataclasses.replace(record(), satellites=("sat1", "sat2"), step=0.25)
    assert record().differences(other) == [
        "satellites: ('sat1', 'sat2', 'sat3') and ('sat1', 'sat2')",
        "step: 0.5 s and 0.25 s",
    ]


def test_every_array_of_a_record_is_a_quantity() -> None:
    arrays = {name: value for name, value in vars(record()).items() if isinstance(value, np.ndarray)}
    assert list(QUANTITIES) == [*arrays]
    for name, quantity in QUANTITIES.items():
        assert arrays[name].shape == (STEPS + quantity.of_states, COUNT, *quantity.shape), name
