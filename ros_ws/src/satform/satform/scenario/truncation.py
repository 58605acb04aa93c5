# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What of a file a flight does not reach that settings laid over the file have shortened."""

from collections.abc import Iterable
from typing import Any

from pydantic import ValidationError

from satform.common.spec import FieldPath, specs
from satform.scenario.expectation import Expectation

_SLACK = 1e-9
"""Relative, between two times that are meant to be the same."""

ListIndices = dict[str, set[int]]
"""Indices of entries in lists, by the name of the list."""


def beyond_the_end(written: Any, flown: Any, changed: Iterable[FieldPath]) -> ListIndices:
    """What is listed with a time beyond the end of a flight that settings have shortened.

    An expectation is beyond it when the shorter flight does not have its figure: see `Expectation.needs`.

    Args:
        written: the scenario as plain data, as its file has it.
        flown: the same with the settings laid over it.
        changed: what those settings have changed; what is among it is meant for the shorter flight.

    Returns:
        Indices in the lists `expect`, `faults`, `graph_schedule` and `reconfigurations`, of those that have
        any; none when the flight is as long as written, or cannot be understood.
    """
    paths = list(changed)
    try:
        duration, shorter = float(written["timing"]["duration"]), float(flown["timing"]["duration"])
        step = float(flown["timing"]["step"])
    except (KeyError, TypeError, ValueError):
        return {}
    if shorter >= duration:
        return {}
    beyond = {
        "expect": _beyond(written, "expect", lambda entry: _unjudged(entry, shorter, duration, step)),
        "faults": _beyond(written, "faults", lambda entry: _never(entry, shorter, duration)),
        **{
            field: _beyond(written, field, lambda entry: _never(entry, shorter, duration))
            for field in ("graph_schedule", "reconfigurations")
        },
    }
    kept: ListIndices = {}
    for field, indices in beyond.items():
        own = {path[1:2] for path in paths if path[0] == field}
        kept[field] = set() if () in own else {index for index in indices if (index,) not in own}
    return {field: indices for field, indices in kept.items() if indices}


def within_the_end(data: dict[str, Any], beyond: ListIndices) -> dict[str, Any]:
    """A scenario's plain data without what lies beyond the end, and with the labels of what is not judged."""
    kept = {
        field: [entry for index, entry in enumerate(data[field]) if index not in indices]
        for field, indices in beyond.items()
    }
    labels = [
        expectation.describe()
        for row in sorted(beyond.get("expect", ()))
        if (expectation := _expectation(data["expect"][row])) is not None
    ]
    if labels:
        kept["omitted_expectations"] = [*data.get("omitted_expectations", []), *labels]
    return {**data, **kept}


def excluded(beyond: ListIndices) -> list[str]:
    """Sentences about the expectations, faults and changes that are omitted from a shorter flight."""
    found = []
    if count := len(beyond.get("expect", ())):
        need = "expectation needs" if count == 1 else "expectations need"
        found.append(f"{count} {need} a longer flight and {_are(count)} omitted")
    for field, one, several in (
        ("faults", "fault begins", "faults begin"),
        ("graph_schedule", "change of the graph is", "changes of the graph are"),
        ("reconfigurations", "reconfiguration is", "reconfigurations are"),
    ):
        if count := len(beyond.get(field, ())):
            begin = one if count == 1 else several
            found.append(f"{count} {begin} after the end of the shorter flight and {_are(count)} omitted")
    return found


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def _beyond(written: Any, field: str, lies_beyond: Any) -> set[int]:
    entries = written.get(field)
    if not isinstance(entries, list):
        return set()
    return {row for row, entry in enumerate(entries) if lies_beyond(entry)}


def _expectation(entry: Any) -> Expectation | None:
    """An expectation from plain data; None where it is not one, which the model says."""
    try:
        found = specs("satform.metrics")[entry["kind"]].model_validate(entry)
    except (KeyError, TypeError, ValidationError):
        return None
    return found if isinstance(found, Expectation) else None


def _unjudged(entry: Any, shorter: float, duration: float, step: float) -> bool:
    """Whether an expectation can be judged of the flight as written, but not of the shorter one."""
    expectation = _expectation(entry)
    if expectation is None or expectation.ends(duration) > duration * (1 + _SLACK):
        # What lies beyond the flight as written is wrong in any flight.
        return False
    return shorter * (1 + _SLACK) < expectation.needs(duration, step)


def _never(entry: Any, shorter: float, duration: float) -> bool:
    """Whether a fault or a change happens in the flight as written, but not in the shorter one."""
    at = entry.get("at") if isinstance(entry, dict) else None
    return isinstance(at, int | float) and shorter * (1 - _SLACK) <= at < duration
