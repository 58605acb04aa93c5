# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lists of names in messages, shortened if there are many."""

from collections.abc import Sequence

MAX_NAMES = 8
"""Names in a message by default; a formation may have a thousand."""


def listed(names: Sequence[str], at_most: int = MAX_NAMES) -> str:
    """Names separated by commas, the first of many: `sat1, sat2`, or `s0, s1, ... s7 and 504 more`.

    Args:
        names: in the order in which they are listed.
        at_most: number of names after which only the rest is counted.
    """
    rest = len(names) - at_most
    text = ", ".join(names[:at_most])
    return f"{text} and {rest} more" if rest > 0 else text
