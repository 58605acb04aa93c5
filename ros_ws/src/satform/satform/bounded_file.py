"""Reading files that may come from anywhere: regular files only, and no more of them than is expected."""

import errno
import os
import stat
from pathlib import Path

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
    # Without O_NONBLOCK opening a pipe waits for someone who writes to it.
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            kinds = (sentence for is_kind, sentence in _KINDS if is_kind(status.st_mode))
            raise OSError(errno.EINVAL, next(kinds, "is not a regular file"), str(path))
        # A file in /proc says that it is empty, and another may grow while it is read.
        with os.fdopen(handle, "rb", closefd=False) as file:
            content = file.read(limit + 1)
    finally:
        os.close(handle)
    if len(content) > limit:
        raise OSError(errno.EFBIG, too_large(max(status.st_size, len(content)), limit, what), str(path))
    return content


def too_large(size: int, limit: int, what: str) -> str:
    """That something has more bytes than is allowed, in words that follow its name."""
    return f"has {size} bytes; {what} has at most {limit}"
