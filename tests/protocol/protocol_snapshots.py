# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Copies and digests of the objects that fly, so that an explorer can return to a state and know it again.

Immutable parts (numbers, text, bytes, frozen dataclasses, plans, message layouts) are shared between copies.
"""

import dataclasses
import enum
import hashlib
import types
from array import array
from collections import Counter, deque
from collections.abc import Iterable
from typing import Any

import numpy as np
from pydantic import BaseModel
from rclpy.serialization import serialize_message

from satform.communication.cdr_layout import Layout
from satform.communication.message_validator import MessageValidator, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.flight.compile import FormationPlan
from satform.flight.limits import LimitCheck
from satform.membership.membership_manager import MembershipManager
from satform.protocol.formation_view import FormationView
from satform.protocol.plant_steps import PlantSteps
from satform.protocol.satellite_steps import SatelliteSteps
from satform.protocol.writers import AuthorisedWriters

_ATOMIC = (int, float, complex, str, bytes, bool, type(None), np.generic, enum.Enum, frozenset, range, type)
_SHARED = (
    Layout,
    Stamps,
    FormationPlan,
    LimitCheck,
    types.FunctionType,
    types.BuiltinFunctionType,
    BaseModel,
)

UNSEEN = {
    RejectionCounter: {"counts"},
    MessageValidator: {"repeated"},
    PlantSteps: {"busy_seconds"},
    SatelliteSteps: {"pulse", "busy_seconds"},
    MembershipManager: {"_ready"},
    AuthorisedWriters: {"_rejected"},
    FormationView: {"received_statuses"},
}
"""Attributes that decide nothing in a flight in lockstep: counters of diagnostics and of timeouts, who was
ready before the flight, and why a writer was rejected (its next message is rejected for the same reason)."""


def _is_shared(value: Any) -> bool:
    return (
        isinstance(value, _SHARED)
        or _is_message(value)
        or (
            dataclasses.is_dataclass(value) and type(value).__dataclass_params__.frozen  # type: ignore[attr-defined]
        )
    )


def _is_message(value: Any) -> bool:
    """Whether it is a message of rosidl; one is made anew for each that is published."""
    return hasattr(type(value), "get_fields_and_field_types")


def clone(value: Any, memo: dict[int, Any] | None = None) -> Any:
    """A copy that shares nothing that can change."""
    memo = {} if memo is None else memo
    if isinstance(value, _ATOMIC) or _is_shared(value):
        return value
    known = memo.get(id(value))
    if known is not None:
        return known
    copy = memo[id(value)] = _empty_copy(value, memo)
    if isinstance(value, list | deque):
        copy.extend(clone(item, memo) for item in value)
    elif isinstance(value, dict):
        for key, item in value.items():
            copy[key] = clone(item, memo)
    elif hasattr(value, "__dict__") and not isinstance(value, types.MethodType):
        for key, item in vars(value).items():
            copy.__dict__[key] = clone(item, memo)
    return copy


def _empty_copy(value: Any, memo: dict[int, Any]) -> Any:
    """A copy of which the members are still to be filled in, where it has members that can refer to it."""
    kind = type(value)
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, tuple):
        return tuple(clone(item, memo) for item in value)
    if isinstance(value, set):
        return set(value)
    if isinstance(value, deque):
        return deque(maxlen=value.maxlen)
    if isinstance(value, types.MethodType):
        return types.MethodType(value.__func__, clone(value.__self__, memo))
    if kind in (list, dict, Counter):
        return kind()
    if not hasattr(value, "__dict__"):
        raise TypeError(f"cannot copy a {kind.__name__}")
    return object.__new__(kind)


def digest(value: Any) -> bytes:
    """Digest of everything that a value holds and that decides what it does next."""
    parts: list[bytes] = []
    _collect(value, parts, {})
    return hashlib.blake2b(b"\0".join(parts), digest_size=16).digest()


def _collect(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
    if isinstance(value, bytes):
        parts.append(value)
    elif isinstance(value, enum.Enum | int | float | str | bool | type(None) | np.generic | range | type):
        parts.append(repr(value).encode())
    elif isinstance(value, np.ndarray | array):
        parts.append(value.tobytes())
    elif isinstance(value, _SHARED):
        parts.append(b"shared")
    elif _is_message(value):
        parts.append(_of_frozen(value, value.get_fields_and_field_types()))
    elif id(value) in seen:
        parts.append(b"again %d" % seen[id(value)])
    else:
        seen[id(value)] = len(seen)
        _collect_members(value, parts, seen)


def _collect_members(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
    if isinstance(value, dict):
        for key, item in sorted(value.items(), key=lambda item: repr(item[0])):
            parts.append(repr(key).encode())
            _collect(item, parts, seen)
    elif isinstance(value, set | frozenset):
        parts.extend(repr(item).encode() for item in sorted(value, key=repr))
    elif isinstance(value, list | tuple | deque):
        parts.append(b"[%d" % len(value))
        for item in value:
            _collect(item, parts, seen)
    elif isinstance(value, types.MethodType):
        parts.append(value.__func__.__name__.encode())
    elif dataclasses.is_dataclass(value) and not _may_change(value):
        parts.append(_of_frozen(value, [field.name for field in dataclasses.fields(value)]))
    else:
        _collect_attributes(value, parts, seen)


def _collect_attributes(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
    if not hasattr(value, "__dict__"):
        raise TypeError(f"cannot make a digest of a {type(value).__name__}")
    unseen = UNSEEN.get(type(value), set())
    parts.append(type(value).__name__.encode())
    for key, item in vars(value).items():
        if key not in unseen:
            parts.append(key.encode())
            _collect(item, parts, seen)


def _may_change(value: Any) -> bool:
    return not type(value).__dataclass_params__.frozen


_FROZEN: dict[int, tuple[Any, bytes]] = {}
"""Digests of frozen dataclasses and messages by identity, each with the object so that its identity is
not used again."""


def _of_frozen(value: Any, names: Iterable[str]) -> bytes:
    known = _FROZEN.get(id(value))
    if known is None:
        known = _FROZEN[id(value)] = value, _of_fields(value, names)
    return known[1]


def _of_fields(value: Any, names: Iterable[str]) -> bytes:
    parts: list[bytes] = []
    for name in names:
        _collect(getattr(value, name), parts, {})
    return hashlib.blake2b(b"\0".join(parts), digest_size=16).digest()


_SERIALIZED: dict[bytes, bytes] = {}
"""Bytes of messages by the digest of their fields."""


def serialized(message: Any) -> bytes:
    """A message in bytes: equal ones for equal messages, though rclpy does not set the padding of fields."""
    fields = message.get_fields_and_field_types()
    key = type(message).__name__.encode() + _of_fields(message, fields)
    return _SERIALIZED.setdefault(key, serialize_message(message))
