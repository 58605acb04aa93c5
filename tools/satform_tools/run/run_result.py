# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Result of a run: verdicts, speed, exit code, and the file `result.json`."""

import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from satform.common.exit_codes import EXIT_DONE, EXIT_ENDED_EARLY, EXIT_LOST, EXIT_MISSED, EXIT_STOPPED
from satform.files.durable_file import write_durably
from satform.record.early_end import EarlyEnd
from satform.scenario import Scenario
from satform.scenario.expectation import Verdict
from satform_tools.console import to_json
from satform_tools.run.flight_summary import Summary
from satform_tools.run.versions import versions

Mode = Literal["lockstep", "inprocess", "realtime"]


@dataclass(frozen=True)
class Speed:
    """How fast a run was, in wall-clock time.

    Attributes:
        steps: flown.
        seconds: from the first step to the last.
        step_length: simulated time of a step, s.
        start_seconds: from the command to the first step.
        plant_seconds: of these, the plant's own computation; None where it is not measured.
        satellite_seconds: of these, each satellite's own computation.
        ping_pong_seconds: of a bare round trip; None when it was not measured.
    """

    steps: int
    seconds: float
    step_length: float
    start_seconds: float = 0.0
    plant_seconds: float | None = None
    satellite_seconds: dict[str, float] = field(default_factory=dict)
    ping_pong_seconds: float | None = None

    @property
    def steps_per_second(self) -> float:
        """Steps flown each second of wall-clock time."""
        return self.steps / self.seconds if self.seconds > 0.0 else math.nan

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds each second of wall-clock time."""
        return self.steps_per_second * self.step_length

    def fractions(self) -> dict[str, float]:
        """Fractions of the step: the plant, the slowest satellite, and the rest, which is DDS and waiting."""
        if self.plant_seconds is None or self.seconds <= 0.0:
            return {}
        plant = self.plant_seconds / self.seconds
        slowest = max(self.satellite_seconds.values(), default=0.0) / self.seconds
        return {"plant": plant, "slowest_satellite": slowest, "dds": max(0.0, 1.0 - plant - slowest)}


@dataclass(frozen=True)
class RunResult:
    """Result of a run.

    Attributes:
        scenario: of the run.
        mode: how it was flown.
        folder: of the run.
        speed: how fast it was.
        verdicts: one for each expectation; empty when nothing could be judged.
        summary: the flight in figures; None when nothing could be judged.
        recorded: whether there is a record.
        lost: names of unplanned lost processes that have not rejoined.
        events: sentences about losses and rejoins, planned or not.
        reason: why the flight ended early or cannot be judged; empty when neither is so.
        stopped: whether the user stopped it.
        messages: in the bag.
        punctuality: of a real-time flight: delays, missed steps, message ages.
        host: the scenario's host that this machine was; empty when it ran everything.
        judged_on: the host that judges the flight, where it is another one.
        state_hash: of the record; empty when there is none, or in real time, where runs are not bitwise
            reproducible.
        early_end: the quantity that was not finite or beyond its limit, with which the flight ended; None
            when it did not end so.
    """

    scenario: Scenario
    mode: Mode
    folder: Path
    speed: Speed
    verdicts: tuple[Verdict, ...] = ()
    summary: Summary | None = None
    recorded: bool = True
    lost: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    reason: str = ""
    stopped: bool = False
    messages: int = 0
    punctuality: dict[str, Any] = field(default_factory=dict)
    host: str = ""
    judged_on: str = ""
    state_hash: str = ""
    early_end: EarlyEnd | None = None

    @property
    def complete(self) -> bool:
        """Whether every step was flown and nothing is missing from the record."""
        flown = self.speed.steps == self.scenario.timing.steps
        return flown and not (self.stopped or self.reason)

    @property
    def stopped_by_signal(self) -> bool:
        """Whether this process was asked to stop, and not the flight by its service."""
        return self.stopped and self.reason.startswith("stopped by SIG")

    @property
    def tolerated(self) -> bool:
        """Whether no more was lost than the scenario allows."""
        return len(self.lost) <= self.scenario.tolerated_losses

    @property
    def exit_code(self) -> int:
        """As expected, expectation missed, a process lost, ended early, or stopped by the user."""
        if self.stopped:
            return EXIT_STOPPED
        if self.early_end is not None:
            return EXIT_ENDED_EARLY
        if not (self.complete and self.tolerated):
            return EXIT_LOST
        return EXIT_DONE if all(verdict.met for verdict in self.verdicts) else EXIT_MISSED

    @property
    def judged(self) -> bool:
        """Whether the whole flight, or one that ended early, was held against at least one expectation."""
        return (self.complete or self.early_end is not None) and bool(self.verdicts)

    def data(self) -> dict[str, Any]:
        """Everything about the run, for `result.json` and `--json`."""
        timing = self.scenario.timing
        return {
            "scenario": self.scenario.name,
            "title": self.scenario.title,
            "digest": self.scenario.digest(),
            "seed": self.scenario.seed,
            "mode": self.mode,
            "folder": str(self.folder),
            "steps": self.speed.steps,
            "steps_planned": timing.steps,
            "complete": self.complete,
            "stopped": self.stopped,
            "lost": list(self.lost),
            "events": list(self.events),
            "reason": self.reason,
            "exit_code": self.exit_code,
            "early_end": None if self.early_end is None else self.early_end.data(),
            "judged": self.judged,
            "expectations": [asdict(verdict) for verdict in self.verdicts],
            "omitted_expectations": list(self.scenario.omitted_expectations),
            "summary": None if self.summary is None else self.summary.data(),
            "messages": self.messages,
            "punctuality": self.punctuality,
            "host": self.host,
            "judged_on": self.judged_on,
            "state_hash": self.state_hash or None,
            "speed": {
                **asdict(self.speed),
                "steps_per_second": self.speed.steps_per_second,
                "real_time_factor": self.speed.real_time_factor,
                "shares": self.speed.fractions(),
            },
            "versions": versions(),
        }

    def write(self, path: Path) -> None:
        """Write it as a JSON file.

        Raises:
            OSError: it cannot be written.
        """
        write_durably(path, f"{to_json(self.data())}\n".encode())
