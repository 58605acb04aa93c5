# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Paths of fields in text: `satellites[0].scale`, `satellites.0.scale`, `satellites[sat1].scale`.

Fields have dots between them. An entry of a list is given by its index, its name, or `*` for all entries.
"""

import re
from collections.abc import Sequence

from satform.common.name_list import listed

_IN_BRACKETS = re.compile(r"\[([^\[\]]*)\]")


def path_parts(text: str) -> list[str]:
    """Fields and entries of lists of a path, in order."""
    return _IN_BRACKETS.sub(r".\1", text).split(".")


def entry_indices(part: str, names: Sequence[str]) -> Sequence[int] | None:
    """The entries of a list that a part of a path means.

    Args:
        part: an index, a name, or `*`.
        names: of all entries, empty for one without.

    Returns:
        Their indices, ascending; None where there is no such entry.
    """
    if part == "*":
        return range(len(names))
    # Digits of other scripts are digits too, and Python rejects the longest numbers.
    if part.isascii() and part.isdigit() and len(part) < 9:
        return [int(part)] if int(part) < len(names) else None
    return [names.index(part)] if part and part in names else None


def entries_text(names: Sequence[str]) -> str:
    """How the entries of a list may be given, for a message.

    Args:
        names: of all entries, empty for one without.
    """
    if not names:
        return "it has no entries"
    known = [name for name in names if name]
    by_name = f", or by name: {listed(known)}" if known else ""
    return f"entries are counted from 0 to {len(names) - 1}{by_name}"
