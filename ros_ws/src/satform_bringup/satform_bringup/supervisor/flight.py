# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Options of a flight over DDS beside its scenario, and its result."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from satform.record.early_end import EarlyEnd


@dataclass(frozen=True)
class Loss:
    """Loss of a satellite or of the recorder.

    Attributes:
        name: of its node.
        step: first step without it.
        reason: as text.
        planned: whether the scenario says so.
    """

    name: str
    step: int
    reason: str
    planned: bool


@dataclass(frozen=True)
class Rejoin:
    """Rejoin of a satellite.

    Attributes:
        name: of its node.
        step: first step with it.
        seconds: wall-clock time since its loss, s.
    """

    name: str
    step: int
    seconds: float


@dataclass(frozen=True)
class Policy:
    """How losses are handled, and how time passes.

    Attributes:
        restart: whether a satellite that is lost is started again.
        without_recorder: whether the flight goes on when the recorder is lost.
        rate: simulated seconds in each second of the wall clock; 0 for lockstep.
    """

    restart: bool = False
    without_recorder: bool = False
    rate: float = 0.0


@dataclass(frozen=True)
class Flight:
    """Result of a flight over DDS.

    Attributes:
        steps: steps flown.
        seconds: wall-clock time from the first step to the last.
        start_seconds: wall-clock time from the start of the first process to the first step.
        plant_seconds: of these, the plant's own computation.
        satellite_seconds: of these, each satellite's own computation.
        memory: largest resident memory of each process with satellites, by its first satellite, bytes.
        domain: DDS domain in which it was flown.
        lost: names of the processes that ended too early or were silent for too long, though the scenario
            does not say so, and are not back.
        losses: every satellite or recorder without which the flight went on, planned or not.
        returns: every satellite that came back.
        reason: why the flight ended early; empty when it did not.
        stopped: whether it was ended by a signal to the run or by the service for it.
        bag: folder of the bag; None when nothing was recorded.
        messages: in the bag.
        warnings: sentences about what did not go well and ended nothing, such as checkpoints without room.
        missed: sentences about messages that did not reach the bag.
        punctuality: of a flight on the wall clock: the plant's figures, and each satellite's by its name.
        early_end: the quantity that was not finite or beyond its limit, with which the flight ended; None
            when it did not end so.
    """

    steps: int
    seconds: float
    start_seconds: float
    plant_seconds: float
    satellite_seconds: dict[str, float]
    memory: dict[str, int]
    domain: int
    lost: tuple[str, ...]
    losses: tuple[Loss, ...]
    returns: tuple[Rejoin, ...]
    reason: str
    stopped: bool
    bag: Path | None
    messages: int
    missed: tuple[str, ...]
    punctuality: dict[str, Any]
    early_end: EarlyEnd | None = None
    warnings: tuple[str, ...] = ()
