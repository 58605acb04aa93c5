# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""In whatever order messages reach the recorder, it reports a step only when it has all messages up to it.

The statuses are those of all flights that the explorer finds, and from them follows what each node publishes.
The recorder gets the messages of a topic in order, and those of different topics in every order.
"""

import copy
import functools
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from protocol_search import CompiledExplorer
from rclpy.serialization import deserialize_message
from satform_msgs.msg import FormationStatus
from test_protocol_explored import LONG, flight

from satform.communication.topic_table import RECORDER, STATUS, channels, subscribed_by
from satform.flight.compile import FormationPlan, compile_scenario
from satform.protocol.recorder_steps import RecorderSteps

TOPICS = ("/sat1/state", "/sat1/command", "/sat1/arc_length", "/sat2/command", "/sat2/arc_length")
"""Topics that are recorded here, beside the status."""

STEPS = 2

WITH_LONG_TESTS = pytest.mark.skipif(LONG not in os.environ, reason=f"NOT TESTED: set {LONG}=1")


@dataclass
class Published:
    """What is published in a flight.

    Attributes:
        plan: of the flight's parts.
        statuses: of the plant, in order.
        steps: by topic, the steps of its messages in order.
        versions: by step, the version of the formation that its states have.
    """

    plan: FormationPlan
    statuses: list[Any]
    steps: dict[str, list[int]] = field(default_factory=dict)
    versions: list[int] = field(default_factory=list)


@functools.cache
def flights_with_changes() -> list[tuple[bytes, ...]]:
    """The statuses of flights with a disturbance that go on to the end; of equal changes one flight each."""
    explorer = CompiledExplorer(flight(2, STEPS), budget=1, faults=("kill", "silent", "graph"), cuts=True)
    assert not explorer.explore().violation
    found = {}
    for data in sorted({tuple(plant.statuses) for plant in explorer.ended_plants()}):
        statuses = [deserialize_message(status, FormationStatus) for status in data]
        changes = [(each.version, each.step, tuple(each.lost), tuple(each.rejoined)) for each in statuses]
        # Both satellites are alike.
        if statuses[-1].phase == FormationStatus.FINISHED and "sat2" not in statuses[1].lost:
            found.setdefault(tuple(changes), data)
    return list(found.values())


def published(data: tuple[bytes, ...]) -> Published:
    """What the nodes of a flight publish whose statuses are these."""
    plan = compile_scenario(flight(2, STEPS))
    statuses = [deserialize_message(status, FormationStatus) for status in data]
    found = Published(plan, statuses)
    last = statuses[-1].step
    found.versions = [
        max(status.version for status in statuses if status.step <= step) for step in range(last + 1)
    ]
    for name in plan.names:
        commands, phases = [], []
        for first, end, announces in stretches(name, statuses, last):
            commands += range(first, end)
            phases += range(first, end + announces)
        steps = {"state": [*range(last + 1)], "command": commands, "arc_length": phases}
        own = {f"/{name}/{kind}": steps[kind] for kind in steps}
        found.steps |= {topic: own[topic] for topic in TOPICS if topic in own}
    return found


def stretches(name: str, statuses: list[Any], last: int) -> Iterator[tuple[int, int, bool]]:
    """When a satellite takes part: first step, that after its last command, whether it announced that one."""
    first: int | None = 0
    for status in statuses:
        if name in status.lost and first is not None:
            final = status.final_commands[status.lost.index(name)]
            announced = bool(final.header.frame_id) and final.step + 1 == status.step
            yield first, status.step - (not announced), announced
            first = None
        if name in status.rejoined:
            first = status.step
    if first is not None:
        yield first, last, True


class Recording:
    """A recorder, and what it has got of what was published."""

    def __init__(self, given: Published, lost: int) -> None:
        """Nothing has arrived.

        Args:
            given: what is published.
            lost: last messages of each topic of a lost satellite that never arrive.
        """
        self.given = given
        followed = [
            channel
            for channel in subscribed_by(RECORDER, channels(given.plan.topics))
            if channel.topic in TOPICS
        ]
        self.steps = RecorderSteps(given.plan, followed, self, report_every=1)
        self.reported = 0
        names = {name for status in given.statuses for name in status.lost}
        self.left = {STATUS: list(given.statuses)}
        for topic, steps in given.steps.items():
            _, name, kind = topic.split("/")
            returns = [status.step for status in given.statuses if name in status.rejoined]
            first = [step for step in steps if not returns or step < returns[0]]
            cut = lost if name in names and kind != "state" else 0
            self.left[topic] = first[: len(first) - cut] + steps[len(first) :]

    def publish_progress(self, step: int) -> None:
        """Check that nothing up to the step is still to come."""
        self.reported = step
        assert self.lacking(step) == []

    def take_arrived(self, satellite: int) -> None:
        """All messages of a satellite from before its loss arrive."""
        name = self.given.plan.names[satellite]
        (loss,) = [status.step for status in self.given.statuses if name in status.lost]
        for topic in (f"/{name}/command", f"/{name}/arc_length"):
            while self.left[topic] and self.left[topic][0] <= loss:
                self._take(topic)

    def lacking(self, step: int) -> list[str]:
        """Messages up to a step that it has not got."""
        found = [
            f"{topic} of step {each}"
            for topic, steps in self.left.items()
            if topic != STATUS
            for each in steps
            if each <= step
        ]
        known = self.steps.view.formation.number
        # One without a new version says nothing about the steps: that the flight is over, or paused.
        changes = [each for each in self.left[STATUS] if each.version > known and each.step <= step]
        return found + [f"the status of version {status.version}" for status in changes]

    def key(self) -> tuple[int, ...]:
        """What its future depends on."""
        return (*map(len, self.left.values()), self.reported)

    def after(self, topic: str) -> "Recording":
        """A copy that has got the next message of a topic."""
        other = copy.copy(self)
        other.left = {name: list(messages) for name, messages in self.left.items()}
        other.steps = copy.copy(self.steps)
        for name in ("topics", "view", "_absences", "_unknown"):
            setattr(other.steps, name, copy.deepcopy(getattr(self.steps, name)))
        other.steps._slowest, other.steps._output = None, other
        other._take(topic)
        return other

    def _take(self, topic: str) -> None:
        message = self.left[topic].pop(0)
        if topic == STATUS:
            if not self.steps.is_repeated(message):
                self.steps.take_status(message)
            return
        (place,) = [each for each in self.steps.topics if each.topic == topic]
        version = self.given.versions[message] if place.kind == "state" else 0
        self.steps.note_message(place, message, version)


def every_order(given: Published, lost: int) -> Iterator[Recording]:
    """The recorder after each message, in every order of the topics."""
    first = Recording(given, lost)
    seen, left = {first.key()}, [first]
    while left:
        recording = left.pop()
        for topic in [topic for topic, messages in recording.left.items() if messages]:
            following = recording.after(topic)
            yield following
            if following.key() not in seen:
                seen.add(following.key())
                left.append(following)


@pytest.mark.parametrize("lost", [0, pytest.param(1, marks=WITH_LONG_TESTS)])
def test_a_reported_step_and_all_before_it_are_in_the_bag(lost: int) -> None:
    count = 0
    for data in flights_with_changes():
        given = published(data)
        for recording in every_order(given, lost):
            count += 1
            if any(recording.left.values()):
                continue
            # The plant waits for the report of the last step before it ends the flight.
            assert recording.reported == STEPS
            assert recording.steps.complete
            assert not recording.steps.lacks_messages()
            assert recording.steps.missing() == []
    assert count > 10_000
