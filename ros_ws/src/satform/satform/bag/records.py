# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP file from anywhere, in bounded memory and time.

A chunk says itself how large it is once expanded, and a few bytes of zstd or lz4 can expand to gigabytes.
Here no more is expanded than a limit that grows with the file: telemetry is compressed to a third or a tenth
of its size, a bomb to a ten thousandth.
"""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import zstandard
from mcap.exceptions import McapError
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, breakup_chunk

from satform.files.bounded_file import open_regular

LEAST_EXPANDED = 64 * 2**20
"""Bytes to which the chunks of any file may expand."""

MOST_EXPANSION = 100
"""By how much a larger file may expand."""

LARGEST_CHUNK = 256 * 2**20
"""Bytes of one chunk, which is held in memory as a whole; recorders make chunks of some megabytes at most."""

_PIECE = 2**20
"""Bytes that are expanded at a time."""


class ExpansionError(McapError):
    """The chunks of a file expand to more than is allowed; nothing more of it is read."""


def records(file: Path) -> Iterator[Any]:
    """The records of a file in their order, those of its chunks in the place of the chunk.

    Args:
        file: in MCAP.

    Yields:
        Records of `mcap.records`.

    Raises:
        OSError: the file cannot be read, or is not a regular one.
        ExpansionError: it would expand to too much.
        McapError: what follows cannot be read; it ends early, or is damaged.
    """
    with open_regular(file) as stream:
        size = os.fstat(stream.fileno()).st_size
        allowed = max(LEAST_EXPANDED, MOST_EXPANSION * size)
        left = allowed
        reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=size)
        for record in reader.records:
            if not isinstance(record, Chunk):
                yield record
                continue
            if record.uncompressed_size > LARGEST_CHUNK:
                raise ExpansionError(
                    f"a chunk of it holds {record.uncompressed_size} bytes; "
                    f"{LARGEST_CHUNK} is the most that is read"
                )
            data = _expanded(record, left)
            if data is None:
                raise ExpansionError(
                    f"its chunks expand to more than {allowed} bytes, {MOST_EXPANSION} times its size or "
                    f"{LEAST_EXPANDED} bytes; no flight's do"
                )
            left -= len(data)
            yield from breakup_chunk(replace(record, compression="", data=data), validate_crc=True)


def _expanded(chunk: Chunk, limit: int) -> bytes | None:
    """What a chunk holds; None when it is more than a limit in bytes.

    Raises:
        McapError: it cannot be expanded.
    """
    if not chunk.compression:
        return bytes(chunk.data)
    if chunk.uncompressed_size > limit:
        return None
    if chunk.compression == "zstd":
        pieces = _zstd(chunk.data)
    elif chunk.compression == "lz4":
        pieces = _lz4(chunk.data)
    else:
        raise McapError(f"a chunk is compressed by {chunk.compression!r}, which is neither zstd nor lz4")
    # Its own size counts: more is never expanded, whatever is in it.
    allowed = min(limit, chunk.uncompressed_size)
    data = bytearray()
    for piece in pieces:
        data += piece
        if len(data) > allowed:
            raise McapError(f"a chunk holds more than the {chunk.uncompressed_size} bytes that it announces")
    if len(data) < chunk.uncompressed_size:
        raise McapError(f"a chunk holds {len(data)} of the {chunk.uncompressed_size} bytes that it announces")
    return bytes(data)


def _zstd(data: bytes) -> Iterator[bytes]:
    try:
        with zstandard.ZstdDecompressor(max_window_size=2**27).stream_reader(
            data, read_across_frames=True
        ) as reader:
            while piece := reader.read(_PIECE):
                yield piece
    except zstandard.ZstdError as error:
        raise McapError(f"a chunk cannot be expanded: {error}") from None


def _lz4(data: bytes) -> Iterator[bytes]:
    try:
        import lz4.frame  # type: ignore[import-untyped]  # noqa: PLC0415 - our own bags have none
    except ImportError:
        raise McapError("a chunk is compressed by lz4, which is not installed here") from None
    expander = lz4.frame.LZ4FrameDecompressor()
    try:
        piece = expander.decompress(data, max_length=_PIECE)
        while piece:
            yield piece
            piece = b"" if expander.eof else expander.decompress(b"", max_length=_PIECE)
    except RuntimeError as error:
        raise McapError(f"a chunk cannot be expanded: {error}") from None
