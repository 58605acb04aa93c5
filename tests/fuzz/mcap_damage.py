# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged MCAP files: a bag taken apart into records, changed, and put together again.

Checksums and lengths fit again afterwards, unless they are what is changed: a reader that stops at the first
wrong checksum would see nothing of the rest. Format: https://mcap.dev/spec.
"""

import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random

import lz4.frame
import zstandard
from byte_damage import damaged, number, packed

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 1, 2, 3, 4, 5, 6
ATTACHMENT, METADATA, DATA_END = 9, 12, 15

_NUMBERS = {
    FOOTER: (("summary_start", 0, 8), ("summary_offset_start", 8, 8), ("crc", 16, 4)),
    SCHEMA: (("id", 0, 2), ("length of the name", 2, 4)),
    CHANNEL: (("id", 0, 2), ("schema", 2, 2), ("length of the topic", 4, 4)),
    MESSAGE: (("channel", 0, 2), ("sequence", 2, 4), ("log time", 6, 8), ("publish time", 14, 8)),
    7: (("channel", 0, 2), ("length", 2, 4), ("time", 6, 8), ("offset", 14, 8)),
    8: (("first time", 0, 8), ("last time", 8, 8), ("start", 16, 8), ("length", 24, 8), ("offsets", 32, 4)),
    ATTACHMENT: (("log time", 0, 8), ("created", 8, 8), ("length of the name", 16, 4)),
    10: (("offset", 0, 8), ("length", 8, 8), ("log time", 16, 8), ("size", 32, 8)),
    11: (("messages", 0, 8), ("schemas", 8, 2), ("channels", 10, 4), ("attachments", 14, 4)),
    METADATA: (("length of the name", 0, 4),),
    13: (("offset", 0, 8), ("length", 8, 8)),
    14: (("group", 0, 1), ("start", 1, 8), ("length", 9, 8)),
    DATA_END: (("crc", 0, 4),),
}
"""By opcode: place and width of numbers at fixed places in a record."""

_DEFINITIONS = (
    "a_msgs/B b\n================================================================================\n"
    "MSG: a_msgs/B\na_msgs/B b\n",
    "uint64 step\nfloat64[999999999] x\n",
    "uint64 step\nfloat64[] x\n",
    "uint64 step\nstring<=99999999999999999999 x\n",
    "\n".join(f"float64 x{index}" for index in range(3000)),
    "\n".join(
        f"{'=' * 80}\nMSG: a_msgs/B{level}\na_msgs/B{level + 1}[99] b" for level in range(9)
    ).removeprefix("=" * 80 + "\nMSG: a_msgs/B0\n"),
    "uint8 A=" + "9" * 5000 + "\n",
    "std_msgs/Header header\n" * 40,
    "(" * 3000,
    "wstring x\n",
    "float64 step\n",
    "",
    "\x00",
    "#" * 100_000,
    "uint64 step = ${jndi}\n",
    'string s "' + "\\" * 1000,
)
"""Definitions of message types that contain themselves, are huge, or are none."""


@dataclass(frozen=True)
class Record:
    """A record of an MCAP file.

    Attributes:
        opcode: kind of the record.
        content: without opcode and length.
        length: that the file claims; None for the true one.
    """

    opcode: int
    content: bytes
    length: int | None = None

    def data(self) -> bytes:
        """The bytes of the file."""
        length = len(self.content) if self.length is None else self.length
        return bytes([self.opcode]) + length.to_bytes(8, "little") + self.content


def records_of(data: bytes) -> list[Record]:
    """The records of a whole file or of the content of a chunk, without the magic bytes."""
    found, place = [], 0
    while place + 9 <= len(data):
        length = int.from_bytes(data[place + 1 : place + 9], "little")
        found.append(Record(data[place], data[place + 9 : place + 9 + length]))
        place += 9 + length
    return found


def content_of(chunk: Record) -> list[Record]:
    """The records of a chunk that is not compressed."""
    (name,) = struct.unpack_from("<I", chunk.content, 28)
    return records_of(chunk.content[40 + name :])


def chunk_of(draw: Random, chunk: Record, content: bytes) -> Record:
    """A chunk with other content, compressed or not; sometimes with a size or a checksum that lies."""
    lies = draw.random()
    crc = zlib.crc32(content) if lies > 0.1 else draw.choice((0, draw.getrandbits(32)))
    size = len(content) if lies > 0.1 or lies < 0.05 else number(draw) % 2**64
    name, data = draw.choice(_COMPRESSIONS)(content)
    if draw.random() < 0.05:
        name = draw.choice((b"", b"zstd", b"lz4", b"bz2", b"\xff", b"x" * 5000))
    if draw.random() < 0.05:
        data = damaged(draw, data)
    count = len(data) if draw.random() > 0.03 else number(draw) % 2**64
    head = chunk.content[:16] + struct.pack("<QII", size, crc, len(name)) + name
    return Record(CHUNK, head + struct.pack("<Q", count) + data)


def _plain(content: bytes) -> tuple[bytes, bytes]:
    return b"", content


def _zstd(content: bytes) -> tuple[bytes, bytes]:
    return b"zstd", zstandard.compress(content, 1)


def _zstd_of_unknown_size(content: bytes) -> tuple[bytes, bytes]:
    compressor = zstandard.ZstdCompressor(level=1, write_content_size=False)
    return b"zstd", compressor.compress(content)


def _lz4(content: bytes) -> tuple[bytes, bytes]:
    return b"lz4", lz4.frame.compress(content)


_COMPRESSIONS: tuple[Callable[[bytes], tuple[bytes, bytes]], ...] = (
    _plain,
    _plain,
    _plain,
    _zstd,
    _zstd_of_unknown_size,
    _lz4,
)


def expanding(draw: Random, template: Record) -> Record:
    """A chunk of a few bytes that expands to a hundred megabytes."""
    content, size = draw.choice(_BOMBS)
    name, data = content
    said = draw.choice((size, 1000, 0, 2**28, 2**63))
    head = template.content[:16] + struct.pack("<QII", said, 0, len(name)) + name
    return Record(CHUNK, head + struct.pack("<Q", len(data)) + data)


_ZEROS = bytes(100 * 2**20)
_BOMBS = [(compress(_ZEROS), len(_ZEROS)) for compress in (_zstd, _zstd_of_unknown_size, _lz4)]
_BOMBS += [
    # Messages of channel 0 without data, each as short as a message can be.
    (compress(Record(MESSAGE, bytes(22)).data() * (2**20 // 31)), 2**20 // 31 * 31)
    for compress in (_zstd, _lz4)
]


def damaged_bag(draw: Random, data: bytes, scenario_text: Callable[[Random], bytes]) -> bytes:
    """An MCAP file after some changes.

    Args:
        draw: source of random numbers.
        data: a whole file whose chunks are not compressed.
        scenario_text: makes the text of a damaged scenario.
    """
    if draw.random() < 0.15:
        return damaged(draw, data)
    records = records_of(data[len(MAGIC) : -len(MAGIC)])
    try:
        for _ in range(draw.randint(1, 3)):
            records = _changed(draw, records, scenario_text)
    except struct.error:
        # An earlier change has left no record of this kind that could be taken apart.
        return damaged(draw, data)
    content = MAGIC + b"".join(record.data() for record in records) + MAGIC
    return damaged(draw, content, changes=2) if draw.random() < 0.1 else content


def _changed(draw: Random, records: list[Record], scenario_text: Callable[[Random], bytes]) -> list[Record]:
    chunks = [index for index, record in enumerate(records) if record.opcode == CHUNK]
    if chunks and draw.random() < 0.6:
        index = draw.choice(chunks)
        inner = _listed(draw, content_of(records[index]))
        content = b"".join(record.data() for record in inner)
        return [*records[:index], chunk_of(draw, records[index], content), *records[index + 1 :]]
    if chunks and draw.random() < 0.04:
        bomb = expanding(draw, records[chunks[0]])
        place = draw.randrange(len(records))
        return [*records[:place], bomb, *records[place:]]
    found = [index for index, record in enumerate(records) if record.opcode == ATTACHMENT]
    if found and draw.random() < 0.15:
        index = draw.choice(found)
        return [*records[:index], _attachment(draw, scenario_text(draw)), *records[index + 1 :]]
    return _listed(draw, records)


def _attachment(draw: Random, data: bytes) -> Record:
    name = draw.choice((b"scenario.json", b"scenario.json", b"scenario_files/../../x", b"scenario_files/x"))
    texts = b"".join(struct.pack("<I", len(text)) + text for text in (name, b"application/json"))
    content = bytes(16) + texts + struct.pack("<Q", len(data)) + data
    crc = zlib.crc32(content) if draw.random() < 0.9 else draw.getrandbits(32)
    return Record(ATTACHMENT, content + struct.pack("<I", crc))


def _listed(draw: Random, records: list[Record]) -> list[Record]:
    """Records after a change of one of them, or of their order."""
    if not records:
        return [_any_record(draw)]
    # Messages are by far the most, and all alike.
    opcode = draw.choice(sorted({record.opcode for record in records}))
    place = draw.choice([index for index, record in enumerate(records) if record.opcode == opcode])
    record = records[place]
    before, after = records[:place], records[place + 1 :]
    match draw.randrange(12):
        case 0:
            return [*before, *after]
        case 1:
            return [*before, *([record] * draw.choice((2, 2, 50))), *after]
        case 2:
            other = draw.randrange(len(records))
            swapped = list(records)
            swapped[place], swapped[other] = swapped[other], swapped[place]
            return swapped
        case 3:
            return [*before, replace(record, opcode=draw.randrange(20)), *after]
        case 4:
            return [*before, replace(record, length=number(draw) % 2**64), *after]
        case 5:
            return [*before, _any_record(draw), record, *after]
        case 6 | 7 if opcode == SCHEMA:
            return [*before, _schema(draw, record), *after]
        case _ if opcode in _NUMBERS and draw.random() < 0.6:
            return [*before, _number_changed(draw, record), *after]
        case _:
            return [*before, replace(record, content=damaged(draw, record.content, changes=2)), *after]


def _any_record(draw: Random) -> Record:
    return Record(draw.randrange(256), draw.randbytes(draw.choice((0, 4, 22, 60))))


def _number_changed(draw: Random, record: Record) -> Record:
    _, place, width = draw.choice(_NUMBERS[record.opcode])
    content = record.content[:place] + packed(draw, width, signed=True) + record.content[place + width :]
    return replace(record, content=content)


def _schema(draw: Random, record: Record) -> Record:
    """A message type of the same name, or of another one, with another definition."""
    (length,) = struct.unpack_from("<I", record.content, 2)
    name = record.content[6 : 6 + length]
    if draw.random() < 0.2:
        name = draw.choice((b"", b"a_msgs/msg/B", b"a_msgs/B", b"x", b"../x/msg/y", b"\xff", b"a/b/c/d"))
    text = draw.choice(_DEFINITIONS).encode("utf-8", "surrogatepass")
    if draw.random() < 0.4:
        (whole,) = struct.unpack_from("<I", record.content, 6 + length)
        place = 10 + length + whole
        text = damaged(draw, record.content[place + 4 :], (b"\n", b"[", b"[]", b"[999999]", b"/", b"=", b"#"))
    encoding = draw.choice((b"ros2msg", b"ros2msg", b"ros2idl", b"protobuf", b""))
    parts = b"".join(struct.pack("<I", len(part)) + part for part in (name, encoding, text))
    return replace(record, content=record.content[:2] + parts)
