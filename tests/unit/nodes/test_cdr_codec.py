# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages as bytes, held against rosidl's own serialisation; simulated time as stamps."""

import struct
from functools import reduce
from typing import Any

import numpy as np
import pytest
import satform_msgs.msg
from geometry_msgs.msg import Point, PoseStamped, TransformStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from satform_msgs.msg import (
    ArcLength,
    Command,
    EarlyEnd,
    FormationStatus,
    GroupCommand,
    GroupPhase,
    GroupState,
    GroupTracking,
    LinkConditions,
    Measurements,
    NavigationEstimate,
    NodeReady,
    ParameterChange,
    RelativeState,
    SatelliteTarget,
    Tracking,
)

from satform.communication.sim_time import Stamps
from satform.communication.topic_table import NUMBERS_OF_A_SATELLITE
from satform_nodes.transport.cdr_codec import Layout, array_layout, layout
from satform_nodes.transport.topic_types import TYPES

FRAME = "lvlh"
ARRAYS = (GroupCommand, GroupPhase, GroupState, GroupTracking)
VARIABLE = (
    EarlyEnd,
    FormationStatus,
    ParameterChange,
    NodeReady,
    LinkConditions,
    Measurements,
    NavigationEstimate,
    SatelliteTarget,
    *ARRAYS,
)
MESSAGES = [value for name, value in vars(satform_msgs.msg).items() if name[0].isupper()]
FIXED = [message for message in MESSAGES if message not in VARIABLE]

RANGES = {
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint8": st.integers(0, 2**8 - 1),
    "uint32": st.integers(0, 2**32 - 1),
    "uint64": st.integers(0, 2**64 - 1),
    "double": st.floats(allow_nan=True, allow_infinity=False),
}


def kind_of(message_type: Any, field: str) -> str:
    """rosidl's own word for a dotted field's type."""
    *parents, last = field.split(".")
    owner = reduce(getattr, parents, message_type())
    kind: str = owner.get_fields_and_field_types()[last.partition("[")[0]]
    return kind.partition("[")[0]


def message_of(message_type: Any, numbers: dict[str, Any], frame: str = FRAME) -> Any:
    """A message filled field by field."""
    message = message_type()
    message.header.frame_id = frame
    for field, number in numbers.items():
        *parents, last = field.split(".")
        name, _, index = last.removesuffix("]").partition("[")
        owner = reduce(getattr, parents, message)
        if index:
            getattr(owner, name)[int(index)] = number
        else:
            setattr(owner, name, number)
    return message


def numbered(message_type: Any, form: Layout) -> dict[str, Any]:
    """A different number in each field."""
    kinds = {field: kind_of(message_type, field) for field in form.fields}
    return {field: 100 + i if "int" in kinds[field] else 100.5 + i for i, field in enumerate(form.fields)}


def without_padding(data: bytes, form: Layout, frame: str = FRAME) -> bytes:
    """Bytes that mean something: rosidl leaves whatever was in memory between the fields."""
    places = [*range(4), *range(12, 12 + 4 + len(frame) + 1)]
    for field in form.fields:
        kind, offset = form.dtype.fields[field][:2]
        places += range(offset, offset + kind.itemsize)
    assert len(data) == form.size
    return bytes(data[place] for place in places)


def bits(numbers: Any) -> list[bytes]:
    """What tells minus zero from zero and holds for not-a-number."""
    return [struct.pack("<d", number) if isinstance(number, float) else b"%d" % number for number in numbers]


@pytest.mark.parametrize("message_type", FIXED, ids=lambda message: message.__name__)
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_packed_numbers_are_the_bytes_of_rosidl_and_come_back_with_the_same_bits(
    message_type: Any, data: st.DataObject
) -> None:
    form = layout(message_type, FRAME)
    numbers = {field: data.draw(RANGES[kind_of(message_type, field)], label=field) for field in form.fields}
    packed = form.pack(*numbers.values())
    expected = serialize_message(message_of(message_type, numbers))
    assert without_padding(packed, form) == without_padding(expected, form)
    unpacked = form.unpack(packed)
    assert unpacked is not None
    assert bits(unpacked) == bits(numbers.values())
    row = np.frombuffer(packed, dtype=form.dtype)[0]
    assert bits(row[field].item() for field in form.fields) == bits(numbers.values())


@pytest.mark.parametrize("message_type", FIXED, ids=lambda message: message.__name__)
def test_rosidl_reads_each_packed_number_into_its_own_field(message_type: Any) -> None:
    form = layout(message_type, FRAME)
    numbers = numbered(message_type, form)
    message = deserialize_message(form.pack(*numbers.values()), message_type)
    assert message.header.frame_id == FRAME
    for field, number in numbers.items():
        path, _, index = field.removesuffix("]").partition("[")
        found = reduce(getattr, path.split("."), message)
        assert (found[int(index)] if index else found) == number, field


@pytest.mark.parametrize("frame", ["", "a", "abc", "lvlh", "chief/lvlh"])
@pytest.mark.parametrize("message_type", [ArcLength, RelativeState])
def test_frames_of_any_length_are_padded_as_rosidl_pads_them(message_type: Any, frame: str) -> None:
    form = layout(message_type, frame)
    numbers = numbered(message_type, form)
    expected = serialize_message(message_of(message_type, numbers, frame))
    packed = form.pack(*numbers.values())
    assert without_padding(packed, form, frame) == without_padding(expected, form, frame)


@pytest.mark.parametrize("length", [1, 2, 5])
def test_sequences_of_one_length_have_the_bytes_of_rosidl(length: int) -> None:
    form = layout(LinkConditions, FRAME, (("loss", length), ("light_time", length)))
    loss, light_time = [0.25 + place for place in range(length)], [1e-3 * place for place in range(length)]
    packed = form.pack(3, 4, 5, length, *loss, length, *light_time)
    message = deserialize_message(packed, LinkConditions)
    assert (message.step, list(message.loss), list(message.light_time)) == (5, loss, light_time)
    expected = serialize_message(message)
    assert without_padding(packed, form) == without_padding(expected, form)
    assert form.unpack(expected) == (3, 4, 5, length, *loss, length, *light_time)
    with pytest.raises(ValueError, match="whose size is not fixed"):
        layout(LinkConditions, FRAME)


@pytest.mark.parametrize("count", [1, 2, 7])
@pytest.mark.parametrize("kind", sorted(NUMBERS_OF_A_SATELLITE))
def test_arrays_have_the_bytes_of_rosidl_and_come_back_with_the_same_bits(kind: str, count: int) -> None:
    numbers = {name: width * count for name, width in NUMBERS_OF_A_SATELLITE[kind].items()}
    form = array_layout(TYPES[kind], FRAME, tuple(numbers.items()))
    random = np.random.default_rng(count)
    lists = {name: random.normal(size=length) for name, length in numbers.items()}
    single = {"step": 5, "formation_version": 6}
    if kind == "group_command":
        single |= {"violating_satellite": 1, "violation": 2, "violating_value": 7.5}
    packed = form.pack((3, 4), {**single, **lists})
    message = deserialize_message(packed, TYPES[kind])
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (3, 4)
    assert message.header.frame_id == FRAME
    assert {name: getattr(message, name) for name in single} == single
    assert {name: list(getattr(message, name)) for name in lists} == {
        name: values.tolist() for name, values in lists.items()
    }
    unpacked = form.unpack(serialize_message(message))
    assert all(unpacked[name].tobytes() == values.tobytes() for name, values in lists.items())
    assert {name: unpacked[name] for name in single} == single
    # A list of another length, another frame, and bytes that are cut off are no such message.
    other = array_layout(TYPES[kind], FRAME, tuple((name, length + 1) for name, length in numbers.items()))
    assert other.unpack(packed) is None
    assert array_layout(TYPES[kind], "gcrf", tuple(numbers.items())).unpack(packed) is None
    assert form.unpack(packed[:-1]) is None


def test_a_message_of_poses_has_a_layout_too() -> None:
    form = layout(PoseStamped, FRAME)
    numbers = numbered(PoseStamped, form)
    assert form.fields[-1] == "pose.orientation.w"
    expected = serialize_message(message_of(PoseStamped, numbers))
    assert without_padding(form.pack(*numbers.values()), form) == without_padding(expected, form)


def test_a_packed_message_has_no_chance_bytes_in_it() -> None:
    assert (
        layout(ArcLength, FRAME).pack(0, 0, 0, 0.0, 0.0).strip(b"\0") == b"\1" + b"\0" * 10 + b"\5\0\0\0lvlh"
    )


def test_many_messages_are_one_array() -> None:
    form = layout(ArcLength, FRAME)
    table = np.frombuffer(b"".join(form.pack(k, 0, k, 10.0 * k, -k) for k in range(5)), dtype=form.dtype)
    assert table["step"].tolist() == [0, 1, 2, 3, 4]
    assert table["arc_length"].tolist() == [0.0, 10.0, 20.0, 30.0, 40.0]
    assert table["rate"].tolist() == [0.0, -1.0, -2.0, -3.0, -4.0]


@pytest.mark.parametrize("message_type", FIXED, ids=lambda message: message.__name__)
def test_bytes_of_another_length_are_no_such_message(message_type: Any) -> None:
    form = layout(message_type, FRAME)
    packed = form.pack(*numbered(message_type, form).values())
    assert len(packed) == form.size == form.dtype.itemsize
    for data in (b"", packed[:4], packed[:-1], packed + b"\0", packed + packed):
        assert form.unpack(data) is None


def test_another_encapsulation_is_no_such_message() -> None:
    form = layout(ArcLength, FRAME)
    packed = form.pack(1, 2, 3, 4.0, 5.0)
    for encapsulation in (b"\0\0\0\0", b"\0\3\0\0", b"\1\1\0\0", b"\0\7\0\0"):
        assert form.unpack(encapsulation + packed[4:]) is None


@pytest.mark.parametrize("frame", ["LVLH", "lvl", "map", "lvlh2"])
def test_another_frame_is_no_such_message(frame: str) -> None:
    other = layout(ArcLength, frame).pack(1, 2, 3, 4.0, 5.0)
    assert layout(ArcLength, FRAME).unpack(other) is None
    assert layout(ArcLength, frame).unpack(other) == (1, 2, 3, 4.0, 5.0)


def test_a_number_that_does_not_fit_is_refused() -> None:
    with pytest.raises(struct.error):
        layout(ArcLength, FRAME).pack(1, 2, -1, 4.0, 5.0)


@pytest.mark.parametrize(
    "message_type", [*VARIABLE, TransformStamped], ids=lambda message: str(message.__name__)
)
def test_a_message_of_variable_size_is_refused_by_its_field(message_type: Any) -> None:
    with pytest.raises(ValueError, match=rf"{message_type.__name__}\.\w+ is a .*, whose size is not fixed"):
        layout(message_type, FRAME)


@pytest.mark.parametrize("message_type", [Point, type(Command().header)])
def test_a_message_that_does_not_begin_with_a_header_is_refused(message_type: Any) -> None:
    with pytest.raises(ValueError, match=r"does not begin with a header|whose size is not fixed"):
        layout(message_type, FRAME)


def test_a_layout_is_derived_once() -> None:
    assert layout(Tracking, FRAME) is layout(Tracking, FRAME)


@given(
    nanoseconds=st.one_of(
        st.sampled_from([1_000, 100_000_000, 500_000_000, 1_000_000_000, 333_333_333, 3_600_000_000_000]),
        st.integers(1_000, 3_600_000_000_000),
    ),
    step=st.integers(0, 500_000),
)
@settings(max_examples=300, deadline=None)
def test_a_stamp_gives_back_its_step_and_its_time_to_the_last_bit(nanoseconds: int, step: int) -> None:
    length = nanoseconds / 1e9
    stamps = Stamps(length, nanoseconds)
    seconds, rest = stamps.at(step)
    assert 0 <= rest < 1_000_000_000
    assert seconds * 1_000_000_000 + rest == step * nanoseconds
    assert stamps.time(seconds, rest) == step * length
    assert stamps.at_time(step * length) == (seconds, rest)


def test_stamps_do_not_drift_over_a_long_flight() -> None:
    assert Stamps(0.1, 100_000_000).at(10**8) == (10_000_000, 0)


def test_a_stamp_off_the_grid_of_steps_is_its_own_time() -> None:
    assert Stamps(0.5, 500_000_000).time(3, 250_000_000) == 3.25
