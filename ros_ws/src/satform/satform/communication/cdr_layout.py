# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of fixed size as bytes: one struct format instead of a Python object per message.

CDR, XCDR version 1, little endian (OMG DDSI-RTPS 2.5, section 10). The only text in such a message is the
header's frame, which is the same in all of a topic. Why not a decoder of whole messages: on the control
path one message as a Python object costs about 12 us, a struct of known layout about 1 us; a bag's topic is
read as one array.
"""

import struct
from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np

ENCAPSULATION = b"\x00\x01\x00\x00"
"""First bytes of every little-endian CDR message."""

FRAME_FIELD = "header.frame_id"
"""Name of the one field of text."""

_FORMATS = {
    "float64": "d",
    "float32": "f",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "bool": "?",
}


Lengths: TypeAlias = tuple[tuple[str, int], ...]
"""Name and length of each list of any length in the messages of a type."""


class Layout:
    """Offset and type of each number in the bytes of a message of fixed size.

    Attributes:
        fields: dotted names of the numbers in the order in which they are packed.
        size: length of a message in bytes, encapsulation included.
        constant: bytes of `header.frame_id`, the same in every message.
        dtype: numpy view of the whole message, one entry for each field.
    """

    def __init__(self, message: str, fields: Iterable[tuple[str, str]], frame: str) -> None:
        """Derive the layout.

        Args:
            message: name of the message type, for errors.
            fields: dotted name and `.msg` type of each field in order, nested messages and arrays resolved.
            frame: text of `header.frame_id` in all messages of this layout.

        Raises:
            ValueError: the message does not begin with a header, or has a field whose size is not fixed.
        """
        text = frame.encode() + b"\0"
        self.constant = struct.pack("<I", len(text)) + text
        form = "<4s"
        names, offsets, formats = [], [], []
        position = 0
        for name, kind in fields:
            code = _FORMATS.get(kind)
            if code is None and name != FRAME_FIELD:
                raise ValueError(f"{message}.{name} is a {kind}, whose size is not fixed")
            size = struct.calcsize(f"<{code}") if code else 4
            padding = -position % size
            form += f"{padding}x" if padding else ""
            position += padding
            if code is None:
                form += f"{len(self.constant)}s"
                position += len(self.constant)
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
            raise ValueError(f"{message} does not begin with a header")

    def pack(self, seconds: int, nanoseconds: int, *numbers: float) -> bytes:
        """The message's bytes from its numbers in the order of `fields`."""
        return self._struct.pack(ENCAPSULATION, seconds, nanoseconds, self.constant, *numbers)

    def unpack(self, data: bytes) -> tuple[Any, ...] | None:
        """The message's numbers in the order of `fields`; None when the bytes are not such a message."""
        if len(data) != self.size:
            return None
        encapsulation, seconds, nanoseconds, constant, *numbers = self._struct.unpack(data)
        if encapsulation[:2] != ENCAPSULATION[:2] or constant != self.constant:
            return None
        return (seconds, nanoseconds, *numbers)
