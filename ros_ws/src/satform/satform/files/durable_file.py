# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that are there whole or not at all, also after a full disk or a power cut."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

FULL = (errno.ENOSPC, errno.EDQUOT)
"""Errors by which the system says that there is no room."""

_NOT_SUPPORTED = (errno.EINVAL, errno.ENOTSUP, errno.EACCES, errno.EPERM)
"""Errors of a folder that cannot be synchronised, or not by this user."""


@contextmanager
def durable_file(path: Path) -> Iterator[BinaryIO]:
    """Write a file under a draft's name, and give it its own once all of it is on the disk.

    Args:
        path: of the file; one that is there already stays as it is until the new one is whole.

    Yields:
        The open draft.

    Raises:
        OSError: it cannot be written; it names the path, and no draft is left.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with draft.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        _discard(draft)
        # What the system says of a write names no file.
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    except BaseException:
        _discard(draft)
        raise


def write_durably(path: Path, data: bytes) -> None:
    """Write a file whole or not at all.

    Raises:
        OSError: it cannot be written; it names the path.
    """
    with durable_file(path) as file:
        file.write(data)


def free_space_text(path: Path) -> str:
    """Where the disk of a path is mounted and what is free there, for a sentence about a full one."""
    folder = path.absolute()
    while not (folder.is_mount() or folder == folder.parent):
        folder = folder.parent
    try:
        disk = os.statvfs(folder)
    except OSError:
        return f"it is mounted at {folder}"
    free, size = disk.f_bavail * disk.f_frsize, disk.f_blocks * disk.f_frsize
    return f"{folder} has {free / 1e6:.1f} MB of {size / 1e6:.1f} MB free"


def reason_text(error: OSError, path: Path) -> str:
    """Why a path could not be written: which disk is full, or what else the system said.

    Args:
        error: that was raised.
        path: that was to be written.
    """
    if error.errno in FULL:
        return f"the disk is full: {free_space_text(path)}"
    return error.strerror.lower() if error.strerror else str(error) or type(error).__name__


def _sync_folder(folder: Path) -> None:
    """Have a new name in a folder survive a power cut, where the file system can and the user may.

    Raises:
        OSError: the disk has failed.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if error.errno not in _NOT_SUPPORTED:
            raise


def _discard(draft: Path) -> None:
    with suppress(OSError):
        draft.unlink()
