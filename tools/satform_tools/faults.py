"""What goes wrong in a command, as sentences for the person who typed it."""

import errno


class CommandError(Exception):
    """A command that cannot do what was asked; its text is what the user reads."""


def sentence_of(error: OSError) -> str:
    """What the operating system refused, and where."""
    if error.errno == errno.ENOSPC:
        reason = "the disk is full"
    else:
        reason = (error.strerror or str(error) or type(error).__name__).lower()
    return f"{error.filename}: {reason}" if error.filename else reason
