# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Angles as text with their unit: `45 deg` where radians are asked, `0.06 deg/s` for radians a second."""

import math
import re
from typing import Any

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?"

DEGREES = rf"^ *{_NUMBER} *deg *$"
"""Text that stands for an angle."""

DEGREES_PER_SECOND = rf"^ *{_NUMBER} *deg/s *$"
"""Text that stands for an angular rate."""

_EITHER = rf"^ *{_NUMBER} *deg(/s)? *$"


def _radians(value: Any) -> Any:
    """An angle in rad from a text in degrees; what is no text stays as it is."""
    return _converted(value, DEGREES, "rad", "45 deg")


def _radians_per_second(value: Any) -> Any:
    """An angular rate in rad/s from a text in degrees a second; what is no text stays as it is."""
    return _converted(value, DEGREES_PER_SECOND, "rad/s", "0.06 deg/s")


def _converted(value: Any, pattern: str, unit: str, example: str) -> Any:
    if not isinstance(value, str):
        return value
    if re.match(pattern, value):
        return math.radians(float(value.partition("deg")[0]))
    # The loader puts what was found in front of it.
    sentence = 'Input should be a number of {unit}, or text such as "{example}"'
    raise PydanticCustomError("angle", sentence, {"unit": unit, "example": example})


def _radians_of_either(value: Any) -> Any:
    """Radians from text in degrees, rad/s from text in degrees a second; anything else stays as it is."""
    if isinstance(value, str) and re.match(_EITHER, value):
        return math.radians(float(value.partition("deg")[0]))
    return value


OR_DEGREES = BeforeValidator(_radians)
"""Annotation of a field in rad that takes text in degrees, too."""

OR_DEGREES_PER_SECOND = BeforeValidator(_radians_per_second)
"""Annotation of a field in rad/s that takes text in degrees a second, too."""

OR_EITHER_ANGLE = BeforeValidator(_radians_of_either)
"""Annotation of a number for a field of any unit that takes text in degrees, or degrees a second, too."""

PATTERNS: dict[Any, str] = {
    _radians: DEGREES,
    _radians_per_second: DEGREES_PER_SECOND,
    _radians_of_either: _EITHER,
}
"""By the function that takes such a text, which text it takes."""


def radians_of(text: str, pattern: str) -> float | None:
    """Number of a text of one of the patterns, rad or rad/s; None for another text.

    Args:
        text: such as `45 deg`.
        pattern: one of `PATTERNS`; empty for none.
    """
    return math.radians(float(text.partition("deg")[0])) if pattern and re.match(pattern, text) else None


def is_angle(value: Any) -> bool:
    """Whether a value is a text that stands for an angle or a rate."""
    return isinstance(value, str) and any(re.match(pattern, value) for pattern in PATTERNS.values())
