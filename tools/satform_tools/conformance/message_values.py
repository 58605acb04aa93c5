# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers in the messages of a satellite, as the rules compare them."""

import math
from collections.abc import Iterable
from typing import Any

from satform.communication.message_validator import LARGEST


def numbers_of(message: Any) -> list[float]:
    """All numbers of a message beside its header, its step and the value of a violation."""
    found: list[float] = []
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if isinstance(value, float) and name != "violating_value":
            found.append(value)
        elif hasattr(value, "x"):
            found += _vector(value)
    return found


def are_valid(values: Iterable[float]) -> bool:
    """Whether all numbers are finite, and not larger than a message may have."""
    return all(math.isfinite(value) and abs(value) <= LARGEST for value in values)


def announced_by_command(command: Any) -> list[float]:
    """Arc length in m, rate in m/s, position in m and velocity in m/s that a command repeats."""
    phase = [command.announced_arc_length, command.announced_rate]
    return [*phase, *_vector(command.announced_position), *_vector(command.announced_velocity)]


def announced_values(message: Any) -> list[float]:
    """The same numbers of a phase or a motion; those that it does not have are zero."""
    if hasattr(message, "arc_length"):
        return [message.arc_length, message.rate, *[0.0] * 6]
    return [0.0, 0.0, *_vector(message.position), *_vector(message.velocity)]


def _vector(values: Any) -> list[float]:
    return [values.x, values.y, values.z]
