# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Pieces of the sentences that people read."""

from collections.abc import Sequence

_MOST_LISTED = 8
"""Names in a sentence; a formation may have a thousand."""


def listed(names: Sequence[str]) -> str:
    """Names for a sentence, the first few of many: `sat1, sat2`, or `s0, s1, ... s7 and 504 more`."""
    left = len(names) - _MOST_LISTED
    words = ", ".join(names[:_MOST_LISTED])
    return f"{words} and {left} more" if left > 0 else words
