# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in a flight, as data: each fault begins and ends at a numbered step, in every run alike."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from satform.common.spec import NonNegative, Number, Positive, Spec
from satform.equipment.thruster import ThrusterFault
from satform.numeric.elementwise import Array, Indices

Memory = Literal["checkpoint", "plan"]
"""What a satellite knows that comes back: its last checkpoint, or its flight plan and the time."""

MOST_STEPS = 100_000_000
"""Steps of the longest flight."""


def step_at(time: float, step: float) -> int:
    """Number of the first step that does not begin before a moment.

    Args:
        time: simulated, s.
        step: control period, s.
    """
    return int(np.ceil(time / step * (1.0 - 1e-12) - 1e-9))


class FaultSpec(Spec):
    """Base of every fault's specification; subclasses set a literal `kind`.

    Attributes:
        corrupts_phase: whether it is about the phase that a satellite sends.
        needs: what a satellite has to have for it, `thruster` or `sensor`; empty for nothing.
    """

    corrupts_phase: ClassVar[bool] = False
    needs: ClassVar[Literal["", "thruster", "sensor"]] = ""

    satellite: str
    """Name of the satellite that it happens to."""
    at: NonNegative
    """When it begins: at the first step that does not begin before this simulated time, s."""

    def complaints(self, duration: float) -> list[tuple[str, str]]:
        """Field and sentence of what cannot be in a flight of this length in s."""
        if self.at >= duration:
            return [("at", f"at {self.at:g} s is not earlier than the flight's end at {duration:g} s")]
        return []


class PassingFaultSpec(FaultSpec):
    """Base of the faults that may pass."""

    until: Positive | None = None
    """When it ends, s; at the end of the flight when left out."""

    @model_validator(mode="after")
    def _forward(self) -> "PassingFaultSpec":
        if self.until is not None and self.until <= self.at:
            raise ValueError(f"until {self.until:g} s is not later than at {self.at:g} s")
        return self


class SatelliteLostSpec(FaultSpec):
    """The satellite's process is killed; its body drifts on without thrust."""

    kind: Literal["satellite_lost"] = "satellite_lost"
    rejoin_at: NonNegative | None = None
    """When it is started again and takes part, s; never when left out."""
    memory: Memory = "checkpoint"
    """`checkpoint`: it goes on from its last one; `plan`: it knows its flight plan and the time only."""

    @model_validator(mode="after")
    def _later(self) -> "SatelliteLostSpec":
        if self.at <= 0.0:
            raise ValueError("at has to be later than 0: a satellite that never flies is left out instead")
        if self.rejoin_at is not None and self.rejoin_at < self.at:
            raise ValueError(f"rejoin_at {self.rejoin_at:g} s is earlier than at {self.at:g} s")
        return self


class WeakThrusterSpec(PassingFaultSpec):
    """The thrusters apply only a part of what they would; propellant and delta-v follow what is applied."""

    needs: ClassVar[Literal["", "thruster", "sensor"]] = "thruster"

    kind: Literal["weak_thruster"] = "weak_thruster"
    factor: Annotated[float, Field(ge=0.0, le=10.0)]
    """Of the thrust that is applied; 0 for thrusters that are off. A factor above 1 lifts the thrust to what
    the hardware gives at most."""


class StuckThrusterSpec(PassingFaultSpec):
    """The thrusters keep the thrust of the step before, whatever is commanded, until the tank is empty."""

    needs: ClassVar[Literal["", "thruster", "sensor"]] = "thruster"

    kind: Literal["stuck_thruster"] = "stuck_thruster"


class FrozenSensorSpec(PassingFaultSpec):
    """The sensor repeats the same position and velocity, as if they were new."""

    needs: ClassVar[Literal["", "thruster", "sensor"]] = "sensor"

    kind: Literal["frozen_sensor"] = "frozen_sensor"


class ClockOffsetSpec(PassingFaultSpec):
    """The satellite's clock is wrong: others take its words for newer or older, and it does theirs."""

    kind: Literal["clock_offset"] = "clock_offset"
    offset: Annotated[float, Field(ge=-1e6, le=1e6)]
    """By which the clock is ahead, s."""


class ByzantineSpec(PassingFaultSpec):
    """The satellite sends its neighbours a well-formed message with a false phase."""

    corrupts_phase: ClassVar[bool] = True

    kind: Literal["byzantine"] = "byzantine"
    arc_length: Number = 0.0
    """Added to the phase that it sends, m."""
    drift: Number = 0.0
    """Added more and more, m each second since the lie began."""
    rate: Number = 0.0
    """Added to the rate that it sends, m/s."""


@dataclass(frozen=True)
class FaultInterval:
    """A fault that lasts from one step to another, of one satellite."""

    satellite: int
    begin: int
    end: int

    def holds(self, step: int) -> bool:
        """Whether the fault is active at a step."""
        return self.begin <= step < self.end


@dataclass(frozen=True)
class _Thrust(FaultInterval):
    factor: float | None


@dataclass(frozen=True)
class _Clock(FaultInterval):
    offset: float


@dataclass(frozen=True)
class _ByzantineInterval(FaultInterval):
    arc_length: float
    drift: float
    rate: float


@dataclass(frozen=True)
class FaultSchedule:
    """The faults of a scenario that change what satellites apply, measure, send and receive, by step.

    Losses of whole satellites are not among them: they change the formation, and are part of the
    membership plan.

    Attributes:
        step: control period, s.
        thrusts: what is wrong with thrusters.
        frozen: sensors that repeat a measurement.
        clocks: clocks that are wrong.
        byzantine: what satellites add to the phase that they announce.
    """

    step: float
    thrusts: tuple[_Thrust, ...] = ()
    frozen: tuple[FaultInterval, ...] = ()
    clocks: tuple[_Clock, ...] = ()
    byzantine: tuple[_ByzantineInterval, ...] = ()

    @classmethod
    def of(cls, specs: Iterable[FaultSpec], names: Sequence[str], step: float) -> "FaultSchedule":
        """The faults of a flight.

        Args:
            specs: from the scenario.
            names: of all satellites.
            step: control period, s.
        """
        thrusts: list[_Thrust] = []
        frozen: list[FaultInterval] = []
        clocks: list[_Clock] = []
        byzantine: list[_ByzantineInterval] = []
        for spec in specs:
            until = getattr(spec, "until", None)
            end = MOST_STEPS if until is None else step_at(until, step)
            interval = (names.index(spec.satellite), step_at(spec.at, step), end)
            match spec:
                case WeakThrusterSpec():
                    thrusts.append(_Thrust(*interval, spec.factor))
                case StuckThrusterSpec():
                    thrusts.append(_Thrust(*interval, None))
                case FrozenSensorSpec():
                    frozen.append(FaultInterval(*interval))
                case ClockOffsetSpec():
                    clocks.append(_Clock(*interval, spec.offset))
                case ByzantineSpec():
                    byzantine.append(_ByzantineInterval(*interval, spec.arc_length, spec.drift, spec.rate))
        return cls(step, tuple(thrusts), tuple(frozen), tuple(clocks), tuple(byzantine))

    @property
    def empty(self) -> bool:
        """Whether nothing goes wrong."""
        return not (self.thrusts or self.frozen or self.clocks or self.byzantine)

    def of_thrusters(self, members: Indices, step: int) -> ThrusterFault | None:
        """What is wrong with the thrusters of some satellites at a step; None for nothing.

        Args:
            members: indices of the satellites, shape (M,).
            step: number of the step.

        Returns:
            Arrays of shape (M,).
        """
        holding = [fault for fault in self.thrusts if fault.holds(step)]
        if not holding:
            return None
        factor, stuck = np.ones(len(members)), np.zeros(len(members))
        for fault in holding:
            own = members == fault.satellite
            if fault.factor is None:
                stuck[own] = 1.0
            else:
                factor[own] *= fault.factor
        return ThrusterFault(factor, stuck)

    def reading(
        self, position: Array, velocity: Array, step: int, held: dict[int, tuple[Array, Array]]
    ) -> tuple[Array, Array]:
        """What satellites measure at a step.

        Args:
            position: without faults, m, shape (N, 3).
            velocity: without faults, m/s, shape (N, 3).
            step: number of the step.
            held: what each frozen sensor repeats, by the fault's index; is filled when a fault begins.

        Returns:
            Position and velocity, shapes (N, 3).
        """
        for row, fault in enumerate(self.frozen):
            if not fault.holds(step):
                continue
            own = (position[fault.satellite].copy(), velocity[fault.satellite].copy())
            last = held.setdefault(row, own)
            position, velocity = position.copy(), velocity.copy()
            position[fault.satellite], velocity[fault.satellite] = last
        return position, velocity

    @property
    def any_clock(self) -> bool:
        """Whether some clock is wrong at some time."""
        return bool(self.clocks)

    def clock(self, satellite: int, step: int) -> float:
        """By how much a satellite's clock is ahead at a step, s."""
        return sum(
            (fault.offset for fault in self.clocks if fault.satellite == satellite and fault.holds(step)),
            0.0,
        )

    def is_byzantine(self, satellite: int) -> bool:
        """Whether a satellite announces a false phase at some time."""
        return any(added.satellite == satellite for added in self.byzantine)

    def corrupt(self, satellite: int, values: Array, step: int) -> Array:
        """What a satellite sends instead of its true phase.

        Args:
            satellite: its index.
            values: arc length (m) and its rate (m/s) as they are, shape (2,).
            step: for which it is sent.
        """
        for added in self.byzantine:
            if added.satellite == satellite and added.holds(step):
                since = (step - added.begin) * self.step
                values = values + np.array([added.arc_length + added.drift * since, added.rate])
        return values
