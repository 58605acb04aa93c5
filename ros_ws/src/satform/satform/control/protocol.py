# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The protocol of control laws: what a law receives in each step and what it returns."""

import inspect
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from satform.common.spec import Spec
from satform.numeric.elementwise import Array
from satform.orbits.chief import KeplerianChief
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class FlightSetting:
    """What is known to a controller when it is built, before flight.

    Attributes:
        mean_motion: of the chief's orbit, rad/s.
        step: control period over which a command is held, s.
        thrust_resolution: acceleration of the thrusters' smallest impulse or impulse quantum, whichever is
            larger, on the satellite without propellant, m/s^2; 0 for thrusters without either.
        thrust_error: share of a command by which what is applied may differ from it at random; 0 for exact
            thrusters.
        chief: the chief's orbit; None means a circular one in an unknown plane.
    """

    mean_motion: float
    step: float
    thrust_resolution: float = 0.0
    thrust_error: float = 0.0
    chief: KeplerianChief | None = None


@dataclass(frozen=True)
class Motion:
    """Position and velocity in the chief's rotating LVLH frame.

    Attributes:
        position: m, shape (..., 3).
        velocity: m/s, taken in the rotating frame, shape (..., 3).
    """

    position: Array
    velocity: Array


@dataclass(frozen=True)
class ControlStep:
    """The step in which a control law acts; time belongs to it, and not to a counter of the law's own.

    Attributes:
        number: of the step, from 0 at the start of the flight.
        length: control period over which a command is held, s.
        applied_acceleration: of the satellite over the step before, as its thrusters applied it under their
            limits, errors and faults, LVLH, m/s^2, shape (..., 3); None at a satellite's first step.
        commanded_acceleration: what the satellite had commanded for it, m/s^2, shape (..., 3); None likewise,
            and the applied one after a gap in which nothing was commanded.
        skipped: steps directly before this one that the flight software was not called for although the
            satellite flew, as on the wall clock; 0 after a loss.
    """

    number: int
    length: float
    applied_acceleration: Array | None = None
    commanded_acceleration: Array | None = None
    skipped: int = 0

    @property
    def time(self) -> float:
        """Simulated time at which the step begins, s."""
        return self.number * self.length


@dataclass(frozen=True)
class Gap:
    """Steps for which a law was not called: the satellite was lost, or states were skipped on the wall clock.

    Attributes:
        first: number of the first of these steps: that for which the memory was made.
        count: how many there are, at least 1.
        length: of each, s.
        applied_acceleration: taken to have been applied in each of them, LVLH, m/s^2, shape (..., 3): zero
            while a satellite is lost, its last command while it is held on the wall clock. It is what the
            plant reports of the last of these steps.
        motion: measured or estimated at the first step after the gap, LVLH.
    """

    first: int
    count: int
    length: float
    applied_acceleration: Array
    motion: Motion


@dataclass(frozen=True)
class RelativeNeighbour:
    """Motion of a satellite relative to the one neighbour that it follows.

    Attributes:
        position: own position minus the neighbour's, m, shape (..., 3).
        velocity: own velocity minus the neighbour's, m/s, shape (..., 3).
    """

    position: Array
    velocity: Array


@dataclass(frozen=True)
class Action:
    """What a controller returns at one step.

    Attributes:
        acceleration: commanded, held until the next step, m/s^2, shape (..., 3).
        sliding_variable: the surface that the law drives to zero, m/s, shape (..., 3); zero for
            laws without one.
        memory: the controller's state for the next step, a frozen dataclass of arrays, or None
            for a law without memory.
    """

    acceleration: Array
    sliding_variable: Array
    memory: Any = None


class Controller(Protocol):
    """A control law of one satellite, or of many stacked along leading axes."""

    def start(self, motion: Motion) -> Any:
        """The law's memory before the first step; None for a law without memory."""

    def resume(self, memory: Any, gap: Gap) -> Any:
        """The law's memory after steps in which it was not called: kept, propagated or dropped.

        Called before `act` at the first step after the gap, and only for a law with a memory. The law's
        documentation says which of the three it does with each part of its memory.
        """

    def act(self, motion: Motion, reference: Reference, memory: Any, step: ControlStep) -> Action:
        """The command of one step from what was measured and what is desired."""


@runtime_checkable
class ReportsFailures(Protocol):
    """A control law that counts what failed in it without ending the flight."""

    def failures(self, memory: Any) -> dict[str, int]:
        """Counts of one satellite so far, by what has failed in words; a node warns while one is not zero."""


@runtime_checkable
class MakesPlans(Protocol):
    """A control law that makes plans in flight, which its solver may not finish."""

    def unsolved_plans(self, memory: Any) -> NDArray[np.int64]:
        """Plans so far that were not finished, of one satellite or of each of many, shape (...)."""


class NeighbourController(Protocol):
    """A control law that follows a neighbour instead of a reference."""

    def start(self, motion: Motion) -> Any:
        """The law's memory before the first step; None for a law without memory."""

    def resume(self, memory: Any, gap: Gap) -> Any:
        """The law's memory after steps in which it was not called, as in `Controller`."""

    def act(self, motion: Motion, neighbour: RelativeNeighbour, memory: Any, step: ControlStep) -> Action:
        """The command of one step from the own motion and the neighbour's relative motion."""

    def reference(self, motion: Motion, neighbour: RelativeNeighbour) -> Reference:
        """The desired motion that is nearest to the own one, by which the flight is judged."""


class Memoryless:
    """Base of control laws without memory."""

    def start(self, motion: Motion) -> None:
        """No memory."""

    def resume(self, memory: None, gap: Gap) -> None:
        """No memory."""


class ControllerSpec(Spec):
    """Base of every controller's specification; subclasses set a literal `kind` and their gains.

    Attributes:
        follows: what the law follows: a reference, or the satellite's one in-neighbour.
        makes_plans: whether the law is one that `MakesPlans`; a flight then records those that were not
            finished.
    """

    follows: ClassVar[Literal["reference", "neighbour"]] = "reference"
    makes_plans: ClassVar[bool] = False

    def build(self, setting: FlightSetting) -> Any:
        """The control law itself, a `Controller` or `NeighbourController` as `follows` says.

        Raises:
            ValueError: the gains cannot fly in this setting.
        """
        raise NotImplementedError

    def assumes_circular_chief(self) -> bool:
        """Whether the law's model of relative motion is about a circular orbit, whatever the chief's is.

        Returns:
            False, as here, for a law without such a model, or with one for any eccentricity.
        """
        return False

    def linearisation(self, setting: FlightSetting) -> Array | str | None:
        """The closed loop of one satellite over one step close to what the law wants, for `check` and `show`.

        Returns:
            Transition of the loop's errors over one step with the command held, shape (m, m); why there is
            none, in words, as of a law without feedback; or None, as here, to have it found by trying the
            law: that works for every law that is linear close to its reference.
        """
        return None


def require_protocol(law: Any, spec: ControllerSpec) -> None:
    """Refuse a law that lacks a method, as one that was written for an earlier protocol.

    Args:
        law: as its specification built it.
        spec: of the law, for the message.

    Raises:
        ValueError: a method is missing, or does not take the step.
    """
    name = f"{getattr(spec, 'kind', type(spec).__name__)} ({type(law).__module__}.{type(law).__qualname__})"
    wanted = ["start", "act", "resume", *(["reference"] if spec.follows == "neighbour" else [])]
    missing = [method for method in wanted if not callable(getattr(law, method, None))]
    if missing:
        raise ValueError(
            f"{name} has no method {' and no '.join(missing)}; a control law has {', '.join(wanted)}, where "
            "resume says what becomes of its memory over steps that it missed (a law without memory derives "
            "from Memoryless)"
        )
    try:
        inspect.signature(law.act).bind(None, None, None, None)
    except TypeError:
        raise ValueError(
            f"{name}: act takes {inspect.signature(law.act)}, and has to take what was measured, what is "
            "desired, the memory and the step"
        ) from None
