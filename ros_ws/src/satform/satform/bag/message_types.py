# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Message types by the definitions that a bag embeds: decoded messages, and layouts of fixed-size ones."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from satform.communication.cdr_layout import Layout, Lengths

MOST_FIELDS = 1000
"""Fields that a message of fixed size may have, nested ones counted; a bag may come from anywhere."""


@dataclass(frozen=True)
class TopicMessages:
    """Messages of one topic as a bag holds them.

    Attributes:
        topic: full name, in the root namespace.
        type_name: of the messages, such as `satform_msgs/msg/Command`.
        definition: text of the message type as the bag embeds it.
        messages: serialised, in the order in which they were written.
    """

    topic: str
    type_name: str
    definition: str
    messages: tuple[bytes, ...]


def decoded(messages: TopicMessages) -> tuple[list[Any], dict[int, str]]:
    """The messages of a topic as objects.

    Args:
        messages: of one topic.

    Returns:
        One object for each message, with the fields of its definition; and the names of the definition's
        constants in lower case, by value.

    Raises:
        Exception: of many kinds; the decoder is made from the bag's text, which may be any.
    """
    store, names = _decoder(messages.type_name, messages.definition)
    return [store.deserialize_cdr(data, messages.type_name) for data in messages.messages], dict(names)


@lru_cache(maxsize=64)
def _decoder(type_name: str, definition: str) -> tuple[Any, dict[int, str]]:
    """What decodes messages of a type, and its constants; made once, since it is compiled from the text."""
    types = get_types_from_msg(definition, type_name)
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store, {int(value): name.lower() for name, _, value in types[type_name][0]}


@lru_cache(maxsize=64)
def fixed_layout(type_name: str, definition: str, frame: str, lengths: Lengths = ()) -> Layout:
    """The layout of a message type of fixed size.

    Args:
        type_name: of the message.
        definition: its text, in ros2msg form, with all messages that it contains.
        frame: text of `header.frame_id` in all its messages.
        lengths: name and length of each list of any length in all its messages.

    Raises:
        Exception: of many kinds; the text is no definition, or that of a message without a fixed size.
    """
    types = get_types_from_msg(definition, type_name)
    most = MOST_FIELDS + sum(size for _, size in lengths)
    fields = list(_flatten(types, (type_name, ""), [most], dict(lengths)))
    return Layout(type_name, fields, frame)


def _flatten(
    types: Any, message: tuple[str, str], left: list[int], lengths: dict[str, int]
) -> Iterator[tuple[str, str]]:
    """Dotted name and type of each field.

    Args:
        types: definitions by name.
        message: name of its type, and what stands before the names of its fields.
        left: how many more fields are allowed; counted down.
        lengths: of lists of any length, by the names of their fields.
    """
    type_name, prefix = message
    for name, (node, described) in types[type_name][1]:
        count = described[1] if node == Nodetype.ARRAY else 1
        left[0] -= count
        if left[0] < 0:
            raise ValueError(f"{type_name} has more than {MOST_FIELDS} fields")
        if node == Nodetype.NAME:
            yield from _flatten(types, (described, f"{prefix}{name}."), left, lengths)
        elif node == Nodetype.ARRAY and described[0][0] == Nodetype.BASE:
            kind = described[0][1][0]
            yield from ((f"{prefix}{name}[{index}]", kind) for index in range(count))
        elif node == Nodetype.BASE:
            yield f"{prefix}{name}", described[0]
        elif node == Nodetype.SEQUENCE and f"{prefix}{name}" in lengths:
            kind = described[0][1][0]
            yield f"{prefix}{name}.length", "uint32"
            yield from ((f"{prefix}{name}[{index}]", kind) for index in range(lengths[f"{prefix}{name}"]))
        else:
            raise ValueError(f"{type_name}.{name} is a list, whose size is not fixed")
