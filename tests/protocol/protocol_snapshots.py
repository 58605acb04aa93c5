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
from collections import deque
from collections.abc import Callable, Iterable
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


def _is_message(kind: type) -> bool:
    """Whether it is a kind of message of rosidl; one is made anew for each that is published."""
    return hasattr(kind, "get_fields_and_field_types")


def _is_frozen(kind: type) -> bool:
    return dataclasses.is_dataclass(kind) and kind.__dataclass_params__.frozen  # type: ignore[attr-defined]


_Memo = dict[int, Any]
_Copy = Callable[[Any, _Memo], Any]

_COPIES: dict[type, _Copy] = {}
"""How objects of a class are copied, filled in as they are met."""


def clone(value: Any, memo: _Memo | None = None) -> Any:
    """A copy that shares nothing that can change."""
    memo = {} if memo is None else memo
    kind = type(value)
    copy = _COPIES.get(kind)
    if copy is None:
        copy = _COPIES[kind] = _copy_of(kind)
    return copy(value, memo)


def _copy_of(kind: type) -> _Copy:
    """How objects of a class are copied."""
    if issubclass(kind, (*_ATOMIC, *_SHARED)) or _is_message(kind) or _is_frozen(kind):
        return _same
    if issubclass(kind, np.ndarray):
        return lambda value, memo: (
            memo.get(id(value)) if id(value) in memo else _noted(value, value.copy(), memo)
        )
    known: tuple[tuple[type, _Copy], ...] = (
        (tuple, lambda value, memo: tuple([clone(item, memo) for item in value])),
        (set, lambda value, memo: _noted(value, set(value), memo)),
        (types.MethodType, lambda value, memo: types.MethodType(value.__func__, clone(value.__self__, memo))),
        (deque, _copy_items),
        (list, _copy_items),
        (dict, _copy_mapping),
    )
    for base, copy in known:
        if issubclass(kind, base):
            return copy
    return _copy_object


def _same(value: Any, _memo: _Memo) -> Any:
    return value


def _noted(value: Any, copy: Any, memo: _Memo) -> Any:
    memo[id(value)] = copy
    return copy


def _copy_items(value: Any, memo: _Memo) -> Any:
    known = memo.get(id(value))
    if known is not None:
        return known
    copy = _noted(value, deque(maxlen=value.maxlen) if isinstance(value, deque) else [], memo)
    copy.extend([clone(item, memo) for item in value])
    return copy


def _copy_mapping(value: Any, memo: _Memo) -> Any:
    known = memo.get(id(value))
    if known is not None:
        return known
    copy = _noted(value, type(value)(), memo)
    for key, item in value.items():
        copy[key] = clone(item, memo)
    return copy


def _copy_object(value: Any, memo: _Memo) -> Any:
    known = memo.get(id(value))
    if known is not None:
        return known
    if not hasattr(value, "__dict__"):
        raise TypeError(f"cannot copy a {type(value).__name__}")
    copy = _noted(value, object.__new__(type(value)), memo)
    members = copy.__dict__
    for key, item in value.__dict__.items():
        members[key] = clone(item, memo)
    return copy


_Collect = Callable[[Any, list[bytes], dict[int, int]], None]

_COLLECTS: dict[type, _Collect] = {}
"""How objects of a class take part in a digest, filled in as they are met."""


def digest(value: Any) -> bytes:
    """Digest of everything that a value holds and that decides what it does next."""
    parts: list[bytes] = []
    _collect(value, parts, {})
    return hashlib.blake2b(b"\0".join(parts), digest_size=16).digest()


def _collect(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
    kind = type(value)
    collect = _COLLECTS.get(kind)
    if collect is None:
        collect = _COLLECTS[kind] = _collect_of(kind)
    collect(value, parts, seen)


def _collect_of(kind: type) -> _Collect:
    """How objects of a class take part in a digest."""
    plain = (enum.Enum, int, float, str, bool, type(None), np.generic, range, type)
    known: tuple[tuple[tuple[type, ...], _Collect], ...] = (
        ((bytes,), lambda value, parts, _: parts.append(value)),
        (plain, lambda value, parts, _: parts.append(repr(value).encode())),
        ((np.ndarray, array), lambda value, parts, _: parts.append(value.tobytes())),
        (_SHARED, lambda _value, parts, _: parts.append(b"shared")),
        ((set, frozenset), _collect_set),
        ((dict,), _once(_collect_mapping)),
        ((list, tuple, deque), _once(_collect_items)),
        ((types.MethodType,), lambda value, parts, _: parts.append(value.__func__.__name__.encode())),
    )
    for bases, collect in known:
        if issubclass(kind, bases):
            return collect
    if _is_message(kind):
        names = tuple(kind.get_fields_and_field_types())  # type: ignore[attr-defined]
        return lambda value, parts, _: parts.append(_of_frozen(value, names))
    if _is_frozen(kind):
        fields = tuple(field.name for field in dataclasses.fields(kind))
        return lambda value, parts, _: parts.append(_of_frozen(value, fields))
    return _once(_attributes_of(kind))


def _once(collect: _Collect) -> _Collect:
    """Has an object that is met again stand as the one that was met before."""

    def collect_once(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
        known = seen.get(id(value))
        if known is not None:
            parts.append(b"again %d" % known)
            return
        seen[id(value)] = len(seen)
        collect(value, parts, seen)

    return collect_once


def _collect_set(value: Any, parts: list[bytes], _seen: dict[int, int]) -> None:
    parts.append(b"{%d" % len(value))
    parts.extend(repr(item).encode() for item in sorted(value, key=repr))


def _collect_mapping(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
    parts.append(b"{%d" % len(value))
    for key, item in sorted(value.items(), key=lambda item: repr(item[0])):
        parts.append(repr(key).encode())
        _collect(item, parts, seen)


def _collect_items(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
    parts.append(b"[%d" % len(value))
    for item in value:
        _collect(item, parts, seen)


def _attributes_of(kind: type) -> _Collect:
    unseen = UNSEEN.get(kind, set())
    name = kind.__name__.encode()
    encoded: dict[str, bytes] = {}

    def collect(value: Any, parts: list[bytes], seen: dict[int, int]) -> None:
        if not hasattr(value, "__dict__"):
            raise TypeError(f"cannot make a digest of a {kind.__name__}")
        parts.append(name)
        for key, item in value.__dict__.items():
            if key not in unseen:
                parts.append(encoded.get(key) or encoded.setdefault(key, key.encode()))
                _collect(item, parts, seen)

    return collect


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
