# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged Parquet files: bytes, numbers of the description at the end, and whole files with other columns."""

import io
from collections.abc import Callable
from random import Random

import numpy as np
from arro3.core import Array, DataType, Field, Schema, Table
from arro3.io import read_parquet, write_parquet
from byte_damage import damaged

_MAGIC = b"PAR1"


def damaged_parquet(draw: Random, content: bytes) -> bytes:
    """A Parquet file after some changes."""
    match draw.randrange(10):
        case 0 | 1:
            return damaged(draw, content)
        case 2 | 3 | 4:
            return _with_description(draw, content)
        case 5 | 6:
            return _with_pages(draw, content)
        case _:
            return _with_columns(draw, content)


def _with_description(draw: Random, content: bytes) -> bytes:
    """The description at the end changed; its length fits mostly."""
    length = int.from_bytes(content[-8:-4], "little")
    pages, description = content[: -8 - length], bytearray(content[-8 - length : -8])
    for _ in range(draw.randint(1, 4)):
        place = draw.randrange(len(description))
        match draw.randrange(3):
            case 0:
                description[place] ^= 1 << draw.randrange(8)
            case 1:
                # A number of any size, as Thrift's compact protocol has it.
                description[place : place + draw.randrange(4)] = _varint(
                    draw.getrandbits(draw.choice((7, 31, 63)))
                )
            case _:
                description[place] = draw.randrange(256)
    said = len(description) if draw.random() < 0.9 else draw.getrandbits(draw.choice((8, 16, 32)))
    return pages + bytes(description) + said.to_bytes(4, "little") + _MAGIC


def _with_pages(draw: Random, content: bytes) -> bytes:
    """The pages changed, of which each begins with a description of its own."""
    length = int.from_bytes(content[-8:-4], "little")
    pages = bytearray(content[: -8 - length])
    for _ in range(draw.randint(1, 4)):
        place = draw.randrange(4, len(pages))
        own = (
            _varint(draw.getrandbits(draw.choice((7, 14, 31)))) if draw.random() < 0.5 else draw.randbytes(1)
        )
        pages[place : place + len(own)] = own
    return bytes(pages) + content[-8 - length :]


def _varint(number: int) -> bytes:
    found = bytearray()
    while number > 127:
        found.append(number & 127 | 128)
        number >>= 7
    return bytes([*found, number])


def _numbers(draw: Random, rows: int) -> Array:
    values = np.array([draw.choice((0, 1, -1, 5, 2**63 - 1, -(2**63), 10**6)) for _ in range(rows)])
    return Array.from_numpy(values)


def _texts(draw: Random, rows: int) -> Array:
    own = draw.choice(("", "\x00", "é" * 1000, "x" * 3_000_000, "[", "{}"))
    return Array([own] * rows, DataType.string())


def _nothing(_draw: Random, rows: int) -> Array:
    return Array([None] * rows, DataType.float64())


_COLUMNS: tuple[Callable[[Random, int], Array], ...] = (
    _numbers,
    _texts,
    _nothing,
    lambda draw, rows: Array([draw.choice((float("nan"), float("inf"), -0.0))] * rows, DataType.float64()),
    lambda draw, rows: Array([draw.random() < 0.5 for _ in range(rows)], DataType.bool()),
)


def _with_columns(draw: Random, content: bytes) -> bytes:
    """A whole file in which columns are missing, added, of another type, or of many more rows."""
    table = read_parquet(content).read_all()
    columns = {name: table[name].combine_chunks() for name in table.schema.names}
    rows = table.num_rows
    for _ in range(draw.randint(1, 3)):
        name = draw.choice(list(columns)) if columns else "number"
        match draw.randrange(4):
            case 0:
                columns.pop(name, None)
            case 1:
                columns["x" if draw.random() < 0.5 else f"change.{name}"] = _numbers(draw, rows)
            case _:
                columns[name] = draw.choice(_COLUMNS)(draw, rows)
    if draw.random() < 0.03:
        # A few kilobytes of a hundred million equal numbers.
        columns = {"number": Array.from_numpy(np.zeros(20_000_000, dtype=np.int64))}
    return _written(draw, columns, dict(table.schema.metadata))


def _written(draw: Random, columns: dict[str, Array], metadata: dict[bytes, bytes]) -> bytes:
    own = {name.decode(): value.decode(errors="replace") for name, value in metadata.items()}
    if own and draw.random() < 0.3:
        own[draw.choice(list(own))] = draw.choice(
            ("", "x", "../../../etc/passwd", "{}", "[", '{"a": [-1]}', "\x00")
        )
    schema = Schema([Field(name, column.type) for name, column in columns.items()], metadata=own)
    file = io.BytesIO()
    table = Table.from_arrays(list(columns.values()), schema=schema)
    write_parquet(
        table, file, compression=draw.choice(("zstd(1)", "snappy", "uncompressed")), key_value_metadata=own
    )
    return file.getvalue()
