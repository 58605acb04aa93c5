# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks of options that several plans take."""

import math

from satform_tools.errors import CommandError


def require_period(period: float) -> None:
    """Refuse the period of no orbit, s.

    Raises:
        CommandError: it is not above zero.
    """
    if not period > 0.0:
        raise CommandError(f"--period {period:g}: an orbit takes a positive time")


def numbers(option: str, text: str, count: int) -> list[float]:
    """Finite numbers of an option, written with commas between them.

    Args:
        option: its name.
        text: as it was given.
        count: of the numbers.

    Raises:
        CommandError: the text has not this form.
    """
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count or not all(math.isfinite(number) for number in found):
        raise CommandError(f"{option} {text}: takes {count} numbers with commas between them")
    return found
