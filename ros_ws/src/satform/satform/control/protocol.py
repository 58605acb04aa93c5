"""The door for controllers: what a control law is given and what it gives back."""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

from satform.elementwise import Array
from satform.reference import Reference
from satform.spec import Spec


@dataclass(frozen=True)
class FlightSetting:
    """What a controller may know when it is built, before flight.

    Attributes:
        mean_motion: of the chief's circular orbit, rad/s.
        step: control period over which a command is held, s.
    """

    mean_motion: float
    step: float


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
class RelativeNeighbour:
    """The one neighbour that a satellite follows, as seen from the satellite.

    Attributes:
        position: own position minus the neighbour's, m, shape (..., 3).
        velocity: own velocity minus the neighbour's, m/s, shape (..., 3).
    """

    position: Array
    velocity: Array


@dataclass(frozen=True)
class Action:
    """What a controller decides at one step.

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

    def act(self, motion: Motion, reference: Reference, memory: Any) -> Action:
        """The command of one step from what was measured and what is desired."""


class NeighbourController(Protocol):
    """A control law that flies on a neighbour instead of on a reference."""

    def start(self, motion: Motion) -> Any:
        """The law's memory before the first step; None for a law without memory."""

    def act(self, motion: Motion, neighbour: RelativeNeighbour, memory: Any) -> Action:
        """The command of one step from the own motion and the neighbour's relative motion."""

    def reference(self, motion: Motion, neighbour: RelativeNeighbour) -> Reference:
        """The desired motion that is nearest to the own one, by which the flight is judged."""


class ControllerSpec(Spec):
    """Base of every controller's specification; subclasses set a literal `kind` and their gains.

    Attributes:
        follows: what the law flies on: a reference, or the one neighbour that the satellite hears.
    """

    follows: ClassVar[Literal["reference", "neighbour"]] = "reference"

    def build(self, setting: FlightSetting) -> Any:
        """The control law itself, a `Controller` or `NeighbourController` as `follows` says.

        Raises:
            ValueError: the gains cannot fly in this setting.
        """
        raise NotImplementedError
