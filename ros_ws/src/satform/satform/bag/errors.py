# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The error of bags that cannot be read."""

from satform.common.printable_text import printable


class BagError(ValueError):
    """A bag that cannot be read; the message says which, where and why, on one line."""

    def __str__(self) -> str:
        """The message; what it quotes from the bag may be any text."""
        return printable(super().__str__())
