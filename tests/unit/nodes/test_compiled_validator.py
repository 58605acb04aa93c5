# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The compiled validator decides about every message as the one in Python does."""

import math
import struct
from functools import cache
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from flights import shipped
from satform.communication.message_validator import MessageRules, MessageValidator, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import TopicPlan
from satform.flight.compile import compile_scenario
from satform_nodes.transport import compiled
from satform_nodes.transport.compiled import CompiledValidator
from satform_nodes.transport.message_forms import form_of, largest_number, unbounded_fields

STEP = 500_000_000
"""Length of a step, ns."""

FIRST, LAST = 3, 5
"""Steps that are due."""

TOPICS = {
    "command": "triangle",
    "state": "triangle",
    "arc_length": "triangle",
    "motion": "directed_triangle",
    "attitude": "formation_pointing",
    "attitude_estimate": "formation_pointing",
    "link_conditions": "radio_links_spread",
    "measurements": "bearing_only_swarm",
    "navigation_estimate": "bearing_only_swarm",
}
"""A scenario in which there is a topic of each kind."""

pytestmark = pytest.mark.skipif(
    not compiled.is_used(), reason="the compiled part is not built or switched off"
)

SPECIAL = [
    0.0,
    -0.0,
    1.0,
    1e15,
    -1e15,
    math.nextafter(1e15, 2e15),
    1e30,
    1e308,
    math.inf,
    -math.inf,
    math.nan,
]


@cache
def topics(name: str) -> TopicPlan:
    """Plan of the topics of a shipped scenario."""
    return compile_scenario(shipped(name)).topics


def both(kind: str, further: bool) -> tuple[list[MessageValidator], list[RejectionCounter], Any]:
    """A validator in Python and a compiled one, their counters, and the form of the messages."""
    plan = topics(TOPICS[kind])
    form = form_of(kind, plan, 0)
    counters = [RejectionCounter(), RejectionCounter()]
    rules = MessageRules(
        exact=kind in ("command", "attitude"),
        unbounded=unbounded_fields(kind, plan, 0),
        largest=largest_number(kind),
        further=(lambda numbers: "odd" if numbers[2] % 2 else "") if further else None,
    )
    validators = [
        made(f"/sat1/{kind}", form, counter, Stamps(0.5, STEP), rules)
        for made, counter in zip((MessageValidator, CompiledValidator), counters, strict=True)
    ]
    return validators, counters, form


def message(form: Any, step: int, stamp: int, values: list[float], lengths: bool) -> bytes:
    """A message with these numbers in its fields that take any, as often as they have to be repeated."""
    numbers: list[float] = []
    for index, name in enumerate(form.fields[3:]):
        value = values[index % len(values)]
        if name.endswith(".length"):
            known = sum(other.startswith(f"{name.removesuffix('.length')}[") for other in form.fields)
            numbers.append(known if lengths else known + 1)
        elif form.dtype.fields[name][0].kind == "f":
            numbers.append(value)
        else:
            bits = 8 * form.dtype.fields[name][0].itemsize
            numbers.append(int(abs(value)) % 2 ** (bits - 1) if math.isfinite(value) else 0)
    return bytes(form.pack(*divmod(stamp, 10**9), step, *numbers))


@pytest.mark.parametrize("kind", sorted(TOPICS))
@given(
    step=st.sampled_from([0, FIRST - 1, FIRST, LAST, LAST + 1, 2**63, 2**64 - 1]),
    offset=st.sampled_from([0, 0, 0, -STEP, STEP, 1, -1]),
    values=st.lists(st.sampled_from(SPECIAL) | st.floats(), min_size=1, max_size=4),
    lengths=st.sampled_from([True, True, False]),
    cut=st.sampled_from([0, 0, 0, 1, 30]),
    flip=st.none() | st.tuples(st.integers(0, 10_000), st.integers(0, 255)),
    further=st.booleans(),
)
@example(step=4, offset=0, values=[1e308], lengths=True, cut=0, flip=None, further=False)
@example(step=4, offset=0, values=[math.inf, -math.inf], lengths=True, cut=0, flip=None, further=True)
def test_the_same_messages_are_accepted_rejected_and_counted(
    kind: str,
    step: int,
    offset: int,
    values: list[float],
    lengths: bool,
    cut: int,
    flip: tuple[int, int] | None,
    further: bool,
) -> None:
    validators, counters, form = both(kind, further)
    stamp = max(0, min(step, 1000) * STEP + offset)
    data = bytearray(message(form, step, stamp, values, lengths))
    if flip is not None:
        data[flip[0] % len(data)] = flip[1]
    sent = bytes(data[: len(data) - cut])
    found = [validator.validate(sent, FIRST, LAST) for validator in validators]
    # As text: a number that is none differs from itself, and True is equal to 1.
    assert repr(found[0]) == repr(found[1])
    assert counters[0].counts == counters[1].counts
    assert validators[0].repeated == validators[1].repeated


def test_the_bits_of_numbers_stay() -> None:
    (_, fast), _, form = both("command", further=False)
    bits = [0x3FB999999999999A, 0x8000000000000000, 0x0000000000000001, 0x430C6BF526340000]
    values = [struct.unpack("<d", struct.pack("<Q", number))[0] for number in bits]
    found = fast.validate(message(form, FIRST, FIRST * STEP, values, lengths=True), FIRST, LAST)
    assert found is not None
    assert [struct.unpack("<Q", struct.pack("<d", value))[0] for value in found[3:7]] == bits


@pytest.mark.parametrize(
    ("fields", "constant"),
    [
        ((("d", 4, -1),) * 4, b""),
        ((("i", 4, -1), ("I", 8, -1), ("Q", 12, -1), ("d", 100, -1)), b""),
        ((("i", 4, -1), ("I", 8, -1), ("Q", 12, -1), ("x", 20, -1)), b""),
        ((("i", 4, -1), ("I", 8, -1), ("Q", 12, -1), ("d", 20, -1)), b"x" * 100),
    ],
)
def test_what_is_no_message_is_not_read(fields: tuple[tuple[str, int, int], ...], constant: bytes) -> None:
    from satform_transport.hot_path import NumberCheck

    with pytest.raises(ValueError, match="message"):
        NumberCheck(40, fields, constant, STEP, True, 0, 0, 1e15)


def test_a_check_without_fields_reads_no_message() -> None:
    from satform_transport.hot_path import NumberCheck

    check = NumberCheck.__new__(NumberCheck)
    with pytest.raises(RuntimeError, match="has no fields"):
        check.check(b"", 0, 0)
    with pytest.raises(TypeError):
        check.__init__(40, "no fields")
    with pytest.raises(RuntimeError, match="has no fields"):
        check.check(bytes(40), 0, 0)
