# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of fixed size as bytes: one struct format instead of a Python object per message.

On the hot path an rclpy message costs about 12 us to take apart and put together again; a struct of
known layout costs about 1 us. The layout is derived from the message's own definition (CDR, XCDR
version 1, little endian), so a changed `.msg` file changes it; a test holds it against rosidl's own
serialisation. The only text in such a message is the header's frame, which is the same in all.
"""

import importlib
import re
import struct
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

_ARRAY = re.compile(r"(\w+)\[(\d+)\]")
"""Type and length of an array of fixed length."""

ENCAPSULATION = b"\x00\x01\x00\x00"
"""What every little-endian CDR message begins with."""

_PRIMITIVES = {
    "double": "d",
    "float": "f",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "boolean": "?",
}


class Layout:
    """Where each number of a message of fixed size stands in its bytes.

    Attributes:
        fields: dotted names of the numbers in the order in which they are packed.
        size: length of a message in bytes, encapsulation included.
        dtype: numpy view of the whole message, one entry for each field.
    """

    def __init__(self, message_type: Any, frame: str) -> None:
        """Derive the layout.

        Args:
            message_type: rosidl's Python class of the message.
            frame: text of `header.frame_id` in all messages of this layout.

        Raises:
            ValueError: the message does not begin with a header, or holds something whose size is not
                fixed.
        """
        text = frame.encode() + b"\0"
        self._constant = struct.pack("<I", len(text)) + text
        form = "<4s"
        names, offsets, formats = [], [], []
        position = 0
        for name, kind in _flatten(message_type, ""):
            code = _PRIMITIVES.get(kind)
            if code is None and name != "header.frame_id":
                raise ValueError(f"{message_type.__name__}.{name} is a {kind}, whose size is not fixed")
            size = struct.calcsize(f"<{code}") if code else 4
            padding = -position % size
            form += f"{padding}x" if padding else ""
            position += padding
            if code is None:
                form += f"{len(self._constant)}s"
                position += len(self._constant)
                continue
            names.append(name)
            offsets.append(position + 4)
            formats.append(f"<{code}")
            form += code
            position += size
        self._struct = struct.Struct(form)
        self.fields = tuple(names)
        self.size = self._struct.size
        self.dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.size})
        if names[:2] != ["header.stamp.sec", "header.stamp.nanosec"]:
            raise ValueError(f"{message_type.__name__} does not begin with a header")

    def pack(self, seconds: int, nanoseconds: int, *numbers: float) -> bytes:
        """The message's bytes from its numbers in the order of `fields`."""
        return self._struct.pack(ENCAPSULATION, seconds, nanoseconds, self._constant, *numbers)

    def unpack(self, data: bytes) -> tuple[Any, ...] | None:
        """The message's numbers in the order of `fields`; None when the bytes are not such a message."""
        if len(data) != self.size:
            return None
        encapsulation, seconds, nanoseconds, constant, *numbers = self._struct.unpack(data)
        if encapsulation[:2] != ENCAPSULATION[:2] or constant != self._constant:
            return None
        return (seconds, nanoseconds, *numbers)


@cache
def layout(message_type: Any, frame: str) -> Layout:
    """The layout of a message type, derived once."""
    return Layout(message_type, frame)


def _flatten(message_type: Any, prefix: str) -> Iterator[tuple[str, str]]:
    kinds = message_type.get_fields_and_field_types()
    for (name, kind), slot in zip(kinds.items(), message_type.SLOT_TYPES, strict=True):
        if "/" in kind and hasattr(slot, "namespaces"):
            module = importlib.import_module(".".join(slot.namespaces))
            yield from _flatten(getattr(module, slot.name), f"{prefix}{name}.")
        elif array := _ARRAY.fullmatch(kind):
            # An array of fixed length has no length in its bytes: it is so many numbers in a row.
            yield from ((f"{prefix}{name}[{index}]", array[1]) for index in range(int(array[2])))
        else:
            yield f"{prefix}{name}", kind
