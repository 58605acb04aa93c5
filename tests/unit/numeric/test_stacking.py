# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Stacking dataclasses of arrays: row i of the whole is satellite i, or a sentence why it cannot be."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from satform.numeric.stacking import stack

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gains:
    slope: Array
    per_axis: Array


@dataclass(frozen=True)
class Law:
    gains: Gains
    limit: Array | None
    step: float = 0.5
    mode: str = "hold"


@dataclass(frozen=True)
class OtherGains:
    slope: Array
    per_axis: Array


def gains(number: int) -> Gains:
    return Gains(np.float64(number), np.array([1.0, 2.0, 3.0]) * number)


def law(number: int, **other: object) -> Law:
    return Law(**{"gains": gains(number), "limit": None, **other})


def test_every_array_gains_a_leading_satellite_axis() -> None:
    whole = stack([gains(number) for number in (1, 2, 3, 4)])
    assert whole.slope.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert whole.per_axis.shape == (4, 3)
    assert whole.per_axis[2].tolist() == [3.0, 6.0, 9.0]


def test_a_scalar_array_of_no_axes_belongs_to_a_satellite_too() -> None:
    assert stack([Gains(np.asarray(7.0), np.zeros(3)), gains(2)]).slope.tolist() == [7.0, 2.0]


def test_one_item_alone_becomes_a_formation_of_one() -> None:
    whole = stack([gains(5)])
    assert whole.slope.shape == (1,)
    assert whole.per_axis.shape == (1, 3)


def test_nested_dataclasses_are_stacked_field_by_field() -> None:
    whole = stack([law(1), law(2)])
    assert isinstance(whole.gains, Gains)
    assert whole.gains.per_axis.tolist() == [[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]


def test_what_is_no_array_belongs_to_the_formation_and_stays_as_it_is() -> None:
    whole = stack([law(1), law(2)])
    assert (whole.limit, whole.step, whole.mode) == (None, 0.5, "hold")


def test_stacking_leaves_the_items_as_they_were() -> None:
    items = [gains(1), gains(2)]
    stack(items).per_axis[:] = 0.0
    assert [item.per_axis.tolist() for item in items] == [[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]


@pytest.mark.parametrize("mode", ["step", "mode"])
def test_a_plain_value_that_differs_between_satellites_is_refused_by_name(mode: str) -> None:
    with pytest.raises(ValueError, match=f"Law.{mode}: it differs"):
        stack([law(1), law(2, **{mode: 0.25 if mode == "step" else "extrapolate"})])


@pytest.mark.parametrize(
    "limits",
    [
        (np.float64(1.0), None),
        (None, np.float64(1.0)),
        (np.ones(3), None),
        (None, np.ones(3)),
        (np.float64(1.0), 1.0),
    ],
)
def test_a_field_that_is_an_array_for_one_satellite_only_is_refused_by_name(limits: tuple) -> None:
    with pytest.raises(ValueError, match=r"Law\.limit: it differs"):
        stack([law(1, limit=limits[0]), law(2, limit=limits[1])])


def test_arrays_of_different_shapes_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"Gains\.per_axis: its shape differs"):
        stack([gains(1), Gains(np.float64(1.0), np.ones(2))])


def test_different_kinds_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="different kinds: Gains, OtherGains"):
        stack([gains(1), OtherGains(np.float64(1.0), np.ones(3))])


def test_a_nested_dataclass_that_one_satellite_lacks_is_refused() -> None:
    with pytest.raises(ValueError, match="different kinds: Gains, NoneType"):
        stack([law(1), law(2, gains=None)])


@pytest.mark.parametrize("items", [[1.0, 1.0], [Gains, Gains]])
def test_what_is_no_dataclass_is_refused(items: list) -> None:
    with pytest.raises(ValueError, match="not a dataclass"):
        stack(items)
