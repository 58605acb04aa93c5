"""Which of a file's expectations a flight does not reach that settings laid over the file have shortened."""

from collections.abc import Iterable
from typing import Any

from pydantic import ValidationError

from satform.metrics import Expectation
from satform.scenario.sentences import Path
from satform.spec import specs

_SLACK = 1e-9
"""Relative, between two times that are meant to be the same."""


def beyond_the_end(written: Any, flown: Any, changed: Iterable[Path]) -> set[int]:
    """Places of the expectations that lie beyond the end of a shortened flight, but not of the written one.

    Args:
        written: the scenario as plain data, as its file has it.
        flown: the same with the settings laid over it.
        changed: what those settings have changed; an expectation among it is meant for the shorter flight.

    Returns:
        Places in the list; none when the flight is as long as written, or cannot be understood.
    """
    own = {path[1:2] for path in changed if path[0] == "expect"}
    try:
        duration, shorter = float(written["timing"]["duration"]), float(flown["timing"]["duration"])
        entries = list(written["expect"])
    except (KeyError, TypeError, ValueError):
        return set()
    if () in own or shorter >= duration:
        return set()
    return {
        place
        for place, entry in enumerate(entries)
        if (place,) not in own
        and shorter * (1 + _SLACK) < _needed_duration(entry, duration) <= duration * (1 + _SLACK)
    }


def left_out(count: int) -> str:
    """What is said about expectations that were left out."""
    if count == 1:
        return "1 expectation lies beyond the shorter flight and is not judged"
    return f"{count} expectations lie beyond the shorter flight and are not judged"


def _needed_duration(entry: Any, duration: float) -> float:
    """How long a flight has to last for one expectation, s; 0 where that cannot be understood."""
    try:
        expectation = specs("satform.metrics")[entry["kind"]].model_validate(entry)
    except (KeyError, TypeError, ValidationError):
        return 0.0
    return expectation.needs(duration) if isinstance(expectation, Expectation) else 0.0
