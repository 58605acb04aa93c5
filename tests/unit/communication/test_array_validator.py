# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages with lists are accepted and rejected by the rules of messages without."""

import math

import pytest

from satform.communication.array_layout import ArrayLayout
from satform.communication.array_validator import ArrayValidator
from satform.communication.message_validator import RejectionCounter
from satform.communication.sim_time import Stamps

FORM = ArrayLayout(
    "Made",
    [
        ("header.stamp.sec", "int32", 0),
        ("header.stamp.nanosec", "uint32", 0),
        ("header.frame_id", "string", 0),
        ("step", "uint64", 0),
        ("values", "float64", 3),
    ],
    "lvlh",
)


def message(step: int, *values: float, stamp: tuple[int, int] | None = None) -> bytes:
    """A message of a step of half a second."""
    return FORM.pack(stamp or divmod(step * 500_000_000, 10**9), {"step": step, "values": values})


def validated(data: bytes, *, exact: bool = True) -> tuple[bool, list[str], int]:
    """Whether a message is accepted where step 4 is due, why it is rejected, and repetitions."""
    rejections = RejectionCounter()
    validator = ArrayValidator("/made", FORM, rejections, Stamps(0.5, 500_000_000), exact=exact)
    found = validator.validate(data, 4, 5)
    if found is not None:
        assert (found.seconds, found.nanoseconds, found.step) == (2, 0, 4)
        assert found.fields["values"].tolist() == [1.0, -2.0, 1e15]
    return found is not None, [reason for _, reason in rejections.counts], validator.repeated


def test_a_message_that_is_due_is_accepted() -> None:
    assert validated(message(4, 1.0, -2.0, 1e15)) == (True, [], 0)


def test_a_message_of_an_earlier_step_is_a_repetition() -> None:
    assert validated(message(3, 1.0, 2.0, 3.0)) == (False, [], 1)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "another form"),
        (message(4, 1.0, 2.0, 3.0)[:-1], "another form"),
        (message(6, 1.0, 2.0, 3.0), "a step that is not due yet"),
        (message(4, 1.0, 2.0, 3.0, stamp=(1, 500_000_000)), "a stamp that contradicts its step"),
        (message(4, 1.0, math.nan, 3.0), "not finite"),
        (message(4, -math.inf, 2.0, 3.0), "not finite"),
        (message(4, 1.0, 2.0, -1.1e15), "out of range"),
    ],
)
def test_what_no_node_sends_is_rejected_and_counted(data: bytes, reason: str) -> None:
    assert validated(data) == (False, [reason], 0)


def test_a_stamp_of_an_earlier_step_is_accepted_where_the_values_may_be_older() -> None:
    rejections = RejectionCounter()
    validator = ArrayValidator("/made", FORM, rejections, Stamps(0.5, 500_000_000), exact=False)
    found = validator.validate(message(4, 1.0, 2.0, 3.0, stamp=(1, 0)), 4, 5)
    assert found is not None
    assert (found.seconds, found.step) == (1, 4)


def test_a_field_that_is_no_number_has_no_layout() -> None:
    header = [("header.stamp.sec", "int32", 0), ("header.stamp.nanosec", "uint32", 0)]
    with pytest.raises(ValueError, match="text is a string, neither a number nor a list of numbers"):
        ArrayLayout("Made", [*header, ("header.frame_id", "string", 0), ("text", "string", 0)], "lvlh")
    with pytest.raises(ValueError, match="does not begin with a header"):
        ArrayLayout("Made", [("step", "uint64", 0)], "lvlh")
