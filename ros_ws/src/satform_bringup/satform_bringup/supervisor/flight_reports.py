# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the processes of a flight report, and what follows for its result."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from satform.flight.compile import FormationPlan
from satform.membership.formation import SatelliteLost
from satform.membership.membership_manager import ALL_LOST
from satform.record.early_end import EarlyEnd
from satform_bringup.supervisor.flight import Flight, Loss, Policy, Rejoin


class FlightReports:
    """What is known of a flight by the events that its processes report.

    Attributes:
        begun: when the processes were started, monotonic clock, s.
        flying_since: when the first step began; None before it.
        steps: taken by the plant.
        lost: names of the processes whose loss was not planned.
        lost_since: when each of the satellites that do not fly was lost.
        killed: satellites that the scenario has killed and whose process has not ended yet.
        reason: why the flight ended early; empty for none.
        stopped: whether somebody has stopped it.
        over_since: when its end was reported; None before it.
    """

    def __init__(self, plan: FormationPlan, progress: Callable[[int, int], None], policy: Policy) -> None:
        """Nothing has been reported yet.

        Args:
            plan: of the flight's parts.
            progress: called now and then with the steps flown and the steps to fly.
            policy: what is done about losses.
        """
        self._plan, self._progress, self._policy = plan, progress, policy
        self._losses: list[Loss] = []
        self.lost_since: dict[str, float] = {}
        self._returns: list[Rejoin] = []
        self.killed: set[str] = set()
        self._satellites: dict[str, dict[str, Any]] = {}
        self.begun: float = 0.0
        self.flying_since: float | None = None
        self.steps: int = 0
        self._finished: dict[str, Any] | None = None
        self._busy: dict[str, float] = {}
        self._memory: dict[str, int] = {}
        self._recorded: dict[str, Any] = {}
        self.lost: list[str] = []
        self.reason: str = ""
        self.stopped: bool = False
        self.over_since: float | None = None
        self._early_end: EarlyEnd | None = None

    def take(self, event: dict[str, Any]) -> None:
        """Note an event of a process."""
        match event["event"]:
            case "flying":
                self.flying_since = time.monotonic()
            case "step":
                self.steps = event["step"]
                self._progress(self.steps, self._plan.timing.steps)
            case "finished" | "stopped":
                self._on_end(event)
            case "lost":
                self.steps = event["step"]
                if not self.lost:
                    self.lost, self.reason = event["who"], event["reason"]
            case "satellite":
                self._busy[event["node"]] = event["busy"]
                self._satellites[event["node"]] = event
            case "memory":
                self._memory[event["process"]] = event["bytes"]
            case "recorded":
                self._recorded = event
                missed = event["missed"]
                if not (missed or event["complete"]) and self._finished:
                    event["missed"] = ["the bag does not hold every message of the flight"]
            case _:
                self._on_absence(event)

    def note_over(self) -> None:
        """Remember the first sign of the end of the flight."""
        self.over_since = self.over_since or time.monotonic()

    def _on_end(self, event: dict[str, Any]) -> None:
        """The plant has taken its last step, or was stopped by a signal or a service."""
        self.steps = event["step"]
        self.note_over()
        if event["event"] == "finished":
            self._finished = event
            return
        if not self.reason:
            # By a service: a signal, or the loss that made an end of it, is known by now.
            self.stopped, self.reason = True, "stopped"
        self._progress(self.steps, self._plan.timing.steps)

    def _on_early_end(self, event: dict[str, Any]) -> None:
        """The plant has ended the flight because of a quantity, or another node has received that status."""
        if event["event"] == "ended_early":
            self.steps = event["step"]
        self._early_end = EarlyEnd.of(event["end"])
        self.reason = self.reason or self._early_end.sentence
        self.note_over()

    def _on_absence(self, event: dict[str, Any]) -> None:
        """Handle a loss or a rejoin, after which the flight continues, or an early end."""
        match event["event"]:
            case "killed":
                self.killed.add(event["node"])
            case "loss":
                self._note_absence(event["who"], event["step"], event["reason"])
            case "aborted":
                # A node has received the final status; the plant's own event comes later or to another host.
                self.note_over()
            case "ended_early" | "end_received":
                self._on_early_end(event)
            case "return":
                away = time.monotonic() - self.lost_since.pop(event["who"], time.monotonic())
                self._returns.append(Rejoin(event["who"], event["step"], away))
                if event["who"] in self.lost:
                    # Its loss stays recorded; the result counts the nodes that are lost at the end.
                    self.lost.remove(event["who"])

    def _note_absence(self, name: str, step: int, reason: str) -> None:
        """Store a loss after which the flight continues."""
        steps = self._plan.membership.events.get(step, [])
        names = self._plan.names
        expected = any(isinstance(event, SatelliteLost) and names[event.satellite] == name for event in steps)
        self._losses.append(Loss(name, step, reason, expected))
        self.lost_since.setdefault(name, time.monotonic())
        if not expected and name not in self.lost:
            self.lost.append(name)

    def _punctuality(self, timing: dict[str, Any]) -> dict[str, Any]:
        if not timing:
            return {}
        keys = ("skipped", "age_mean", "age_largest", "processor")
        own = {name: {key: event[key] for key in keys} for name, event in self._satellites.items()}
        return {**timing, "satellites": own}

    def _reason_in_words(self) -> str:
        """Why the flight ended early, and what became of a restart that was asked for."""
        if self._policy.restart and self.reason.endswith(ALL_LOST):
            return f"{self.reason}, and a satellite is restarted only while another one flies"
        return self.reason

    def _warnings(self) -> tuple[str, ...]:
        """What did not go well with satellites and ended nothing."""
        found = []
        for name, event in self._satellites.items():
            if event.get("checkpoint_failures"):
                last = event["checkpoint_problem"] or "the last one was written"
                found.append(f"{name}: {event['checkpoint_failures']} checkpoints were not written; {last}")
        return tuple(found)

    def flight(self, domain: int, bag: Path | None) -> Flight:
        """How it went."""
        now = time.monotonic()
        since = self.flying_since or now
        done = self._finished or {}
        return Flight(
            steps=self.steps,
            seconds=done.get("seconds", now - since),
            start_seconds=since - self.begun,
            plant_seconds=done.get("busy", 0.0),
            satellite_seconds=self._busy,
            memory=self._memory,
            domain=domain,
            lost=tuple(self.lost),
            losses=tuple(self._losses),
            returns=tuple(self._returns),
            reason=self._reason_in_words(),
            stopped=self.stopped,
            bag=bag,
            messages=self._recorded.get("messages", 0),
            missed=tuple(self._recorded.get("missed", ())),
            punctuality=self._punctuality(done.get("timing", {})),
            early_end=self._early_end,
            warnings=self._warnings(),
        )
