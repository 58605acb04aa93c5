# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Validation of received messages: form and size, step, stamp, finite numbers, range.

Whether the publisher is authorised is decided before, by `satform.protocol.writers`. A rejected
message has no effect but to be counted, by topic and reason.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite
from typing import Any

from satform.communication.cdr_layout import Layout
from satform.communication.sim_time import Stamps

LARGEST = 1e15
"""Magnitude above which no number of a formation lies, in SI units."""


class Reason(StrEnum):
    """Why a message is rejected."""

    FORM = "another form"
    NOT_DUE = "a step that is not due yet"
    CONTRADICTION = "a stamp that contradicts its step"
    NOT_FINITE = "not finite"
    RANGE = "out of range"


CONTRADICTION = Reason.CONTRADICTION
"""Reason for the rejection of a message whose stamp is no time at which a message of its step is made."""

EARLIER_STAMPS = frozenset({"state", "arc_length", "motion", "navigation_estimate", "group_phase"})
"""Kinds of topics whose stamps may be of an earlier step: when it was measured, when a phase was held, or
estimated."""

_MOST_REASONS = 200
"""Topics and reasons that are counted apart: they contain names of unauthorised nodes, which may be many."""


class RejectionCounter:
    """Counts the messages that a node has rejected.

    Attributes:
        counts: messages by topic and reason.
    """

    def __init__(self) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()

    @property
    def total(self) -> int:
        """Number of rejected messages."""
        return self.counts.total()

    def add(self, topic: str, reason: str) -> None:
        """Count a rejected message."""
        known = (topic, reason) in self.counts or len(self.counts) < _MOST_REASONS
        self.counts[topic, reason if known else "other reasons"] += 1

    def sentences(self) -> dict[str, str]:
        """Count of each topic and reason, as text."""
        return {f"{topic}: {reason}": str(count) for (topic, reason), count in sorted(self.counts.items())}


@dataclass(frozen=True)
class MessageRules:
    """What holds for the numbers of a message.

    Attributes:
        exact: whether a message has the stamp of its step; else it may have that of an earlier one.
        unbounded: first of the numbers that may have any value, and the first one after them, by their
            indices among the fields of the form.
        largest: magnitude above which no other number lies.
        further: called with the numbers of a message that passes all else; why it is rejected, or an empty
            text.
    """

    exact: bool = True
    unbounded: tuple[int, int] = (0, 0)
    largest: float = LARGEST
    further: Callable[[tuple[Any, ...]], str] | None = None


EXACT = MessageRules()
"""Rules of a message with the stamp of its step."""


class MessageValidator:
    """Validates the messages of one topic.

    Attributes:
        repeated: number of messages that were received again after a retransmission; they are not rejected.
    """

    def __init__(
        self,
        topic: str,
        form: Layout,
        rejections: RejectionCounter,
        stamps: Stamps,
        rules: MessageRules = EXACT,
    ) -> None:
        """Nothing has been validated yet.

        Args:
            topic: its name.
            form: of its messages.
            rejections: counts the rejected messages.
            stamps: of the scenario's steps.
            rules: for their numbers.
        """
        self.repeated = 0
        self._topic = topic
        self._form = form
        self._rejections = rejections
        self._stamps = stamps
        self._rules = rules
        self._further = rules.further
        self._lengths = tuple(
            (index, sum(other.startswith(f"{name.removesuffix('.length')}[") for other in form.fields))
            for index, name in enumerate(form.fields)
            if name.endswith(".length")
        )

    def validate(self, data: bytes, first: int, last: int) -> tuple[Any, ...] | None:
        """Numbers of a message; None if it is rejected or a repetition.

        Args:
            data: the message.
            first: earliest step that is due; an earlier one is a repetition.
            last: latest step that can be due.
        """
        numbers = self._form.unpack(data)
        if numbers is None:
            self._reject(Reason.FORM)
            return None
        if self._lengths and any(numbers[index] != length for index, length in self._lengths):
            self._reject(Reason.FORM)
            return None
        begin, end = self._rules.unbounded
        largest = self._rules.largest
        step, values = numbers[2], numbers[3:begin] + numbers[end:] if end else numbers[3:]
        if step > last:
            self._reject(Reason.NOT_DUE)
            return None
        if self._stamps.contradict(numbers[0], numbers[1], step, exact=self._rules.exact):
            self._reject(Reason.CONTRADICTION)
            return None
        if not isfinite(sum(values)):
            self._reject(Reason.NOT_FINITE)
            return None
        if max(values) > largest or min(values) < -largest:
            self._reject(Reason.RANGE)
            return None
        if step < first:
            # A publisher retransmits when a step does not continue.
            self.repeated += 1
            return None
        reason = self._further(numbers) if self._further else ""
        if reason:
            self._reject(reason)
            return None
        return numbers

    def _reject(self, reason: str) -> None:
        self._rejections.add(self._topic, reason)
