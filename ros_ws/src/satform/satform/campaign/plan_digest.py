# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Digest of all that is flown: two scenarios with the same digest have the same flight, bit for bit."""

import functools
import hashlib
import types
from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any

import numpy as np

from satform.flight.compile import compile_scenario
from satform.scenario import Scenario


def plan_digest(scenario: Scenario) -> str:
    """SHA-256 of the compiled plans of a scenario's flight.

    What is described but not flown does not count: a default that every satellite overrides, the properties
    of a link without an edge, expectations, and how long processes wait for each other.

    Args:
        scenario: validated.

    Returns:
        Hexadecimal.
    """
    plan = compile_scenario(scenario)
    names = plan.names
    links = plan.links.links
    # Only links that some edge of the graph uses are flown.
    edges = [
        links.of(names[sender], names[receiver])
        for receiver in range(len(names))
        for sender in plan.membership.possible_graph.neighbours(receiver)
        if links is not None
    ]
    flown = (
        (plan.timing.step, plan.timing.steps, plan.timing.checkpoint_steps),
        plan.membership,
        plan.faults,
        (plan.links.seed, edges),
        plan.plant,
        plan.limits,
        [plan.satellite(index) for index in range(len(names))],
    )
    return _digest(flown)


def _digest(value: Any) -> str:
    found = hashlib.sha256()
    for part in _parts(value, {}):
        found.update(part)
    return found.hexdigest()


def _parts(value: Any, seen: dict[int, tuple[int, Any]]) -> Iterator[bytes]:
    """The content of plain data, arrays and objects, in a fixed order."""
    if value is None or isinstance(value, bool | int | float | complex | str | bytes | Enum | type):
        yield f"{type(value).__name__}:{value!r};".encode()
    elif isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        yield f"array:{array.dtype}{array.shape};".encode()
        if array.dtype.hasobject:
            yield from _parts(array.tolist(), seen)
        else:
            yield array.tobytes()
    elif id(value) in seen:
        # What is shared, or contains itself, is named by the order in which it was met.
        yield f"seen:{seen[id(value)][0]};".encode()
    else:
        # Kept, so that no other object takes its identity.
        seen[id(value)] = (len(seen), value)
        yield from _inner(value, seen)


def _inner(value: Any, seen: dict[int, tuple[int, Any]]) -> Iterator[bytes]:
    yield f"{type(value).__name__}(".encode()
    for part in _within(value):
        yield from _parts(part, seen)
    yield b")"


def _within(value: Any) -> list[Any]:
    if isinstance(value, Mapping):
        return [part for item in value.items() for part in item]
    if isinstance(value, set | frozenset):
        return sorted(value, key=repr)
    if isinstance(value, list | tuple):
        return list(value)
    if isinstance(value, functools.partial):
        return [value.func, value.args, value.keywords]
    if isinstance(value, types.MethodType):
        return [value.__func__, value.__self__]
    if isinstance(value, types.FunctionType):
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        return [value.__module__, value.__qualname__, *cells]
    slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    attributes = {name: getattr(value, name) for name in slots if hasattr(value, name)}
    # What an object computes once it is asked for is no part of what it is.
    attributes |= {
        name: own
        for name, own in getattr(value, "__dict__", {}).items()
        if not isinstance(getattr(type(value), name, None), functools.cached_property)
    }
    return [type(value).__qualname__, attributes] if attributes else [type(value).__qualname__, repr(value)]
