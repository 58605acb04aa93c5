"""What goes wrong in a command, as sentences for the person who typed it."""

import errno
from typing import ClassVar

from satform.exit_codes import EXIT_BAD_INPUT, EXIT_MISSED


class CommandError(Exception):
    """A command that cannot do what was asked; its text is what the user reads.

    Attributes:
        exit_code: with which the command ends.
    """

    exit_code: ClassVar[int] = EXIT_BAD_INPUT


class InfeasibleError(CommandError):
    """What was asked for is well formed, but nothing keeps its constraints."""

    exit_code: ClassVar[int] = EXIT_MISSED


def sentence_of(error: OSError) -> str:
    """What the operating system refused, and where."""
    if error.errno == errno.ENOSPC:
        reason = "the disk is full"
    else:
        # The system begins its words with a capital letter; ours may hold names that are written so.
        reason = error.strerror.lower() if error.strerror else str(error) or type(error).__name__
    return f"{error.filename}: {reason}" if error.filename else reason
