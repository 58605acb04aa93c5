# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Layouts of messages of fixed size (`cdr_layout`, `array_layout`) from rosidl's Python classes.

The layout is derived from the message's own definition, so a changed `.msg` file changes it; a test holds it
against rosidl's own serialisation.
"""

import importlib
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

from satform.communication.array_layout import ArrayLayout
from satform.communication.cdr_layout import Layout, Lengths

__all__ = ["Layout", "Lengths", "array_layout", "layout"]

_ARRAY = re.compile(r"(\w+)\[(\d+)\]")
"""Type and length of an array of fixed length."""

_SEQUENCE = re.compile(r"sequence<(\w+)>")
"""Type of an array of any length."""

_IN_MSG_FILES = {"double": "float64", "float": "float32", "boolean": "bool"}
"""Types of IDL, which rosidl names, by their names in `.msg` files where these differ."""


@cache
def layout(message_type: Any, frame: str, lengths: Lengths = ()) -> Layout:
    """The layout of a message type, derived once.

    Args:
        message_type: rosidl's Python class of the message.
        frame: text of `header.frame_id` in all its messages.
        lengths: name and length of every sequence in all its messages. The length stands in front of the
            sequence as a number of its own, `name.length`.

    Raises:
        ValueError: the message does not begin with a header, or has a field whose size is not fixed.
    """
    fields = (
        (name, _IN_MSG_FILES.get(kind, kind)) for name, kind in _flatten(message_type, "", dict(lengths))
    )
    return Layout(message_type.__name__, fields, frame)


@cache
def array_layout(message_type: Any, frame: str, lengths: Lengths) -> ArrayLayout:
    """The layout of a message type with lists of many numbers, derived once.

    Args:
        message_type: rosidl's Python class of the message.
        frame: text of `header.frame_id` in all its messages.
        lengths: name and length of every list in all its messages.

    Raises:
        ValueError: the message does not begin with a header, or has a field whose size is not fixed.
    """
    counts = dict(lengths)
    fields = []
    for name, kind in _flatten(message_type, "", {}):
        sequence = _SEQUENCE.fullmatch(kind)
        element = sequence[1] if sequence else kind
        count = counts[name] if sequence else 0
        fields.append((name, _IN_MSG_FILES.get(element, element), count))
    return ArrayLayout(message_type.__name__, fields, frame)


def _flatten(message_type: Any, prefix: str, lengths: dict[str, int]) -> Iterator[tuple[str, str]]:
    kinds = message_type.get_fields_and_field_types()
    for (name, kind), slot in zip(kinds.items(), message_type.SLOT_TYPES, strict=True):
        if "/" in kind and hasattr(slot, "namespaces"):
            module = importlib.import_module(".".join(slot.namespaces))
            yield from _flatten(getattr(module, slot.name), f"{prefix}{name}.", lengths)
        elif array := _ARRAY.fullmatch(kind):
            # An array of fixed length has no length in its bytes: it is so many numbers in a row.
            yield from ((f"{prefix}{name}[{index}]", array[1]) for index in range(int(array[2])))
        elif f"{prefix}{name}" in lengths and (sequence := _SEQUENCE.fullmatch(kind)):
            yield f"{prefix}{name}.length", "uint32"
            yield from (
                (f"{prefix}{name}[{index}]", sequence[1]) for index in range(lengths[f"{prefix}{name}"])
            )
        else:
            yield f"{prefix}{name}", kind
