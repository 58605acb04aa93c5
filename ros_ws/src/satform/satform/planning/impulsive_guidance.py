# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Impulsive controllers: two-impulse transfers through way-points, and burns at given times.

Equations: docs/controllers/planning.md.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from satform.common.spec import NonNegative, Positive, Spec, Vector
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Memoryless, Motion
from satform.dynamics import cw
from satform.dynamics.linear import multiply
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference
from satform.planning.transfers import coast_to_point


def due(planned: Array, step: ControlStep) -> NDArray[np.bool_]:
    """Which burns are due at a step.

    A burn is flown at its step. When that step was skipped, as on the wall clock, it is flown at the first
    step after it; when the satellite was lost at that step, it is not flown at all.

    Args:
        planned: step of each burn, negative for none, any shape.
        step: that is taken.

    Returns:
        Same shape.
    """
    flown: NDArray[np.bool_] = (planned >= max(0, step.number - step.skipped)) & (planned <= step.number)
    return flown


@dataclass(frozen=True)
class ImpulseTour(Memoryless):
    """Two-impulse transfers through a list of way-points, with burns of one step each.

    A burn is solved for as it is flown, held over one step, so that its length costs no accuracy. Which one
    is due follows from the number of the step alone, so that the law has no memory that a loss of the
    satellite could make wrong: a tour that is taken up again after a loss goes on at the next departure.

    Attributes:
        departure_steps: step at which each leg is departed on, shape (..., legs).
        stop_steps: step at which a stop is burnt at the end of each leg, -1 for none, (..., legs).
        targets: end of each leg, less what the known acceleration moves the satellite by until then, LVLH, m,
            shape (..., legs, 3).
        position_to_target: position at departure to position at the leg's end, (..., legs, 3, 3).
        velocity_to_target: velocity at departure to position at the leg's end, s, (..., legs, 3, 3).
        command_for_target: miss at the leg's end to command at departure, 1/s^2, (..., legs, 3, 3).
        position_to_rest: position to the velocity one step later, 1/s, shape (..., 3, 3).
        velocity_to_rest: velocity to the velocity one step later, shape (..., 3, 3).
        command_for_rest: velocity one step later to the command that changes it, 1/s, (..., 3, 3).
        rest_velocity: velocity one step later that the known acceleration brings to rest, m/s, (..., 3).
    """

    departure_steps: Array
    stop_steps: Array
    targets: Array
    position_to_target: Array
    velocity_to_target: Array
    command_for_target: Array
    position_to_rest: Array
    velocity_to_rest: Array
    command_for_rest: Array
    rest_velocity: Array

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        """The burn due at this step, if any.

        Args:
            motion: measured position and velocity, LVLH.
            reference: unused: the tour's way-points are its own.
            memory: unused.
            step: whose number says what is due.

        Returns:
            Commanded acceleration, zero between burns; the sliding variable is zero.
        """
        acceleration = np.zeros_like(motion.position)
        departing, stopping = due(self.departure_steps, step), due(self.stop_steps, step)
        legs = range(self.departure_steps.shape[-1]) if np.any(departing | stopping) else ()
        # Of several burns that are late together the last one counts: it is solved for as things are now.
        for leg in legs:
            departs, stops = departing[..., leg], stopping[..., leg]
            if np.any(departs):
                burn = self._departure(leg, motion)
                acceleration = np.where(departs[..., None], burn, acceleration)
            if np.any(stops):
                acceleration = np.where(stops[..., None], self._stop(motion), acceleration)
        return Action(acceleration, np.zeros_like(acceleration))

    def _departure(self, leg: int, motion: Motion) -> Array:
        coasted = multiply(self.position_to_target[..., leg, :, :], motion.position) + multiply(
            self.velocity_to_target[..., leg, :, :], motion.velocity
        )
        return multiply(self.command_for_target[..., leg, :, :], self.targets[..., leg, :] - coasted)

    def _stop(self, motion: Motion) -> Array:
        coasted = multiply(self.position_to_rest, motion.position) + multiply(
            self.velocity_to_rest, motion.velocity
        )
        return -multiply(self.command_for_rest, coasted - self.rest_velocity)


class WaypointSpec(Spec):
    """One point of a tour."""

    position: Vector
    """Where the leg ends, LVLH, m."""
    duration: Positive
    """Time from the leg's departure to this point, s."""
    arrival: Literal["stop", "pass"] = "stop"
    """Whether the satellite comes to rest in LVLH here, or passes on with one impulse."""


class ImpulsiveGuidanceSpec(ControllerSpec):
    """Two-impulse transfers through way-points; the reference curve is not followed."""

    kind: Literal["impulsive_guidance"] = "impulsive_guidance"
    waypoints: Annotated[tuple[WaypointSpec, ...], Field(min_length=1)]
    """Way-points in order."""
    start_time: NonNegative = 0.0
    """Time of the first departure, s."""
    known_acceleration: Vector = (0.0, 0.0, 0.0)
    """Constant acceleration that acts besides the burns, for which they are solved, LVLH, m/s^2."""

    def linearisation(self, setting: FlightSetting) -> str:
        """No loop is closed."""
        return "whose burns are solved for once each"

    def assumes_circular_chief(self) -> bool:
        """Its model is that of Clohessy and Wiltshire."""
        return True

    def build(self, setting: FlightSetting) -> ImpulseTour:
        """The tour with its burns placed on steps and solved for.

        Raises:
            ValueError: a leg is shorter than three steps or has no two-impulse solution.
        """
        here = cw.transition_matrix(setting.mean_motion, setting.step)
        held = cw.input_matrix(setting.mean_motion, setting.step)
        departure = round(self.start_time / setting.step)
        disturbance = np.array(self.known_acceleration, dtype=np.float64)
        departures, stops, transitions, commands, targets = [], [], [], [], []
        for number, waypoint in enumerate(self.waypoints):
            steps = round(waypoint.duration / setting.step)
            if steps < 3:
                raise ValueError(
                    f"impulse: waypoint {number} is flown to in {waypoint.duration:g} s, but three steps "
                    f"of {setting.step:g} s are the least"
                )
            transition, _ = coast_to_point(setting.mean_motion, steps * setting.step)
            after_burn = cw.transition_matrix(setting.mean_motion, (steps - 1) * setting.step)
            commands.append(np.linalg.inv((after_burn @ held)[:3]))
            transitions.append(transition)
            moved = cw.input_matrix(setting.mean_motion, steps * setting.step)[:3] @ disturbance
            targets.append(np.array(waypoint.position) - moved)
            departures.append(departure)
            departure += steps
            stop = waypoint.arrival == "stop" or number == len(self.waypoints) - 1
            stops.append(departure if stop else -1)
            departure += 1 if stop else 0
        return ImpulseTour(
            departure_steps=np.array(departures, dtype=np.float64),
            stop_steps=np.array(stops, dtype=np.float64),
            targets=np.array(targets),
            position_to_target=np.array([transition[:3, :3] for transition in transitions]),
            velocity_to_target=np.array([transition[:3, 3:] for transition in transitions]),
            command_for_target=np.array(commands),
            position_to_rest=here[3:, :3].copy(),
            velocity_to_rest=here[3:, 3:].copy(),
            command_for_rest=np.asarray(np.linalg.inv(held[3:]), dtype=np.float64),
            rest_velocity=np.asarray(0.0 - held[3:] @ disturbance, dtype=np.float64),
        )


@dataclass(frozen=True)
class TimedBurns(Memoryless):
    """Burns at set times, each held over one step; which are due follows from the number of the step alone.

    Attributes:
        steps: at which the burns are flown, shape (..., burns).
        accelerations: of the burns, LVLH, m/s^2, shape (..., burns, 3).
    """

    steps: Array
    accelerations: Array

    def act(self, motion: Motion, reference: Reference, memory: None, step: ControlStep) -> Action:
        """The burn due at this step, if any.

        Args:
            motion: measured position and velocity, LVLH; not used.
            reference: not used.
            memory: not used.
            step: whose number says what is due.

        Returns:
            Commanded acceleration, zero between burns; the sliding variable is zero.
        """
        acceleration = np.zeros_like(motion.position)
        now = due(self.steps, step)
        if np.any(now):
            for burn in range(self.steps.shape[-1]):
                flown = np.where(now[..., burn, None], self.accelerations[..., burn, :], 0.0)
                acceleration = acceleration + flown
        return Action(acceleration, np.zeros_like(acceleration))


class BurnSpec(Spec):
    """One burn."""

    time: NonNegative
    """Time of its middle, s."""
    velocity_change: Vector
    """Change of velocity, LVLH, m/s."""


class TimedBurnsSpec(ControllerSpec):
    """Burns at set times, as from a patrol plan; the reference curve is not followed."""

    kind: Literal["timed_burns"] = "timed_burns"
    burns: tuple[BurnSpec, ...] = ()
    """Burns; several in one step add up."""

    def linearisation(self, setting: FlightSetting) -> str:
        """No loop is closed."""
        return "whose burns do not depend on the motion"

    def build(self, setting: FlightSetting) -> TimedBurns:
        """The burns placed on the control steps whose middle is nearest to their time."""
        steps = [max(0, round(burn.time / setting.step - 0.5)) for burn in self.burns]
        changes = np.array([burn.velocity_change for burn in self.burns], dtype=np.float64).reshape(-1, 3)
        return TimedBurns(np.array(steps, dtype=np.float64), changes / setting.step)
