# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The door for truth models: what moves the satellites between two steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol, Self

from satform.common.spec import Complaint, Spec
from satform.dynamics.prescribed_disturbances import Perturbation
from satform.numeric.elementwise import Array
from satform.orbits.chief import ChiefOrbitSpec, KeplerianChief
from satform.orbits.frames import LvlhFrame


@dataclass(frozen=True)
class DynamicsSetting:
    """What a truth model may know when it is built.

    Attributes:
        mean_motion: of the chief's orbit, rad/s.
        step: control period over which a command is held, s.
        satellite_count: how many satellites fly besides the chief.
        seed: of everything random in the run.
    """

    mean_motion: float
    step: float
    satellite_count: int
    seed: int = 0


class Dynamics(Protocol):
    """Base of truth models: the state is its own frozen data, seen from outside through `lvlh`.

    A satellite's numbers do not depend on which or how many others fly. Commands are held in the
    LVLH axes over the step: a model whose frame turns in inertial space turns them with it.
    """

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> Any:
        """The model's state at time zero.

        Args:
            position_lvlh: m, shape (N, 3).
            velocity_lvlh: m/s, taken in the rotating frame, shape (N, 3).
        """

    def advance(self, state: Any, acceleration_lvlh: Array, step: int) -> Any:
        """The model's state one control period later.

        Args:
            state: at the start of the step.
            acceleration_lvlh: commanded, held over the step, m/s^2, shape (N, 3).
            step: number of the step; it begins at `step` control periods from time zero.
        """

    def lvlh(self, state: Any) -> tuple[Array, Array]:
        """Position in m and velocity in m/s, taken in the rotating frame, both of shape (N, 3)."""

    def earth_distance(self, state: Any) -> Array | None:
        """Distance of each satellite from the Earth's centre, m, shape (N,).

        Returns:
            None for a model whose state does not hold it: the chief is then on the circle of `orbit`.
        """
        return None

    def chief_frames(self, steps: int) -> LvlhFrame | None:
        """The chief's LVLH frame at time zero and after each step, inertial; no command acts on a chief.

        Args:
            steps: K.

        Returns:
            A frame with arrays of shape (K + 1, 3); None for a model that does not know where its chief is.
        """
        return None

    def chief_frame(self, state: Any, step: int) -> LvlhFrame | None:
        """The chief's LVLH frame in a state of the flight, inertial.

        Args:
            state: at the beginning of the step.
            step: number of the step.

        Returns:
            The frame that `chief_frames` gives for this step; None for a model that does not know where its
            chief is.
        """
        return None


class DynamicsSpec(Spec):
    """Base of every truth model's specification; subclasses set a literal `kind`."""

    def complaints(self, setting: DynamicsSetting) -> list[Complaint]:
        """Why the model cannot be flown in a setting, found without building it.

        Returns:
            Path of a field of this specification and a sentence, for each fault.
        """
        return []

    def keplerian_chief(self, mean_motion: float) -> KeplerianChief | None:
        """The chief's orbit at time zero for a mean motion in rad/s: what control laws may know of it.

        Returns:
            None, as here, for a model about a circular orbit in an unknown plane.
        """
        return None

    def about(self, chief: ChiefOrbitSpec, epoch: datetime) -> Self:
        """This model with the chief's orbit and the date of time zero, where it has any.

        What the scenario says of them stays known by `model_fields_set`, which is not changed.

        Args:
            chief: its orbit at time zero.
            epoch: of time zero, UTC.
        """
        known = {"chief": chief, "epoch": epoch}
        about = self.model_copy(update={key: known[key] for key in known if key in type(self).model_fields})
        about.__pydantic_fields_set__ = set(self.model_fields_set)
        return about

    def start_frame(self, setting: DynamicsSetting) -> LvlhFrame | None:
        """The chief's frame at time zero, in which this model takes positions and velocities.

        Returns:
            None, as here, for a model that is linear about a circular orbit.
        """
        return None

    def build(self, setting: DynamicsSetting) -> Dynamics:
        """The truth model itself.

        Raises:
            ValueError: the model cannot be flown in this setting.
        """
        raise NotImplementedError


def total_perturbation(perturbations: Sequence[Perturbation], step: int, offset: float) -> Array:
    """Sum of the perturbations at one instant.

    Args:
        perturbations: at least one.
        step: number of the control step.
        offset: time since the start of that step, s.

    Returns:
        m/s^2, LVLH, shape (N, 3).
    """
    total: Array = perturbations[0].acceleration(step, offset)
    for perturbation in perturbations[1:]:
        total = total + perturbation.acceleration(step, offset)
    return total
