# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Standard output and error where they are closed, full, or read by a process that has ended.

If the reader ends, as `head` does, the rest of the output is dropped, and the command continues and ends
with its own exit code.
"""

import os
import sys
from contextlib import suppress


def prepare() -> None:
    """Open missing standard streams, and replace characters that a terminal cannot show by question marks.

    A file that is opened while a standard stream is closed takes its number, and whatever is printed there.
    """
    handle = os.open(os.devnull, os.O_RDWR)
    while handle <= 2:
        handle = os.dup(handle)
    os.close(handle)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, PTH123 - stays open
            continue
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure:
            reconfigure(errors="replace")


def write(text: str) -> None:
    """Write to standard output; nothing is written once its reader has gone.

    Raises:
        OSError: it cannot be written to, as where a disk is full.
    """
    if sys.stdout is None:
        return
    try:
        sys.stdout.write(text)
    except BrokenPipeError:
        drop()
    except OSError as error:
        drop()
        raise OSError(error.errno, error.strerror, "standard output") from None


def note(text: str) -> None:
    """Write to standard error; a remark that cannot be written is lost."""
    if sys.stderr is not None:
        with suppress(OSError, ValueError):
            sys.stderr.write(text)
            sys.stderr.flush()


def finish() -> None:
    """Flush standard output.

    Raises:
        OSError: it cannot be written, as where a disk is full.
    """
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        drop()
    except OSError as error:
        # Python would try again on its way out.
        drop()
        raise OSError(error.errno, error.strerror, "standard output") from None


def drop() -> None:
    """Discard all further output, also what Python flushes at its end."""
    with suppress(OSError, ValueError, AttributeError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
        os.close(nothing)
