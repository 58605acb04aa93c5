"""Where messages enter a node: what is believed is finite, in range, in sequence and of a step that is due.

A message that is refused has no effect but to be counted, by topic and reason.
"""

from collections import Counter
from math import isfinite
from typing import Any

from satform_nodes.wire import Layout

LARGEST = 1e15
"""Magnitude above which no number of a formation lies, in SI units."""


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
        self.counts[topic, reason] += 1

    def sentences(self) -> dict[str, str]:
        """Each topic and reason with its count, for people."""
        return {f"{topic}: {reason}": str(count) for (topic, reason), count in sorted(self.counts.items())}


class Entry:
    """The way in for the messages of one topic with one known speaker.

    The speaker's writer numbers its messages one after another, which DDS passes on; whoever else
    writes on the topic has numbers of its own.

    Attributes:
        repeated: how many messages came a second time, which is no offence.
    """

    def __init__(
        self, topic: str, form: Layout, refusals: Refusals, watched: slice = slice(0), jump: float = LARGEST
    ) -> None:
        """An entry through which nothing has come yet.

        Args:
            topic: its name.
            form: of its messages.
            refusals: where those that are refused are counted.
            watched: places of the numbers, stamp and step included, that cannot jump.
            jump: by which each of them may differ at most from one step to the next.
        """
        self.repeated = 0
        self._topic = topic
        self._form = form
        self._refusals = refusals
        self._watched = watched
        self._jump = jump
        self._last: tuple[Any, ...] = ()
        self._last_step = -1
        self._sequence = 0
        self._known = True
        self._strict = True

    def renew(self) -> None:
        """Expect a new speaker, whose numbers begin anew."""
        self._known = False

    def be_lenient(self) -> None:
        """Take messages also when some between them were missed, as on the wall clock."""
        self._strict = False

    def admit(self, data: bytes, sequence: int, first: int, last: int) -> tuple[Any, ...] | None:
        """The numbers of a message, or None when it is refused.

        Args:
            data: the message.
            sequence: its number as its writer counts.
            first: earliest step that is due; an earlier one is a repetition.
            last: latest step that can be due.
        """
        numbers = self._form.unpack(data)
        if numbers is None:
            return self._refuse("another form")
        if self._known and not self._in_sequence(sequence):
            return self._refuse("not the next one of its speaker")
        step, values = numbers[2], numbers[3:]
        if step > last:
            return self._refuse("a step that is not due yet")
        if not isfinite(sum(values)):
            return self._refuse("not finite")
        if max(values) > LARGEST or min(values) < -LARGEST:
            return self._refuse("out of range")
        if step < first:
            # The speaker's own words come again when it is not sure that they were heard.
            self._sequence = max(sequence, self._sequence) if self._known else 0
            self.repeated += 1
            return None
        watched = numbers[self._watched]
        if step == self._last_step + 1 and any(
            abs(now - before) > self._jump for now, before in zip(watched, self._last, strict=False)
        ):
            return self._refuse("too large a jump")
        self._last, self._last_step = watched, step
        self._sequence, self._known = sequence, True
        return numbers

    def _in_sequence(self, sequence: int) -> bool:
        if self._strict:
            return sequence == self._sequence + 1
        return sequence > self._sequence

    def _refuse(self, reason: str) -> None:
        self._refusals.note(self._topic, reason)
