# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Up to which step a recorder has all messages, which are missing, and when it tells the plant.

The recorder's node writes messages to the bag; this decides, without ROS, what they mean for the flight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from satform.communication.topic_table import Channel
from satform.flight.compile import FormationPlan
from satform.membership.absence_log import Absences
from satform.protocol.formation_view import FormationView
from satform.protocol.status import FormationStatus

REPORT_EVERY = 128
"""Steps between two progress messages to the plant."""


class RecorderOutput(Protocol):
    """What the steps of a recorder need of its node."""

    def publish_progress(self, step: int) -> None:
        """Tell the plant that all messages up to a step are in the bag, after they have been written out."""

    def take_arrived(self, satellite: int) -> None:
        """Take the messages of a satellite that have arrived, by `RecorderSteps.note_message`."""


@dataclass
class SteppedTopic:
    """A topic with a message at each step.

    Attributes:
        topic: its name.
        kind: of topic.
        satellite: index of the publishing satellite; -1 for the plant.
        last: step of its last message.
        optional: whether its publisher may do without it.
        latest: step of the newest message in the bag; -1 before the first.
        gaps: first and last step of each stretch without messages.
    """

    topic: str
    kind: str
    satellite: int
    last: int
    optional: bool = False
    latest: int = -1
    gaps: list[tuple[int, int]] = field(default_factory=list)


class RecorderSteps:
    """Follows what is in the bag.

    Attributes:
        view: the formation by the plant's statuses.
        topics: those with a message at each step.
    """

    def __init__(
        self,
        plan: FormationPlan,
        followed: Sequence[Channel],
        output: RecorderOutput,
        *,
        clocked: bool = False,
        report_every: int = REPORT_EVERY,
    ) -> None:
        """Nothing is in the bag.

        Args:
            plan: of the flight's parts.
            followed: topics that are recorded.
            output: publishes.
            clocked: whether the flight goes by the wall clock, on which satellites may skip steps.
            report_every: steps between two progress messages.
        """
        names = self._names = list(plan.names)
        self.view = FormationView(plan)
        self.last_step = plan.timing.steps
        self.topics = [
            SteppedTopic(
                channel.topic,
                channel.kind,
                names.index(channel.publishers[0]) if channel.publishers[0] in names else -1,
                self.last_step - (channel.rhythm == "steps"),
                channel.optional,
            )
            for channel in followed
            if channel.rhythm != "occasional"
        ]
        self._output = output
        self._clocked = clocked
        self._report_every = report_every
        self._absences = Absences(names)
        self._last_status: FormationStatus | None = None
        self._reported = 0
        self._slowest: tuple[SteppedTopic, int] | None = None
        self._unknown: dict[int, int] = {}

    @property
    def ended(self) -> FormationStatus | None:
        """The plant's final status; None while the flight continues."""
        return self.view.ended

    def _expected(self) -> list[SteppedTopic]:
        """Topics that have a message at every step at present; on the wall clock only those of the plant."""
        alive, returns = self.view.formation.alive & (not self._clocked), self.view.formation.rejoined_at
        present = [
            topic
            for topic in self.topics
            # One that rejoins at the last state commands nothing any more.
            if topic.satellite < 0
            or (alive[topic.satellite] and returns.get(topic.satellite, 0) <= topic.last)
        ]
        # An optional one has a message at every step from the first on, or none at all.
        return [topic for topic in present if topic.latest >= 0 or not topic.optional]

    @property
    def recorded_step(self) -> int:
        """Last step of which everything is in the bag; -1 before the first.

        Also the status of its version: what happened up to this step cannot be read without it.
        """
        known = min(self._unknown.values(), default=self.last_step + 1) - 1
        return min(known, *(topic.latest for topic in self._expected()))

    @property
    def complete(self) -> bool:
        """Whether every message of the whole flight is in the bag."""
        return not self._unknown and all(topic.latest >= topic.last for topic in self._expected())

    def lacks_messages(self) -> bool:
        """Whether messages are missing of the steps that were complete when the flight ended."""
        ended = self.ended
        return ended is not None and any(
            topic.latest < min(topic.last, ended.step - 1) for topic in self._expected()
        )

    def missing(self) -> list[str]:
        """A sentence for each stretch of steps without messages of a satellite that took part."""
        return [
            f"{topic.topic}: nothing from step {first} to {last}"
            for topic in self.topics
            for first, last in topic.gaps
            # On the wall clock satellites may miss steps.
            if not (self._clocked and topic.satellite >= 0)
            and not self._absences.explain(topic.satellite, topic.kind, first, last)
        ]

    def note_message(self, topic: SteppedTopic, step: int, version: int = 0) -> None:
        """Note that a message is in the bag, of a later step than the one before on its topic.

        Args:
            topic: on which it came.
            step: of the message.
            version: of the formation, in a state.
        """
        if version > self.view.formation.number:
            self._unknown.setdefault(version, step)
        if step > topic.latest + 1:
            topic.gaps.append((topic.latest + 1, step - 1))
        topic.latest = step
        self._report_progress(step)

    def is_repeated(self, status: FormationStatus) -> bool:
        """Whether a status is a retransmission while nothing changes."""
        return bool(status == self._last_status)

    def take_status(self, status: FormationStatus) -> list[str]:
        """Take in a status that is in the bag; names of satellites that it says to be lost since the last."""
        self._last_status = status
        number = self.view.formation.number
        for name in set(status.lost) & set(self._names) if status.version > number else ():
            # It does not count from now on; what has arrived of it is to be in the bag before a report.
            self._output.take_arrived(self._names.index(name))
        if not self.view.take(status) or self.view.formation.number == number:
            return []
        self._absences.take(status)
        self._unknown = {each: step for each, step in self._unknown.items() if each > status.version}
        self._slowest = None
        # It may have been a lost satellite whose messages were missing.
        self._report_progress(max(0, self.recorded_step))
        return list(status.lost)

    def _may_be_further(self) -> bool:
        """Whether the topic that was the slowest has had a message since.

        While that topic is behind, this is asked at each message of all others, of which there may be
        thousands: it does not look at every topic.
        """
        if self._slowest is not None and self._slowest[0].latest == self._slowest[1]:
            return False
        slowest = min(self._expected(), key=lambda topic: topic.latest)
        self._slowest = slowest, slowest.latest
        return True

    def _report_progress(self, step: int) -> None:
        if step < self.last_step - 1 and (
            step < self._reported + self._report_every or not self._may_be_further()
        ):
            return
        reached = self.last_step if self.complete else self.recorded_step
        if reached <= self._reported and not self.complete:
            return
        self._reported = reached
        self._output.publish_progress(reached)
