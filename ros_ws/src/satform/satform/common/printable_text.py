# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Text of a user's file within a sentence: on one line, and without anything that steers a terminal."""

LONGEST = 200
"""Characters of an error of another library, which may quote all of a file."""


def reason(error: BaseException) -> str:
    """What an error of another library says, on one line and shortened; its class where it says nothing."""
    text = printable(" ".join(str(error).split())) or type(error).__name__
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def printable(text: str) -> str:
    r"""A text in which line breaks and control characters stand as Python writes them, such as `\n`."""
    if text.isprintable():
        return text
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in text)
