# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnostics of a node on /diagnostics (REP 107): published once a second, and on a change."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from enum import IntEnum

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from satform.communication import topic_table
from satform.communication.message_validator import RejectionCounter
from satform_nodes.transport import qos

DIAGNOSTICS = topic_table.DIAGNOSTICS
"""Topic of the diagnostics (REP 107)."""

PERIOD = 1.0
"""Wall-clock time between two reports when nothing changes, s."""

LATEST = 1.25
"""Wall-clock time after which a report is made without the timer, which a flood may keep waiting, s."""

SHORTEST = 0.1
"""Wall-clock time between two reports at least, s."""

WALL_TIME = "wall-clock time"
"""Key of the moment at which a report was made: UTC, ISO 8601."""

Value = str | int | float | bool
"""Type of the value of a key; it is published as text."""


class Level(IntEnum):
    """Severity, with the numbers of `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Condition:
    """Condition of a part of a node at one moment.

    Attributes:
        level: severity.
        message: short description; never empty.
        values: figures by name: counts, rates, the names of lost neighbours.
    """

    level: Level
    message: str
    values: Mapping[str, Value] = field(default_factory=dict)


class Health:
    """Publishes the condition of one part of a node.

    The condition is not stored but computed by a callback: once a second in a timer of the node, and when
    the node calls `changed`. Only another level or another message is a change; other figures are published
    by the timer. None of this runs within a step.

        self.health = Health(node, "sat1: flight software", "sat1", self.condition, self.now)
        # where something goes wrong or right again, such as a refused message or a silent neighbour:
        self.health.changed()

    Attributes:
        publisher: on `/diagnostics`.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        hardware_id: str,
        condition: Callable[[], Condition],
        stamp: Callable[[], tuple[int, int]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Create the publisher and the timer.

        Args:
            node: that the part belongs to; its executor runs the timer.
            name: of the part, below its node's: `sat1: flight software`.
            hardware_id: of what it runs on or flies: the satellite, or the plant.
            condition: called for each report.
            stamp: seconds and nanoseconds of the simulated time to which the part has come.
            clock: wall clock, s.
        """
        self._node = node
        # Two formations may publish diagnostics in one domain.
        space = node.get_namespace().strip("/")
        self._name = f"{space}/{name}" if space else name
        self._hardware_id = f"{space}/{hardware_id}" if space else hardware_id
        self._condition = condition
        self._stamp = stamp
        self._clock = clock
        self._published: tuple[Level, str] | None = None
        self._published_at = float("-inf")
        self._begun = clock()
        self.publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS, qos.OBSERVER)
        self._timer = node.create_timer(PERIOD, self.publish)

    def changed(self) -> None:
        """Publish at once if level or message differ from those published last.

        Within `SHORTEST` after a report nothing is published: the timer does it.
        """
        if self._clock() - self._published_at < SHORTEST:
            return
        condition = self._condition()
        if (condition.level, condition.message) != self._published:
            self._publish(condition)

    def due(self) -> None:
        """Publish if nothing has been published for `LATEST`; called now and then while the node is busy."""
        if self._clock() - max(self._published_at, self._begun) > LATEST:
            self._timer.reset()
            self.publish()

    def publish(self) -> None:
        """Publish the condition, whether it has changed or not."""
        self._publish(self._condition())

    def close(self) -> None:
        """Publish for the last time, and destroy the timer."""
        self._node.destroy_timer(self._timer)
        self.publish()

    def _publish(self, condition: Condition) -> None:
        self._published = (condition.level, condition.message)
        self._published_at = self._clock()
        # All stamps are simulated time, so that a bag has one clock; the wall clock's time is a figure.
        moment = datetime.now(UTC).isoformat(timespec="milliseconds")
        timed = replace(condition, values={**condition.values, WALL_TIME: moment})
        message = DiagnosticArray(status=[status(self._name, self._hardware_id, timed)])
        message.header.stamp.sec, message.header.stamp.nanosec = self._stamp()
        self.publisher.publish(message)


def status(name: str, hardware_id: str, condition: Condition) -> DiagnosticStatus:
    """A condition as a message.

    Args:
        name: of the part.
        hardware_id: of what it runs on or flies.
        condition: how it is.

    Returns:
        With the figures in the order of their names' first mention, as text.
    """
    values = [KeyValue(key=key, value=_text(value)) for key, value in condition.values.items()]
    return DiagnosticStatus(
        level=bytes([condition.level]),
        name=name,
        message=condition.message,
        hardware_id=hardware_id,
        values=values,
    )


def rejected_values(refused: Mapping[str, int]) -> dict[str, Value]:
    """Figures for messages that were refused, by reason, the total first."""
    return {
        "rejected messages": sum(refused.values()),
        **{f"rejected messages: {reason}": count for reason, count in sorted(refused.items()) if count},
    }


def flight_condition(
    *,
    step: int,
    step_rate: float,
    refused: Mapping[str, int],
    silent: Mapping[str, int],
    ended: str = "",
) -> Condition:
    """The condition of a part that takes steps and receives messages.

    Args:
        step: that it has come to.
        step_rate: steps a second of wall-clock time.
        refused: count of rejected messages by reason.
        silent: for each neighbour that is silent now, the steps for which it has been.
        ended: why it no longer flies though it should; empty while it does.

    Returns:
        An error when it has ended, a warning when a neighbour is silent or a message was refused.
    """
    values: dict[str, Value] = {"step": step, "steps per second": round(step_rate, 1)}
    values |= rejected_values(refused)
    values["lost neighbours"] = ", ".join(sorted(silent)) or "none"
    values |= {f"steps since the loss: {name}": count for name, count in sorted(silent.items())}
    if ended:
        return Condition(Level.ERROR, ended, values)
    if silent:
        return Condition(Level.WARN, f"nothing received from {', '.join(sorted(silent))}", values)
    if any(refused.values()):
        return Condition(Level.WARN, "messages were rejected", values)
    return Condition(Level.OK, "flying", values)


def with_failures(condition: Condition, failures: Mapping[str, int]) -> Condition:
    """A condition with what has failed in a control law.

    Args:
        condition: without it.
        failures: counts by what has failed, in words.

    Returns:
        With the counts as figures; a warning about the first that is not zero, if all else is well.
    """
    failed = [f"{name}: {count}" for name, count in failures.items() if count]
    condition = replace(condition, values={**condition.values, **failures})
    if failed and condition.level == Level.OK:
        condition = replace(condition, level=Level.WARN, message=failed[0])
    return condition


class FlightProgress:
    """Step rate and rejected messages of a part that takes steps, from one report to the next."""

    def __init__(self, rejections: RejectionCounter, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin at step 0.

        Args:
            rejections: counts of the messages that the part rejected.
            clock: wall clock, s.
        """
        self._rejections = rejections
        self._clock = clock
        self._published_step, self._published_at = 0, clock()

    def condition(self, step: int, silent: Mapping[str, int]) -> Condition:
        """The condition at a step; its rate is that since the report before.

        Args:
            step: that it has come to.
            silent: for each neighbour that is silent now, the steps for which it has been.
        """
        now = self._clock()
        rate = (step - self._published_step) / max(now - self._published_at, 1e-9)
        self._published_step, self._published_at = step, now
        refused = {f"{topic}: {reason}": count for (topic, reason), count in self._rejections.counts.items()}
        return flight_condition(step=step, step_rate=rate, refused=refused, silent=silent)


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
