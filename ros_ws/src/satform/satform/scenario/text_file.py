# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the files of scenarios and of campaigns share: how they are read, and how many problems are said."""

from collections.abc import Sequence
from pathlib import Path

from satform.files.bounded_file import read_bounded
from satform.scenario.errors import Problem, ScenarioError

MAXIMUM_FILE_BYTES = 2_000_000
"""A larger file is refused unread; half a megabyte holds a thousand satellites."""

MAXIMUM_PROBLEMS = 200
"""Said at once; nobody reads more before mending these."""


def read_text_file(path: str | Path, what: str) -> str:
    """The text of a file.

    Args:
        path: of the file.
        what: the file is, for the sentence about its size.

    Raises:
        ScenarioError: it cannot be read, is too large or is not UTF-8 text.
    """
    try:
        return read_bounded(Path(path), MAXIMUM_FILE_BYTES, what).decode()
    except OSError as error:
        sentence = f"cannot be read: {error.strerror}"
    except UnicodeDecodeError as error:
        sentence = f"is not UTF-8 text: byte {error.object[error.start]:#04x} at offset {error.start}"
    except ValueError:
        # Python's own word for a name with a null character.
        sentence = "is not a possible file name"
    raise ScenarioError([Problem(str(path), None, "", sentence)])


def first_problems(found: Sequence[Problem]) -> list[Problem]:
    """The first `MAXIMUM_PROBLEMS` of at least one problem, and how many more there are."""
    first = list(found[:MAXIMUM_PROBLEMS])
    more = len(found) - len(first)
    return [*first, Problem(first[0].file, None, "", f"and {more} more; mend these first")] if more else first
