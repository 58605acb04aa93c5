# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a flying formation: the newest word on each of its topics, taken a few times a second."""

import math
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Log
from satform_msgs.msg import ArcLength, Command, FormationStatus, ParameterChange, RelativeState, Tracking

from satform_nodes.transport import topics
from satform_tools.inspect import target_domain
from satform_tools.inspect.observer_node import Looker, passing
from satform_tools.inspect.snapshot import Frame, LinkLook, SatelliteLook

PERIOD = 0.2
"""Wall-clock time between two looks, s."""

_SILENCE = 2.0
"""Wall-clock time after which a satellite counts as silent while others are heard, s."""

_RATE_SPAN = 2.0
"""Wall-clock time over which the step rate is taken, s."""

_RARE = 10
"""Queue of topics on which something is said now and then."""

_PHASES = {
    getattr(FormationStatus, name): name.lower()
    for name in ("WAITING", "FLYING", "FINISHED", "ABORTED", "PAUSED")
    if hasattr(FormationStatus, name)
}

_WARNING = Log.WARN[0] if isinstance(Log.WARN, bytes) else Log.WARN
"""Level from which on a word of the log is worth a line."""

_NOTHING = (math.nan, math.nan, math.nan)


@dataclass
class _Newest:
    """The newest word on a topic.

    Attributes:
        message: None before the first.
        since: wall-clock time at which it was found.
        subscription: of depth one, from which it is taken.
    """

    message: Any = None
    since: float = 0.0
    subscription: Any = None

    def hear(self, message: Any) -> None:
        self.message, self.since = message, time.monotonic()

    def look(self) -> None:
        _take_all(self.subscription)


@dataclass
class _Satellite:
    tracking: _Newest
    command: _Newest
    word: _Newest
    first_look: float = field(default_factory=time.monotonic)

    def look(self) -> None:
        for newest in (self.tracking, self.command, self.word):
            newest.look()

    @property
    def known(self) -> bool:
        return self.tracking.message is not None and self.command.message is not None


class Watcher:
    """Takes the newest word on each topic of a formation, and makes frames of it.

    Messages are taken at each look and not as they come: a queue of one holds the newest.
    """

    def __init__(self, looker: Looker) -> None:
        """Find the formation and subscribe.

        Raises:
            CommandError: no formation flies here.
        """
        self._looker = looker
        self.events: deque[str] = deque(maxlen=100)
        # Subscribed to before the present status is asked for, so that no change falls in between.
        looker.require_formation()
        self._status = self._newest(FormationStatus, topics.STATUS)
        self.status = looker.hear_status()
        alive = zip(self.status.satellites, self.status.alive, strict=True)
        self._satellites = {name: self._subscribe(name, bool(living)) for name, living in alive}
        self._steps: deque[tuple[float, int]] = deque()
        self._rare = [
            self._queue(Log, "/rosout"),
            self._queue(DiagnosticArray, "/diagnostics"),
            *(
                self._queue(ParameterChange, looker.full_name(topics.parameter_changes(name)))
                for name in self._satellites
            ),
        ]
        runs = [run for run in target_domain.runs_here() if run.domain == looker.domain]
        self._title = f"{runs[0].scenario} on domain {looker.domain}" if runs else f"domain {looker.domain}"
        if self.status.reason:
            self.events.append(self.status.reason)

    @property
    def over(self) -> bool:
        """Whether the flight has ended."""
        return self.status.phase in (FormationStatus.FINISHED, FormationStatus.ABORTED)

    def pause(self) -> None:
        """Let some time pass before the next look."""
        time.sleep(PERIOD)

    def knows_all(self) -> bool:
        """Whether every living satellite has been heard, or the flight is over."""
        alive = dict(zip(self.status.satellites, self.status.alive, strict=True))
        return self.over or all(self._satellites[name].known for name, living in alive.items() if living)

    def look(self) -> bool:
        """Take what has been said; returns whether the flight is over."""
        now = time.monotonic()
        for satellite in self._satellites.values():
            satellite.look()
        self._look_at_status()
        for queue in self._rare:
            _take_all(queue)
        self._steps.append((now, self.step()))
        while now - self._steps[0][0] > _RATE_SPAN and len(self._steps) > 2:
            self._steps.popleft()
        return self.over

    def step(self) -> int:
        """Steps taken, as the newest commands and the status tell."""
        commanded = (entry.command.message for entry in self._satellites.values())
        steps = [int(message.step) + 1 for message in commanded if message is not None]
        return max([int(self.status.step), *steps])

    def frame(self) -> Frame:
        """What is known now."""
        now = time.monotonic()
        lengths = self._arc_lengths()
        moment = max(
            [_seconds(self.status), *(_seconds(one.tracking.message) for one in self._satellites.values())]
        )
        return Frame(
            title=self._title,
            phase=_PHASES.get(self.status.phase, "in an unknown phase"),
            step=self.step(),
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

    def _newest(self, kind: Any, topic: str) -> _Newest:
        newest = _Newest()
        newest.subscription = self._looker.node.create_subscription(
            kind, self._looker.full_name(topic), newest.hear, passing(1)
        )
        return newest

    def _queue(self, kind: Any, topic: str) -> Any:
        def tell(message: Any) -> None:
            self.events.extend(sentences(message))

        return self._looker.node.create_subscription(kind, topic, tell, passing(_RARE))

    def _subscribe(self, name: str, alive: bool) -> _Satellite:
        # Those that share their motion share no arc length, and the other way round.
        if alive:
            self._looker.wait(lambda: self._announces(name) is not None, self._looker.patience)
        announced = self._announces(name) or self._announced_by_others()
        kind, topic = announced or (ArcLength, topics.arc_length(name))
        topic = f"/{name}/{topic.rpartition('/')[2]}"
        return _Satellite(
            self._newest(Tracking, topics.tracking(name)),
            self._newest(Command, topics.command(name)),
            self._newest(kind, topic),
        )

    def _announces(self, name: str) -> tuple[Any, str] | None:
        for kind, topic in ((ArcLength, topics.arc_length(name)), (RelativeState, topics.motion(name))):
            if self._looker.node.count_publishers(self._looker.full_name(topic)):
                return kind, topic
        return None

    def _announced_by_others(self) -> tuple[Any, str] | None:
        """What those announce who are there: the law of agreement is the same for all."""
        found = (self._announces(name) for name in self.status.satellites)
        return next((announced for announced in found if announced is not None), None)

    def _look_at_status(self) -> None:
        self._status.look()
        newer = self._status.message
        if newer is not None and newer is not self.status:
            if newer.reason:
                self.events.append(f"step {newer.step}: {newer.reason}")
            self.status = newer
        if not self.over and not self._looker.plant_is_there():
            self.status.phase = FormationStatus.ABORTED
            self.events.append("the plant is gone without a word about the end of the flight")

    def _rate(self) -> float:
        (first, before), (last, after) = self._steps[0], self._steps[-1]
        return (after - before) / (last - first) if last - first > 0.5 * PERIOD else math.nan

    def _satellite(self, name: str, alive: bool, arc_length: float, now: float) -> SatelliteLook:
        entry = self._satellites[name]
        tracking, command = entry.tracking.message, entry.command.message
        position, error = _NOTHING, math.nan
        if tracking is not None:
            apart = _three(tracking.position_error)
            reference = _three(tracking.reference_position)
            position = (reference[0] + apart[0], reference[1] + apart[1], reference[2] + apart[2])
            error = math.hypot(*apart)
        heard = max(entry.command.since, entry.first_look)
        newest = max(max(other.command.since, other.first_look) for other in self._satellites.values())
        return SatelliteLook(
            name,
            alive,
            silent=alive and not self.over and min(now, newest) - heard > _SILENCE,
            position=position,
            error=error,
            command=math.nan if command is None else math.hypot(*_three(command.acceleration)),
            arc_length=arc_length,
        )

    def _arc_lengths(self) -> dict[str, float]:
        """Arc length of each living satellite that shares it, carried by its rate to one moment."""
        alive = dict(zip(self.status.satellites, self.status.alive, strict=True))
        words = {name: entry.word.message for name, entry in self._satellites.items() if alive.get(name)}
        words = {name: word for name, word in words.items() if isinstance(word, ArcLength)}
        moment = max(map(_seconds, words.values()), default=0.0)
        return {
            name: float(word.arc_length + word.rate * (moment - _seconds(word)))
            for name, word in words.items()
        }

    def _links(self, moment: float) -> tuple[LinkLook, ...]:
        names = list(self.status.satellites)
        links = []
        for hears, heard in zip(self.status.edge_receivers, self.status.edge_senders, strict=True):
            listener, speaker = names[hears], names[heard]
            word = self._satellites[speaker].word.message
            # A word for the step to come is there before that step.
            age = math.nan if word is None else max(0.0, moment - _seconds(word))
            links.append(LinkLook(listener, speaker, age))
        return tuple(links)


def sentences(message: Any) -> list[str]:
    """What a word of the log, of diagnostics or of a changed gain says, where it is worth a line."""
    if isinstance(message, ParameterChange):
        value = ", ".join(f"{number:g}" for number in message.value)
        return [f"step {message.step}: {message.name} = {value}"]
    if isinstance(message, Log):
        worth = message.level >= _WARNING
        return [f"{message.name}: {message.msg}"] if worth else []
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
    """Hand what waits on a subscription to its callback, without an executor's cost for each."""
    while (taken := subscription.handle.take_message(subscription.msg_type, False)) is not None:
        subscription.callback(taken[0])
