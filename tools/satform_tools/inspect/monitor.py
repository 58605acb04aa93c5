# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""State of a running formation from the newest message of each of its topics, polled a few times a second."""

import math
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Log
from satform_msgs.msg import ArcLength, Command, FormationStatus, ParameterChange, RelativeState, Tracking

from satform.communication import topic_table
from satform.communication.topic_table import topic_name
from satform_tools.inspect import target_domain
from satform_tools.inspect.observer_node import Observer, best_effort
from satform_tools.inspect.snapshot import Frame, LinkStatus, SatelliteStatus

PERIOD = 0.2
"""Wall-clock time between two updates, s."""

_STALE_AFTER = 2.0
"""Wall-clock time without a command after which a satellite counts as stale while others are received, s."""

_RATE_SPAN = 2.0
"""Wall-clock time over which the step rate is taken, s."""

_RARE = 10
"""Queue depth of topics with rare messages."""

_PHASES = {
    getattr(FormationStatus, name): name.lower()
    for name in ("WAITING", "FLYING", "FINISHED", "ABORTED", "PAUSED")
    if hasattr(FormationStatus, name)
}

_WARNING = Log.WARN[0] if isinstance(Log.WARN, bytes) else Log.WARN
"""Lowest log level that is shown."""

_NOTHING = (math.nan, math.nan, math.nan)


@dataclass
class Latest:
    """The newest message of a topic.

    Attributes:
        message: None before the first.
        since: wall-clock time at which it was taken.
        subscription: of depth one, from which it is taken.
    """

    message: Any = None
    since: float = 0.0
    subscription: Any = None

    def store(self, message: Any) -> None:
        """Take a message."""
        self.message, self.since = message, time.monotonic()

    def update(self) -> None:
        """Take what is in the queue."""
        _take_all(self.subscription)


@dataclass
class _Satellite:
    tracking: Latest
    command: Latest
    announcement: Latest
    created: float = field(default_factory=time.monotonic)

    def update(self) -> None:
        for newest in (self.tracking, self.command, self.announcement):
            newest.update()

    @property
    def known(self) -> bool:
        return self.tracking.message is not None and self.command.message is not None


class FormationMonitor:
    """Takes the newest message of each topic of a formation, and makes frames of them.

    Messages are taken at each update and not as they arrive: a queue of depth one holds the newest.
    """

    def __init__(self, observer: Observer) -> None:
        """Find the formation and subscribe.

        Raises:
            CommandError: no formation flies here.
        """
        self._observer = observer
        self.events: deque[str] = deque(maxlen=100)
        # Subscribed before the present status is read, so that no change falls in between.
        observer.require_formation()
        self._status = self.newest(FormationStatus, topic_table.STATUS)
        self.status = observer.latest_status()
        alive = zip(self.status.satellites, self.status.alive, strict=True)
        self._satellites = {name: self._subscribe(name, bool(living)) for name, living in alive}
        self._steps: deque[tuple[float, int]] = deque()
        self._rare = [
            self._queue(Log, "/rosout"),
            self._queue(DiagnosticArray, "/diagnostics"),
            *(
                self._queue(ParameterChange, observer.full_name(topic_name("parameter_changes", name)), name)
                for name in self._satellites
            ),
        ]
        runs = [run for run in target_domain.runs_here() if run.domain == observer.domain]
        self._title = (
            f"{runs[0].scenario} on domain {observer.domain}" if runs else f"domain {observer.domain}"
        )
        if self.status.reason:
            self.events.append(self.status.reason)

    @property
    def over(self) -> bool:
        """Whether the flight has ended."""
        return self.status.phase in (FormationStatus.FINISHED, FormationStatus.ABORTED)

    def pause(self) -> None:
        """Wait until the next update is due."""
        time.sleep(PERIOD)  # the period of the display, whatever messages arrive

    def is_complete(self) -> bool:
        """Whether messages of all living satellites have been received, or the flight is over."""
        alive = dict(zip(self.status.satellites, self.status.alive, strict=True))
        return self.over or all(self._satellites[name].known for name, living in alive.items() if living)

    def update(self) -> bool:
        """Take all new messages; returns whether the flight is over."""
        now = time.monotonic()
        for satellite in self._satellites.values():
            satellite.update()
        self._update_status()
        for queue in self._rare:
            _take_all(queue)
        # Before the first of these messages the step is that of the newest status, which may be long past.
        if any(entry.tracking.message or entry.command.message for entry in self._satellites.values()):
            self._steps.append((now, self.instant()[0]))
        while len(self._steps) > 2 and now - self._steps[0][0] > _RATE_SPAN:
            self._steps.popleft()
        return self.over

    def instant(self) -> tuple[int, float]:
        """The newest step of which a message was received, and its simulated time, s."""
        messages = [self.status]
        for entry in self._satellites.values():
            messages += [one for one in (entry.tracking.message, entry.command.message) if one is not None]
        newest = max(messages, key=lambda message: int(message.step))
        return int(newest.step), _seconds(newest)

    def frame(self) -> Frame:
        """The state of the formation now."""
        now = time.monotonic()
        lengths = self._arc_lengths()
        step, moment = self.instant()
        return Frame(
            title=self._title,
            phase=_PHASES.get(self.status.phase, "in an unknown phase"),
            step=step,
            last_step=self.status.last_step,
            time=moment,
            steps_per_second=self._rate(),
            satellites=tuple(
                self._satellite(name, bool(alive), lengths.get(name, math.nan), now)
                for name, alive in zip(self.status.satellites, self.status.alive, strict=True)
            ),
            spread=max(lengths.values()) - min(lengths.values()) if len(lengths) > 1 else math.nan,
            connectivity=self.status.algebraic_connectivity,
            links=self._links(moment),
            events=tuple(self.events),
        )

    def newest(self, kind: Any, topic: str) -> Latest:
        """Subscribe to a topic for its newest message.

        Args:
            kind: of the message.
            topic: its name in the root namespace.
        """
        newest = Latest()
        newest.subscription = self._observer.node.create_subscription(
            kind, self._observer.full_name(topic), newest.store, best_effort(1)
        )
        return newest

    def _queue(self, kind: Any, topic: str, satellite: str = "") -> Any:
        def log(message: Any) -> None:
            self.events.extend(sentences(message, satellite))

        return self._observer.node.create_subscription(kind, topic, log, best_effort(_RARE))

    def _subscribe(self, name: str, alive: bool) -> _Satellite:
        # Satellites publish their arc length or their motion, by the consensus law.
        if alive:
            self._observer.wait(lambda: self._announces(name) is not None, self._observer.timeout)
        announced = self._announces(name) or self._announced_by_others()
        kind, topic = announced or (ArcLength, topic_name("arc_length", name))
        topic = f"/{name}/{topic.rpartition('/')[2]}"
        return _Satellite(
            self.newest(Tracking, topic_name("tracking", name)),
            self.newest(Command, topic_name("command", name)),
            self.newest(kind, topic),
        )

    def _announces(self, name: str) -> tuple[Any, str] | None:
        for kind, topic in (
            (ArcLength, topic_name("arc_length", name)),
            (RelativeState, topic_name("motion", name)),
        ):
            if self._observer.node.count_publishers(self._observer.full_name(topic)):
                return kind, topic
        return None

    def _announced_by_others(self) -> tuple[Any, str] | None:
        """What other satellites announce: all have the same consensus law."""
        found = (self._announces(name) for name in self.status.satellites)
        return next((announced for announced in found if announced is not None), None)

    def _update_status(self) -> None:
        self._status.update()
        newer = self._status.message
        if newer is not None and newer is not self.status:
            if newer.reason:
                self.events.append(f"step {newer.step}: {newer.reason}")
            self.status = newer
        if not self.over and not self._observer.plant_exists():
            self.status.phase = FormationStatus.ABORTED
            self.events.append("the plant has ended without a final status")

    def _rate(self) -> float:
        if not self._steps:
            return math.nan
        (first, before), (last, after) = self._steps[0], self._steps[-1]
        return (after - before) / (last - first) if last - first > 0.5 * PERIOD else math.nan

    def _satellite(self, name: str, alive: bool, arc_length: float, now: float) -> SatelliteStatus:
        entry = self._satellites[name]
        tracking, command = entry.tracking.message, entry.command.message
        position, error = _NOTHING, math.nan
        if tracking is not None:
            apart = _three(tracking.position_error)
            reference = _three(tracking.reference_position)
            position = (reference[0] + apart[0], reference[1] + apart[1], reference[2] + apart[2])
            error = math.hypot(*apart)
        received = max(entry.command.since, entry.created)
        newest = max(max(other.command.since, other.created) for other in self._satellites.values())
        return SatelliteStatus(
            name,
            alive,
            stale=alive and not self.over and min(now, newest) - received > _STALE_AFTER,
            position=position,
            error=error,
            command=math.nan if command is None else math.hypot(*_three(command.acceleration)),
            arc_length=arc_length,
        )

    def _arc_lengths(self) -> dict[str, float]:
        """Arc length of each living satellite that publishes it, propagated by its rate to one time."""
        alive = dict(zip(self.status.satellites, self.status.alive, strict=True))
        announced = {
            name: entry.announcement.message for name, entry in self._satellites.items() if alive.get(name)
        }
        phases = {name: message for name, message in announced.items() if isinstance(message, ArcLength)}
        moment = max(map(_seconds, phases.values()), default=0.0)
        return {
            name: float(message.arc_length + message.rate * (moment - _seconds(message)))
            for name, message in phases.items()
        }

    def _links(self, moment: float) -> tuple[LinkStatus, ...]:
        names = list(self.status.satellites)
        links = []
        for receiver, sender in zip(self.status.edge_receivers, self.status.edge_senders, strict=True):
            message = self._satellites[names[sender]].announcement.message
            # A message for the next step is sent before that step.
            age = math.nan if message is None else max(0.0, moment - _seconds(message))
            links.append(LinkStatus(names[receiver], names[sender], age))
        return tuple(links)


def sentences(message: Any, satellite: str = "") -> list[str]:
    """Lines of a log message, of diagnostics or of a satellite's parameter change; none below a warning."""
    if isinstance(message, ParameterChange):
        value = ", ".join(f"{number:g}" for number in message.value)
        return [f"step {message.step}: {satellite} {message.name} = {value}"]
    if isinstance(message, Log):
        return [f"{message.name}: {message.msg}"] if message.level >= _WARNING else []
    return [
        f"{entry.name}: {entry.message}" for entry in message.status if entry.level != DiagnosticStatus.OK
    ]


def _seconds(message: Any) -> float:
    if message is None:
        return 0.0
    stamp = message.header.stamp
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def _three(vector: Any) -> tuple[float, float, float]:
    return (float(vector.x), float(vector.y), float(vector.z))


def _take_all(subscription: Any) -> None:
    """Pass all queued messages of a subscription to its callback, without the cost of an executor."""
    while (taken := subscription.handle.take_message(subscription.msg_type, False)) is not None:
        subscription.callback(taken[0])
