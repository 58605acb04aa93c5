# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The compiled part of the transport, package `satform_transport`, where it is built and not switched off."""

import os
from typing import TYPE_CHECKING, Any

from satform.communication.message_validator import (
    EXACT,
    MessageRules,
    MessageValidator,
    Reason,
    RejectionCounter,
)
from satform.communication.sim_time import Stamps
from satform_nodes.transport.cdr_codec import Layout

if TYPE_CHECKING:
    from satform_transport.hot_path import MessageWaiter

PYTHON_TRANSPORT = "SATFORM_PYTHON_TRANSPORT"
"""Environment variable: if set, the nodes wait for messages and validate them in Python."""

_VERDICTS = (None, Reason.FORM, Reason.NOT_DUE, Reason.CONTRADICTION, Reason.NOT_FINITE, Reason.RANGE)
"""Why a message is rejected, by the number that `NumberCheck` returns; None for a repetition."""

_CODES = {
    "f8": "d",
    "f4": "f",
    "i1": "b",
    "u1": "B",
    "i2": "h",
    "u2": "H",
    "i4": "i",
    "u4": "I",
    "i8": "q",
    "u8": "Q",
    "b1": "?",
}
"""Codes of the module `struct`, by kind and size of a number."""


def is_used() -> bool:
    """Whether the compiled part is built and not switched off."""
    return PYTHON_TRANSPORT not in os.environ and _module() is not None


def message_waiter() -> "MessageWaiter | None":
    """What counts arriving messages and waits for them; None where the compiled part is not used."""
    module = _module() if is_used() else None
    return None if module is None else module.MessageWaiter()


def new_validator(
    topic: str, form: Layout, rejections: RejectionCounter, stamps: Stamps, rules: MessageRules = EXACT
) -> MessageValidator:
    """A validator, compiled if it can be; the arguments are those of `MessageValidator`."""
    kind = CompiledValidator if is_used() else MessageValidator
    return kind(topic, form, rejections, stamps, rules)


class CompiledValidator(MessageValidator):
    """Decides as its parent class does, in compiled code."""

    def __init__(
        self,
        topic: str,
        form: Layout,
        rejections: RejectionCounter,
        stamps: Stamps,
        rules: MessageRules = EXACT,
    ) -> None:
        super().__init__(topic, form, rejections, stamps, rules)
        lengths = dict(self._lengths)
        entries = form.dtype.fields
        assert entries is not None  # noqa: S101 - a structured type
        fields = tuple(
            (_CODES[entries[name][0].str[1:]], int(entries[name][1]), lengths.get(index, -1))
            for index, name in enumerate(form.fields)
        )
        self._check = (
            _module()
            .NumberCheck(
                form.size,
                fields,
                form.constant,
                stamps.step_nanoseconds,
                rules.exact,
                *(rules.unbounded if rules.unbounded[1] else (0, 0)),
                rules.largest,
            )
            .check
        )

    def validate(self, data: bytes, first: int, last: int) -> tuple[Any, ...] | None:
        """As in the parent class."""
        found = self._check(data, first, last)
        if found.__class__ is tuple:
            reason = self._further(found) if self._further else ""
            if not reason:
                numbers: tuple[Any, ...] = found
                return numbers
        else:
            verdict = _VERDICTS[found]
            if verdict is None:
                self.repeated += 1
                return None
            reason = verdict
        self._reject(reason)
        return None


def _module() -> Any:
    """The compiled module; None where it is not built."""
    try:
        from satform_transport import hot_path  # noqa: PLC0415 - may be missing
    except ImportError:
        return None
    return hot_path
