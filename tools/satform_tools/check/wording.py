# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Texts that several subjects of `check` share."""

from collections.abc import Sequence

_NAMED = 6
"""Satellites that a sentence names at most."""


def listed(names: Sequence[str]) -> str:
    """Names with commas between them, the first few of many."""
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
