# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reading files that may come from anywhere: regular files only, and no more of them than is expected."""

import errno
import json
import math
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO

_KINDS = (
    (stat.S_ISDIR, "is a folder, not a file"),
    (stat.S_ISFIFO, "is a pipe, not a file"),
    (stat.S_ISSOCK, "is a socket, not a file"),
    (stat.S_ISCHR, "is a device, not a file"),
    (stat.S_ISBLK, "is a device, not a file"),
)


def read_bounded(path: Path, limit: int, what: str = "a file of this kind") -> bytes:
    """The content of a regular file that is not larger than a limit.

    Pipes and devices have no size that could be checked, and reading one may never end; they are refused
    without waiting for anyone.

    Args:
        path: of the file.
        limit: largest size, bytes.
        what: the file is, for the sentence about its size.

    Returns:
        The content.

    Raises:
        OSError: it is not a regular file, is too large, or cannot be read; `strerror` says which.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        # A file in /proc says that it is empty, and another may grow while it is read.
        content = file.read(limit + 1)
    if len(content) > limit:
        raise OSError(errno.EFBIG, too_large(max(size, len(content)), limit, what), str(path))
    return content


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading.

    Args:
        path: of the file.

    Returns:
        The file, to be closed by the caller.

    Raises:
        OSError: it is not a regular file, or cannot be opened; `strerror` says which.
    """
    # Without O_NONBLOCK opening a pipe waits for someone who writes to it.
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        mode = os.fstat(handle).st_mode
        if not stat.S_ISREG(mode):
            kinds = (sentence for is_kind, sentence in _KINDS if is_kind(mode))
            raise OSError(errno.EINVAL, next(kinds, "is not a regular file"), str(path))
        return os.fdopen(handle, "rb")
    except OSError:
        os.close(handle)
        raise


def is_file(path: Path) -> bool:
    """Whether there is a file of that name; False as well for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_json(path: Path, limit: int) -> Any:
    """The data of a JSON file.

    Args:
        path: of the file.
        limit: largest size, bytes.

    Returns:
        The data.

    Raises:
        OSError: it cannot be read, or is too large.
        ValueError: it is not JSON in UTF-8, has a number that is not finite, or is nested too deeply; the
            message says which.
    """
    try:
        text = read_bounded(path, limit, "a file of this kind")
        return json.loads(text, parse_constant=_finite, parse_float=_finite)
    except UnicodeDecodeError:
        raise ValueError("is not UTF-8 text") from None
    except RecursionError:
        raise ValueError("is nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"is not JSON: {error}") from None


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text:.40} is not a finite number")
    return number


def too_large(size: int, limit: int, what: str) -> str:
    """That something has more bytes than is allowed, in words that follow its name."""
    return f"has {size} bytes; {what} has at most {limit}"
