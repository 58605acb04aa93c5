# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Numpy archives (npz) from anywhere: plain numbers, no larger in memory than the file is."""

import io
import math
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as numpy_format
from numpy.typing import NDArray

from satform.files.bounded_file import open_regular


class ArchiveError(ValueError):
    """An archive that cannot be read; the message says what is wrong with it."""


def read_archive(source: Path | bytes) -> dict[str, NDArray[Any]]:
    """The arrays of an archive as `numpy.savez` writes it.

    An array's header says how large it is, and a compressed archive may expand to a thousand times its size;
    both are held against the size of the file before anything is made of it.

    Args:
        source: the file, or its content.

    Returns:
        The arrays by their names.

    Raises:
        OSError: the file cannot be read, or is not a regular one.
        ArchiveError: it is no such archive.
    """
    try:
        if isinstance(source, bytes):
            return _arrays(io.BytesIO(source))
        with open_regular(source) as file:
            return _arrays(file)
    except (OSError, ArchiveError):
        raise
    except Exception as error:  # headers are made from the file's bytes, which may be any
        raise ArchiveError(f"it cannot be read: {str(error) or type(error).__name__}") from None


def _arrays(file: IO[bytes]) -> dict[str, NDArray[Any]]:
    found: dict[str, NDArray[Any]] = {}
    size = file.seek(0, io.SEEK_END)
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
        if sum(member.file_size for member in members) > size:
            raise ArchiveError(f"its arrays have more bytes than the {size} of the archive")
        for member in members:
            with archive.open(member) as stream:
                found[member.filename.removesuffix(".npy")] = _array(stream, member)
    return found


def _array(stream: IO[bytes], member: zipfile.ZipInfo) -> NDArray[Any]:
    version = numpy_format.read_magic(stream)
    if version not in {(1, 0), (2, 0)}:
        raise ArchiveError(f"{member.filename} is of version {version} of numpy's format")
    header = numpy_format.read_array_header_1_0 if version == (1, 0) else numpy_format.read_array_header_2_0
    shape, by_column, kind = header(stream)
    if kind.hasobject:
        raise ArchiveError(f"{member.filename} holds objects, not numbers")
    content = stream.read(member.file_size)
    if math.prod(shape) * kind.itemsize != len(content):
        raise ArchiveError(f"{member.filename} announces {shape} of {kind} and has {len(content)} bytes")
    # A copy, since what is made of bytes cannot be written to.
    return np.frombuffer(content, dtype=kind).reshape(shape, order="F" if by_column else "C").copy()
