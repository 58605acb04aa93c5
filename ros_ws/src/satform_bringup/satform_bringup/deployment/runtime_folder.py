# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The user's runtime folder (`$XDG_RUNTIME_DIR/satform`): small files that exist as long as a run.

The run registry (`supervisor.run_registry`) writes them. The output folder of a run is another one, which the
command `run` makes.

Files in a folder that everybody may write to can be symbolic links of another user's making, and writing to
one would overwrite any file of the user who follows it. The folder here belongs to the user alone, which is
checked on the open descriptor; all files are opened relative to it, and never through a symbolic link.
"""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_OF_OTHERS = 0o077
"""Permissions of a file for others than its owner."""

_FOLDER_FLAGS = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC

_READING = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
"""Not waiting for the writer of a FIFO."""

_LONGEST = 65536
"""Bytes of a file that are read at most."""


class RuntimeFolderError(RuntimeError):
    """The folder is not the user's alone; the message says where it is and what to do."""


def folder_path() -> Path:
    """Path of the folder: below `XDG_RUNTIME_DIR` where that is the user's own, else with temporary files.

    `XDG_RUNTIME_DIR` of another user, as `sudo -E` leaves it, is passed over.
    Source: XDG Base Directory Specification 0.8, section "Environment variables".
    """
    configured = os.environ.get("XDG_RUNTIME_DIR", "")
    if configured.startswith("/") and _is_own(Path(configured)):
        return Path(configured) / "satform"
    return Path(tempfile.gettempdir()) / f"satform-{os.geteuid()}"


@contextmanager
def opened() -> Iterator[int]:
    """Open the folder; it is made when it is not there yet.

    Yields:
        A descriptor of the folder, which is the user's own and closed to all others.

    Raises:
        RuntimeFolderError: something else is in its place.
        OSError: it cannot be made.
    """
    folder = folder_path()
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    try:
        descriptor = os.open(folder, _FOLDER_FLAGS)
    except (NotADirectoryError, OSError) as error:
        found = "a symbolic link" if folder.is_symlink() else error.strerror
        raise RuntimeFolderError(_sentence(folder, f"found {found}")) from None
    try:
        status = os.fstat(descriptor)
        if status.st_uid != os.geteuid():
            raise RuntimeFolderError(_sentence(folder, f"it belongs to the user with the id {status.st_uid}"))
        if status.st_mode & _OF_OTHERS:
            mode = stat.S_IMODE(status.st_mode)
            raise RuntimeFolderError(_sentence(folder, f"its mode is {mode:04o}, which lets others in"))
        yield descriptor
    finally:
        os.close(descriptor)


def names() -> list[str]:
    """Names of the files in the folder; none where there is no folder yet.

    Raises:
        RuntimeFolderError: something else is in its place.
    """
    if not os.path.lexists(folder_path()):
        return []
    with opened() as folder:
        return sorted(entry.name for entry in os.scandir(folder))


def read(name: str) -> str | None:
    """Text of a file of the folder; None when there is none that can be read.

    Raises:
        RuntimeFolderError: something else is in the folder's place.
    """
    with opened() as folder:
        try:
            descriptor = os.open(name, _READING, dir_fd=folder)
        except OSError:
            return None
        with os.fdopen(descriptor, "rb") as file:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                return None
            return file.read(_LONGEST).decode(errors="replace")


def write(name: str, text: str) -> None:
    """Put a file into the folder, whole or not at all.

    Raises:
        RuntimeFolderError: something else is in the folder's place.
        OSError: the file cannot be written.
    """
    draft = f".{name}.{os.getpid()}"
    with opened() as folder:
        remove_from(folder, draft)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        try:
            with os.fdopen(os.open(draft, flags, 0o600, dir_fd=folder), "wb") as file:
                file.write(text.encode())
            os.rename(draft, name, src_dir_fd=folder, dst_dir_fd=folder)
        except OSError:
            remove_from(folder, draft)
            raise


def remove(name: str) -> None:
    """Take a file out of the folder, if it is there.

    Raises:
        RuntimeFolderError: something else is in the folder's place.
    """
    with opened() as folder:
        remove_from(folder, name)


def remove_from(folder: int, name: str) -> None:
    """Take a file out of a folder that is open."""
    with suppress(OSError):
        os.unlink(name, dir_fd=folder)


def _is_own(folder: Path) -> bool:
    try:
        status = folder.stat()
    except OSError:
        return False
    own = status.st_uid == os.geteuid() and not status.st_mode & _OF_OTHERS
    return own and stat.S_ISDIR(status.st_mode) and os.access(folder, os.W_OK | os.X_OK)


def _sentence(folder: Path, found: str) -> str:
    return (
        f"{folder} is not a folder of this user alone ({found}), so nothing is written there; remove it, or "
        "set XDG_RUNTIME_DIR to a folder of your own with mode 0700"
    )
