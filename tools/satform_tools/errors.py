# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of commands as sentences for the user."""

import errno
from pathlib import Path
from typing import ClassVar

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_MISSED
from satform.files.durable_file import free_space_text

_NO_THREAD = "can't start new thread"
"""What Python says where the system gives no more threads."""


class CommandError(Exception):
    """A command that cannot do what was asked; its text is what the user reads.

    Attributes:
        exit_code: with which the command ends.
    """

    exit_code: ClassVar[int] = EXIT_BAD_INPUT


class InfeasibleError(CommandError):
    """The request is valid, but no solution meets its constraints."""

    exit_code: ClassVar[int] = EXIT_MISSED


def sentence_of(error: OSError) -> str:
    """The sentence about an error of the operating system."""
    if error.errno == errno.ENOSPC:
        # Standard output has a name that is no path.
        is_path = "/" in str(error.filename or "")
        where = f": {free_space_text(Path(str(error.filename)))}" if is_path else ""
        reason = f"the disk is full (no space, or no inodes){where}"
    elif error.errno in {errno.EMFILE, errno.ENFILE}:
        reason = "too many files are open (ulimit -n)"
    else:
        # The system begins its text with a capital letter; ours may begin with a name.
        reason = error.strerror.lower() if error.strerror else str(error) or type(error).__name__
    return f"{error.filename}: {reason}" if error.filename else reason


def error_sentences(error: Exception) -> list[str]:
    """The sentences about an error.

    Args:
        error: that ended the command.

    Returns:
        Sentences; none where the error is not about the input or the machine, but a mistake in the program.
    """
    # By what it has: the class is not there yet where the program cannot be loaded.
    problems = getattr(error, "problems", None)
    if problems:
        return [str(problem) for problem in problems]
    match error:
        case CommandError():
            return [str(error)]
        case OSError():
            return [sentence_of(error)]
        case MemoryError():
            return ["there is not enough memory for that on this machine (ulimit -v, or a container's limit)"]
        case RecursionError():
            return ["the input is nested too deeply to be read"]
        case UnicodeError():
            return [f"a text is not UTF-8: {error}"]
        case ImportError() if "cannot allocate memory" in str(error).lower() or "map segment" in str(error):
            return ["there is not enough memory to load the program (ulimit -v, or a container's limit)"]
        case RuntimeError() if _NO_THREAD in str(error):
            return ["the system gives no more threads (ulimit -u, ulimit -v, or a container's limit)"]
    return []
