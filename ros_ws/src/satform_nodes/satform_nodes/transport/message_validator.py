# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Where messages enter a node: what is believed is well-formed, finite, in range and of a due step.

Who may speak at all is decided before, in `speakers`. A message that is refused has no effect but to be
counted, by topic and reason.
"""

from collections import Counter
from math import isfinite
from typing import Any

from satform_nodes.transport.cdr_codec import Layout
from satform_nodes.transport.sim_time import Stamps

LARGEST = 1e15
"""Magnitude above which no number of a formation lies, in SI units."""

CONTRADICTION = "a stamp that contradicts its step"
"""Why a message is refused whose stamp is not a moment at which a message of its step can have been made."""

EARLIER_STAMPS = frozenset({"state", "arc_length", "motion"})
"""Kinds of topics whose stamps may be of an earlier step: when it was measured, or when a phase was held."""

_MOST_REASONS = 200
"""Topics and reasons that are counted apart: names of strangers are among them, who may have many."""


class Refusals:
    """What a node has not believed, and why.

    Attributes:
        counts: messages by topic and reason.
    """

    def __init__(self) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()

    @property
    def total(self) -> int:
        """How many messages in all."""
        return self.counts.total()

    def note(self, topic: str, reason: str) -> None:
        """Count a message that was refused."""
        known = (topic, reason) in self.counts or len(self.counts) < _MOST_REASONS
        self.counts[topic, reason if known else "other reasons"] += 1

    def sentences(self) -> dict[str, str]:
        """Each topic and reason with its count, for people."""
        return {f"{topic}: {reason}": str(count) for (topic, reason), count in sorted(self.counts.items())}


class Entry:
    """The way in for the messages of one topic.

    Attributes:
        repeated: how many messages came a second time, which is no offence.
    """

    def __init__(
        self,
        topic: str,
        form: Layout,
        refusals: Refusals,
        stamps: Stamps,
        *,
        exact: bool = True,
        unbounded: int = 0,
    ) -> None:
        """An entry through which nothing has come yet.

        Args:
            topic: its name.
            form: of its messages.
            refusals: where those that are refused are counted.
            stamps: of the scenario's steps.
            exact: whether a message has the stamp of its step; else it may have that of an earlier one.
            unbounded: how many numbers at the end may have any value.
        """
        self.repeated = 0
        self._topic = topic
        self._form = form
        self._refusals = refusals
        self._stamps = stamps
        self._exact = exact
        self._end = len(form.fields) - unbounded

    def admit(self, data: bytes, first: int, last: int) -> tuple[Any, ...] | None:
        """The numbers of a message, or None when it is refused.

        Args:
            data: the message.
            first: earliest step that is due; an earlier one is a repetition.
            last: latest step that can be due.
        """
        numbers = self._form.unpack(data)
        if numbers is None:
            self._refuse("another form")
            return None
        step, values = numbers[2], numbers[3 : self._end]
        if step > last:
            self._refuse("a step that is not due yet")
            return None
        if self._stamps.contradict(numbers[0], numbers[1], step, exact=self._exact):
            self._refuse(CONTRADICTION)
            return None
        if not isfinite(sum(values)):
            self._refuse("not finite")
            return None
        if max(values) > LARGEST or min(values) < -LARGEST:
            self._refuse("out of range")
            return None
        if step < first:
            # The speaker's own words come again when it is not sure that they were heard.
            self.repeated += 1
            return None
        return numbers

    def _refuse(self, reason: str) -> None:
        self._refusals.note(self._topic, reason)
