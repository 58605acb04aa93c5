# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages with lists of many numbers as bytes: each list is copied as a whole.

As in `cdr_layout`, CDR (XCDR version 1, little endian), and the lists of a topic's messages always have the
same lengths. There every number is a field of its own; here a list is one.
"""

import struct
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from satform.communication.cdr_layout import ENCAPSULATION, FRAME_FIELD

_FORMATS = {
    "float64": "f8",
    "float32": "f4",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "uint8": "u1",
}
_AFTER_ENCAPSULATION = len(ENCAPSULATION)


class ArrayLayout:
    """Offset and type of each number and list in the bytes of a message.

    Attributes:
        lists: names of the lists, and how many numbers each has.
        size: length of a message in bytes, encapsulation included.
        dtype: numpy view of the whole message, with one entry for each number or list.
    """

    def __init__(self, message: str, fields: Iterable[tuple[str, str, int]], frame: str) -> None:
        """Derive the layout.

        Args:
            message: name of the message type, for errors.
            fields: name and `.msg` type of each field in order, nested messages resolved, and for a list
                how many numbers it has; 0 for a single number.
            frame: text of `header.frame_id` in all messages of this layout.

        Raises:
            ValueError: a field is neither a number nor a list of numbers, or the message has no header.
        """
        text = frame.encode() + b"\0"
        constant = struct.pack("<I", len(text)) + text
        names: list[str] = []
        offsets: list[int] = []
        formats: list[Any] = []
        self.lists: dict[str, int] = {}
        position = 0

        def add(name: str, form: Any, width: int, size: int) -> None:
            nonlocal position
            position += -position % width
            names.append(name)
            offsets.append(position + _AFTER_ENCAPSULATION)
            formats.append(form)
            position += size

        for name, kind, count in fields:
            if name == FRAME_FIELD:
                add(name, f"S{len(constant)}", 4, len(constant))
                continue
            if kind not in _FORMATS:
                raise ValueError(f"{message}.{name} is a {kind}, neither a number nor a list of numbers")
            code = f"<{_FORMATS[kind]}"
            width = np.dtype(code).itemsize
            if count:
                add(f"{name}.length", "<u4", 4, 4)
                self.lists[name] = count
                add(name, (code, (count,)), width, count * width)
            else:
                add(name, code, width, width)
        if names[:3] != ["header.stamp.sec", "header.stamp.nanosec", FRAME_FIELD]:
            raise ValueError(f"{message} does not begin with a header")
        self.size = position + _AFTER_ENCAPSULATION
        self.dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.size})
        # What is the same in all messages; the rest is written for each of them.
        self._bytes = bytearray(self.size)
        self._bytes[:_AFTER_ENCAPSULATION] = ENCAPSULATION
        begin = offsets[2]
        self._bytes[begin : begin + len(constant)] = constant
        self._frame = (begin, begin + len(constant), constant)
        self._row = np.frombuffer(self._bytes, dtype=self.dtype)
        for name, count in self.lists.items():
            self._row[f"{name}.length"] = count
        # Views of one number, or of all numbers of a list.
        self._written = {name: self._row[name].reshape(-1) for name in names if not name.endswith(".length")}

    def pack(self, stamp: tuple[int, int], values: Mapping[str, ArrayLike]) -> bytes:
        """The bytes of a message.

        Args:
            stamp: of its header, seconds and nanoseconds.
            values: of every other field, by its name; of a list an array of as many numbers, in any shape
                whose rows are the satellites, or one number for all.
        """
        written = self._written
        written["header.stamp.sec"][0], written["header.stamp.nanosec"][0] = stamp
        for name, value in values.items():
            written[name][:] = np.reshape(value, -1)
        return bytes(self._bytes)

    def unpack(self, data: bytes) -> Any:
        """The fields of a message by name, lists as arrays; None when the bytes are not such a message."""
        begin, end, constant = self._frame
        if len(data) != self.size or data[:2] != ENCAPSULATION[:2] or data[begin:end] != constant:
            return None
        row = np.frombuffer(data, dtype=self.dtype)[0]
        if any(row[f"{name}.length"] != count for name, count in self.lists.items()):
            return None
        return row
