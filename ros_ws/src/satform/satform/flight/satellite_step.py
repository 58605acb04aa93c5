# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts of a step of flight software, as functions of a satellite's plan and its state before the step."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.attitude.guidance import EstimatedAttitude
from satform.communication.messages import NeighbourMessage, PhaseMessage
from satform.communication.neighbour_buffer import NeighbourBuffer
from satform.consensus.arc_length import ArcLengthConsensus, NeighbourPhases, propagate
from satform.consensus.motion_sharing import MotionMessage, MotionSharing, NeighbourMotion
from satform.control.protocol import Action, ControlStep, Gap, Motion
from satform.equipment.sensors.relative_motion import Measurement
from satform.flight.plans import FlightPlan
from satform.navigation.relative_state_filter import Estimator, EstimatorMemory
from satform.navigation.satellite_navigation import NavigationInput, NavigationMemory, SatelliteNavigation
from satform.numeric import stacking
from satform.numeric.elementwise import Array, blank
from satform.orbits.path_reference import Reference


@dataclass(frozen=True)
class SatelliteState:
    """All that a satellite remembers from one step to the next.

    Attributes:
        step: number of the step that comes next.
        arc_length: generalised, of the reference, m, shape (...).
        rate: of the generalised arc length, m/s, shape (...).
        announcement: what the neighbours receive in that step.
        memory: the control law's own state.
        inbox: the newest message of each neighbour.
        has_acted: whether the satellite has acted before.
        estimate: the estimator's state; None without one and before the first step.
        acceleration: commanded in the step before, m/s^2, shape (..., 3); None before the first step.
        missed: steps before the next one in which it did not act since it acted last; its memory and its
            estimate are for the first of them.
        skipped: how many of them were skipped on the wall clock while it flew.
        navigation: the state of the filter on its sensors; None without one and before the first step.
        attitude: likewise of the filter of its attitude.
    """

    step: int
    arc_length: Array
    rate: Array
    announcement: NeighbourMessage
    memory: Any
    inbox: NeighbourBuffer
    has_acted: bool = False
    estimate: EstimatorMemory | None = None
    acceleration: Array | None = None
    missed: int = 0
    skipped: int = 0
    navigation: NavigationMemory | None = None
    attitude: EstimatedAttitude | None = None


@dataclass(frozen=True)
class Decision:
    """What a satellite decides in one step.

    Attributes:
        acceleration: commanded until the next step, LVLH, m/s^2, shape (..., 3).
        reference: the motion that is desired.
        sliding_variable: of the control law, m/s, shape (..., 3).
        motion: the estimated motion, or the measured one without an estimator.
        wheel_torque: of the motors on the wheels until the next step, N m, shape (..., 3); None for a
            satellite without attitude.
        estimate: of the filter, with its covariance; None for a satellite without one.
        unsolved_plans: of this step, that the control law's solver did not finish, shape (...); None for a
            law that makes no plans.
        attitude: as the satellite knows it by its attitude filter; None for one without such a filter.
    """

    acceleration: Array
    reference: Reference
    sliding_variable: Array
    motion: Motion
    wheel_torque: Array | None = None
    estimate: EstimatorMemory | NavigationMemory | None = None
    unsolved_plans: Array | None = None
    attitude: EstimatedAttitude | None = None

    def tracked(self) -> list[Array]:
        """What a tracking message has beside time, step and plans.

        Returns:
            Position, velocity and acceleration of the reference, errors of position and velocity, sliding
            variable, each of shape (..., 3).
        """
        reference, motion = self.reference, self.motion
        return [
            reference.position,
            reference.velocity,
            reference.acceleration,
            motion.position - reference.position,
            motion.velocity - reference.velocity,
            self.sliding_variable,
        ]


@dataclass(frozen=True)
class NextPhase:
    """Arc length and rate for the next step, and the message about them or about the motion."""

    arc_length: Array
    rate: Array
    message: NeighbourMessage


def first_announcement(plan: FlightPlan) -> NeighbourMessage:
    """What the neighbours of a satellite receive in the first step."""
    begin = np.zeros_like(plan.arc_length)
    if isinstance(plan.consensus, MotionSharing):
        return MotionMessage(begin, plan.start.position, plan.start.velocity)
    return PhaseMessage(begin, plan.arc_length - plan.phase_offset, plan.rate)


def applied_before(state: SatelliteState, reported: Array | None) -> Array | None:
    """What was applied over the step before; None before a satellite's first step.

    Args:
        state: before the step.
        reported: acceleration by the plant's report, LVLH, m/s^2, shape (..., 3); None without one.
    """
    if not state.has_acted:
        return None
    if reported is not None:
        return reported
    # There is no report of it: commands are applied as they are, and there was none in a gap.
    assert state.acceleration is not None  # noqa: S101 - it has acted
    return np.zeros_like(state.acceleration) if state.missed else state.acceleration


def law_memory(plan: FlightPlan, state: SatelliteState, motion: Motion, applied: Array | None) -> Any:
    """The control law's memory for this step: started at the first one, carried over a gap.

    Args:
        plan: of the satellite.
        state: before the step.
        motion: at the step, measured or estimated.
        applied: acceleration over the step before, LVLH, m/s^2, shape (..., 3); None at the first step.
    """
    if not state.has_acted:
        return plan.controller.start(motion)
    if not state.missed or state.memory is None or applied is None:
        return state.memory
    gap = Gap(state.step - state.missed, state.missed, plan.step, applied, motion)
    return plan.controller.resume(state.memory, gap)


def follow_path(
    plan: FlightPlan,
    state: SatelliteState,
    motion: Motion,
    neighbour_states: NeighbourPhases,
    law: tuple[Any, ControlStep],
) -> tuple[Reference, Action, NextPhase]:
    """A step along the own path, whose phase agrees with those of the neighbours.

    Args:
        plan: of the satellite.
        state: before the step.
        motion: at the step, measured or estimated.
        neighbour_states: phases of the neighbours.
        law: memory of the control law, and what it knows of the step.

    Returns:
        The motion that is desired, what the control law does, and the phase for the next step.
    """
    assert isinstance(plan.consensus, ArcLengthConsensus)  # noqa: S101 - what is received belongs to it
    time = state.step * plan.step
    follows_itself = plan.consensus.arc_length_source == "projected"
    if follows_itself:
        arc_length, rate = plan.path.projected(motion.position, motion.velocity, state.arc_length)
    else:
        arc_length, rate = state.arc_length, state.rate
    phase = arc_length - plan.phase_offset
    rate_change = plan.consensus.acceleration(phase, rate, plan.nominal_rate, neighbour_states, time)
    reference = plan.path.at_step(arc_length, rate, rate_change, plan.step, state.step)
    action: Action = plan.controller.act(motion, reference, *law)
    next_arc_length, next_rate = propagate(arc_length, rate, rate_change, plan.step)
    if follows_itself:
        message = PhaseMessage(np.full_like(phase, time), phase, rate)
    else:
        moment = blank(phase.shape, phase)
        moment[...] = (state.step + 1) * plan.step
        message = PhaseMessage(moment, next_arc_length - plan.phase_offset, next_rate)
    return reference, action, NextPhase(next_arc_length, next_rate, message)


def follow_neighbour(
    plan: FlightPlan,
    state: SatelliteState,
    motion: Motion,
    neighbour_states: NeighbourMotion,
    law: tuple[Any, ControlStep],
) -> tuple[Reference, Action, NextPhase]:
    """A step relative to the motion of the neighbour that the satellite follows.

    Args:
        plan: of the satellite.
        state: before the step.
        motion: at the step, measured or estimated.
        neighbour_states: motion of the neighbours.
        law: memory of the control law, and what it knows of the step.

    Returns:
        The motion that is desired, what the control law does, and the message for the next step.
    """
    assert isinstance(plan.consensus, MotionSharing)  # noqa: S101 - what is received belongs to it
    time = state.step * plan.step
    neighbour = plan.consensus.observed(motion, neighbour_states, time)
    action: Action = plan.controller.act(motion, neighbour, *law)
    message = MotionMessage(np.full_like(state.arc_length, time), motion.position, motion.velocity)
    reference: Reference = plan.controller.reference(motion, neighbour)
    follows = neighbour_states.weight > 0.0
    if not np.all(follows):
        # Nobody to follow: the satellite coasts, desires its own motion, and its law learns nothing.
        still = np.zeros_like(motion.position)
        coasting = Action(still, still, law[0])
        action = stacking.select(follows, action, coasting)
        reference = stacking.select(follows, reference, Reference(motion.position, motion.velocity, still))
    return reference, action, NextPhase(state.arc_length, state.rate, message)


def estimated(
    estimator: Estimator, state: SatelliteState, measurement: Measurement, applied: Array | None
) -> EstimatorMemory:
    """The estimate at this step; after a gap it is carried over it with what was applied in it.

    Args:
        estimator: of the satellite.
        state: before the step.
        measurement: of the own motion.
        applied: acceleration over the step before, LVLH, m/s^2, shape (..., 3); None at the first step.
    """
    if state.estimate is None or applied is None:
        return estimator.start(measurement)
    memory = state.estimate
    if state.missed:
        assert state.acceleration is not None  # noqa: S101 - it has acted
        memory = estimator.resume(memory, state.missed, state.acceleration, applied)
    return estimator.observe(memory, measurement, applied)


def navigated(
    navigation: SatelliteNavigation, state: SatelliteState, sensed: NavigationInput, applied: Array | None
) -> NavigationMemory:
    """The navigation at this step; after a gap it is carried over it with what was applied in it.

    Args:
        navigation: of the satellite.
        state: before the step.
        sensed: readings of the sensors, with what the neighbours estimate.
        applied: acceleration over the step before, LVLH, m/s^2, shape (..., 3); None at the first step.
    """
    if state.navigation is None or applied is None:
        return navigation.observe(navigation.start(state.step), sensed, None)
    memory = state.navigation
    if state.missed:
        assert state.acceleration is not None  # noqa: S101 - it has acted
        memory = navigation.resume(memory, state.missed, state.acceleration, applied)
    return navigation.observe(memory, sensed, applied)


def turned_by_filter(
    plan: FlightPlan, state: SatelliteState, wheel_momentum: Array, readings: Array
) -> EstimatedAttitude | None:
    """The attitude by its filter at this step; None for a satellite without one.

    Args:
        plan: of the satellite.
        state: before the step.
        wheel_momentum: at the step, N m s, body axes, shape (..., 3).
        readings: of all sensors of the satellite, shape (..., W).
    """
    own = plan.attitude_filter
    if own is None or plan.orientation is None:
        return None
    earlier, time = wheel_momentum, np.full_like(state.arc_length, state.step * plan.step)
    if state.attitude is None:
        memory = own.first(readings, begins_again=state.step > 0)
    else:
        memory = state.attitude.memory
        acceleration = np.zeros_like(wheel_momentum)
        if state.missed:
            memory = own.resume(memory, state.missed)
        else:
            before = state.attitude.attitude
            earlier = before.wheel_momentum
            if own.holds_rate:
                acceleration = plan.orientation.acceleration(
                    before, wheel_momentum, time - plan.step, plan.step
                )
        memory = own.observe(memory, readings, acceleration)
    attitude = plan.orientation.estimated(memory, wheel_momentum, earlier, time, plan.step)
    return EstimatedAttitude(memory, attitude)
