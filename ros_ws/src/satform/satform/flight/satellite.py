# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The flight software of one satellite: from received messages to its own message and commands.

The same object flies one satellite, with vectors of shape (3,), or many at once, with a leading
axis over satellites; both give the same bits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from satform.attitude.guidance import Attitude, EstimatedAttitude, PointingReference
from satform.attitude.mrp_tracking import AttitudeTrackingSpec
from satform.communication.messages import (
    WIDTH,
    NeighbourMessage,
    NeighbourStates,
    PhaseMessage,
    decode,
    encode,
)
from satform.communication.neighbour_buffer import NeighbourBuffer, Received
from satform.consensus.arc_length import Announces, ArcLengthConsensus, NeighbourPhases, propagate
from satform.consensus.motion_sharing import MotionMessage, MotionSharing, NeighbourMotion
from satform.control.protocol import (
    Action,
    ControllerSpec,
    ControlStep,
    FlightSetting,
    Gap,
    MakesPlans,
    Motion,
    ReportsFailures,
)
from satform.equipment.sensors.relative_motion import Measurement
from satform.flight.plans import FlightPlan
from satform.navigation.estimator import Estimator, EstimatorMemory
from satform.navigation.satellite_navigation import NavigationInput, NavigationMemory, SatelliteNavigation
from satform.numeric import stacking
from satform.numeric.elementwise import Array
from satform.orbits.curve import Curve
from satform.orbits.path_reference import Path, Reference


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


class Satellite:
    """One satellite's flight software, or that of many satellites flown as one."""

    def __init__(self, plan: FlightPlan, neighbours: int = 0) -> None:
        """A satellite before its first step.

        Args:
            plan: its parameters before flight.
            neighbours: number of possible in-neighbours; of satellites flown as one the largest.
        """
        self.plan = plan
        self._makes_plans = isinstance(plan.controller, MakesPlans)
        neighbour_timeout = plan.consensus.neighbour_timeout
        self._aim = (
            None
            if plan.orientation is None
            else PointingReference(
                plan.orientation, plan.step, neighbour_timeout, plan.path.feedforward_sample
            )
        )
        self._announces: Announces = "motion" if isinstance(plan.consensus, MotionSharing) else "arc_length"
        width = WIDTH[self._announces] + (0 if plan.navigation is None else plan.navigation.message_width)
        inbox = NeighbourBuffer.empty((*np.shape(plan.arc_length), neighbours), width)
        self.state = SatelliteState(0, plan.arc_length, plan.rate, _first_announcement(plan), None, inbox)

    @classmethod
    def stacked(cls, plans: Sequence[FlightPlan], neighbours: int) -> "Satellite":
        """Several satellites flown as one.

        Args:
            plans: of the satellites.
            neighbours: largest number of possible in-neighbours of one of them.

        Raises:
            ValueError: they differ in kind, so that they cannot be stacked.
        """
        if any(plan.navigation is not None or plan.attitude_filter is not None for plan in plans):
            raise ValueError("satellites with filters on the readings of sensors cannot be stacked")
        return cls(stacking.stack(plans), neighbours)

    def single(self, row: int, plan: FlightPlan, neighbours: int) -> "Satellite":
        """One of several satellites flown as one, to go on by itself with the same bits.

        Args:
            row: its index among them.
            plan: its own.
            neighbours: number of its possible in-neighbours.
        """
        single = Satellite(plan, neighbours)
        state = stacking.item(self.state, row)
        single.state = replace(state, inbox=state.inbox.first(neighbours))
        return single

    def announce(self) -> NeighbourMessage:
        """The message for the neighbours in the coming step."""
        return self.state.announcement

    def announced_numbers(self) -> Array:
        """Numbers of the message for the neighbours beside its time, with the estimate if they use it."""
        phase, navigation = encode(self.announce()), self.plan.navigation
        if navigation is None or navigation.exchange is None:
            return phase
        return np.concatenate((phase, self.estimate_numbers()))

    def estimate_numbers(self) -> Array:
        """Numbers of the estimate by the satellite's navigation that goes with the message."""
        assert self.plan.navigation is not None  # noqa: S101 - asked of satellites that estimate
        return self.plan.navigation.message(self.state.navigation, self.state.acceleration)

    def act(
        self,
        motion: Motion,
        received: Received,
        measured_step: int | None = None,
        attitude: Attitude | None = None,
        applied_acceleration: Array | None = None,
        sensed: NavigationInput | None = None,
    ) -> Decision:
        """One step of flight software: decide the command and move on to the next step.

        Args:
            motion: the satellite's own position and velocity, measured or true, shapes (..., 3).
            received: the announcements of its neighbours.
            measured_step: number of the step at which the motion was so; this one when left out.
            attitude: its own, shapes (..., 3); None for a satellite without attitude. One with an attitude
                filter uses nothing of it but the momentum of the wheels.
            applied_acceleration: over the step before, as the plant reports it, LVLH, m/s^2, shape (..., 3);
                left out where commands are applied as they are.
            sensed: readings of its sensors with what its navigation needs beside; None without sensors.

        Returns:
            The command with the reference that it follows.
        """
        plan, state = self.plan, self.state
        inbox = state.inbox.after(received)
        neighbour_states = self._neighbour_states(inbox, received)
        applied = _applied(state, applied_acceleration)
        estimate: EstimatorMemory | None = None
        navigation: NavigationMemory | None = None
        if plan.navigation is not None:
            assert sensed is not None  # noqa: S101 - the plant publishes the readings of every step
            navigation = _navigated(plan.navigation, state, sensed, applied)
            motion = Motion(navigation.state[:3], navigation.state[3:])
        elif plan.estimator is not None:
            at = state.step if measured_step is None else measured_step
            measurement = Measurement(motion.position, motion.velocity, at)
            estimate = _estimated(plan.estimator, state, measurement, applied)
            motion = Motion(estimate.state[..., :3], estimate.state[..., 3:])
        turned = None
        if attitude is not None and sensed is not None:
            turned = _turned(plan, state, attitude.wheel_momentum, sensed.readings)
            attitude = attitude if turned is None else turned.attitude
        memory = _memory(plan, state, motion, applied)
        commanded = applied if state.missed else state.acceleration
        step = ControlStep(state.step, plan.step, applied, commanded, state.skipped)
        if isinstance(neighbour_states, NeighbourMotion):
            reference, action, phase = _follow_neighbour(
                plan, state, motion, neighbour_states, (memory, step)
            )
        else:
            reference, action, phase = _follow_path(plan, state, motion, neighbour_states, (memory, step))
        self.state = SatelliteState(
            step=state.step + 1,
            arc_length=phase.arc_length,
            rate=phase.rate,
            announcement=phase.message,
            memory=action.memory,
            inbox=inbox,
            has_acted=True,
            estimate=estimate,
            acceleration=action.acceleration,
            navigation=navigation,
            attitude=turned,
        )
        torque = None
        if self._aim is not None and plan.orientation is not None and attitude is not None:
            aim = self._aim.at(state.step, reference, neighbour_states)
            time = np.full_like(state.arc_length, state.step * plan.step)
            torque = plan.orientation.wheel_torque(attitude, aim, time, self._aim.ahead)
        unsolved = None
        if self._makes_plans:
            law = plan.controller
            unsolved = (law.unsolved_plans(action.memory) - law.unsolved_plans(memory)).astype(np.float64)
        sliding = action.sliding_variable
        known = estimate if navigation is None else navigation
        return Decision(action.acceleration, reference, sliding, motion, torque, known, unsolved, turned)

    def _neighbour_states(self, inbox: NeighbourBuffer, received: Received) -> NeighbourStates:
        """The newest message of each neighbour, with weight zero where it has become too old."""
        weight = inbox.known
        if not received.complete:
            weight = inbox.counted(self.state.step * self.plan.step, self.plan.consensus.neighbour_timeout)
        return decode(self._announces, inbox.values, inbox.stamp, weight)

    def law_failures(self) -> dict[str, int]:
        """What has failed in the control law so far, by name; of one satellite."""
        law, memory = self.plan.controller, self.state.memory
        return law.failures(memory) if memory is not None and isinstance(law, ReportsFailures) else {}

    def join(self, step: int, *, skipped: bool = False) -> None:
        """Take part (again) from a later step on, with what was known at the present one.

        The arc length is carried on at its rate. What the control law remembers and what was estimated of
        the own motion are carried over the gap when the satellite acts next, since that takes what was
        applied meanwhile. Nothing changes when the step is the one that comes next anyway.

        Args:
            step: the next one in which it acts.
            skipped: whether the satellite flew on meanwhile, its states having been skipped on the wall
                clock; otherwise it was lost.
        """
        plan, state = self.plan, self.state
        if step == state.step:
            return
        missed = step - state.step
        arc_length = state.arc_length + (step - state.step) * plan.step * state.rate
        message = state.announcement
        if isinstance(message, PhaseMessage):
            moment = np.full_like(arc_length, step * plan.step)
            message = PhaseMessage(moment, arc_length - plan.phase_offset, state.rate)
        self.state = replace(
            state,
            step=step,
            arc_length=arc_length,
            announcement=message,
            missed=state.missed + missed,
            skipped=state.skipped + missed if skipped else 0,
        )

    def rearrange(self, previous: list[int | None]) -> None:
        """Go on with another list of possible neighbours.

        Args:
            previous: for each of the new list, its index in the old one; None for one that was not in it.
        """
        self.state = replace(self.state, inbox=self.state.inbox.rearranged(previous))

    def find_target(self, neighbours: Sequence[int]) -> None:
        """Go on pointing at the same satellite with another list of possible neighbours.

        Args:
            neighbours: indices of the satellite's possible in-neighbours, ascending.
        """
        orientation = self.plan.orientation
        if orientation is None or orientation.target is None:
            return
        orientation = replace(orientation, target=orientation.target.among(neighbours))
        self.plan = replace(self.plan, orientation=orientation)
        plan = self.plan
        self._aim = PointingReference(
            orientation, plan.step, plan.consensus.neighbour_timeout, plan.path.feedforward_sample
        )

    def use_controller(self, spec: ControllerSpec, setting: FlightSetting) -> None:
        """Change the gains from the next step on, keeping the control law's memory.

        Raises:
            ValueError: the gains cannot fly in this setting.
        """
        self.plan = replace(self.plan, controller=spec.build(setting))

    def use_phase_offset(self, offset: float) -> None:
        """Lead the formation's agreement by another arc length in m from the next step on.

        The message for that step was still sent with the previous offset.
        """
        self.plan = replace(self.plan, phase_offset=_scalar(offset))

    def use_curve(self, curve: Curve) -> None:
        """Fly another orbit from the next step on, with the same generalised arc length per revolution.

        Raises:
            ValueError: one of the two is a fixed point, and the other one is not.
        """
        plan = self.plan
        path = replace(plan.path, curve=curve, scale=_scalar(1.0))
        lap, own = float(plan.path.period), float(path.period)
        if (lap > 0.0) != (own > 0.0):
            raise ValueError("an orbit cannot become a fixed point, nor a fixed point an orbit")
        scale = _scalar(own / lap if lap > 0.0 else 1.0)
        self.plan = replace(plan, path=replace(path, scale=scale))

    def use_target(self, path: Path, phase_offset: float, nominal_rate: float, since: int) -> None:
        """Fly along another path from the next step on.

        The generalised arc length goes on; so does its rate, unless the nominal rate is another one.

        Args:
            path: to be flown.
            phase_offset: by which the satellite leads the formation's agreement, m.
            nominal_rate: of the generalised arc length once all agree, m/s.
            since: the first step with this path. A satellite whose state is of a later one has the rate of
                this path.
        """
        plan, nominal = self.plan, _scalar(nominal_rate)
        if nominal != plan.nominal_rate and self.state.step <= since:
            self.state = replace(self.state, rate=nominal)
        self.plan = replace(plan, path=path, phase_offset=_scalar(phase_offset), nominal_rate=nominal)

    def use_attitude_controller(self, spec: AttitudeTrackingSpec) -> None:
        """Change the gains of the attitude from the next step on.

        Raises:
            ValueError: the satellite has no attitude, or these inertias belong to no body.
        """
        if self.plan.orientation is None:
            raise ValueError("this satellite has no attitude")
        self.plan = replace(self.plan, orientation=replace(self.plan.orientation, law=spec.build()))


@dataclass(frozen=True)
class _Phase:
    """Arc length and rate for the next step, and the message about them or about the motion."""

    arc_length: Array
    rate: Array
    message: NeighbourMessage


def _first_announcement(plan: FlightPlan) -> NeighbourMessage:
    begin = np.zeros_like(plan.arc_length)
    if isinstance(plan.consensus, MotionSharing):
        return MotionMessage(begin, plan.start.position, plan.start.velocity)
    return PhaseMessage(begin, plan.arc_length - plan.phase_offset, plan.rate)


def _applied(state: SatelliteState, reported: Array | None) -> Array | None:
    """What was applied over the step before; None before a satellite's first step."""
    if not state.has_acted:
        return None
    if reported is not None:
        return reported
    # There is no report of it: commands are applied as they are, and there was none in a gap.
    assert state.acceleration is not None  # noqa: S101 - it has acted
    return np.zeros_like(state.acceleration) if state.missed else state.acceleration


def _memory(plan: FlightPlan, state: SatelliteState, motion: Motion, applied: Array | None) -> Any:
    """The control law's memory for this step: started at the first one, carried over a gap."""
    if not state.has_acted:
        return plan.controller.start(motion)
    if not state.missed or state.memory is None or applied is None:
        return state.memory
    gap = Gap(state.step - state.missed, state.missed, plan.step, applied, motion)
    return plan.controller.resume(state.memory, gap)


def _follow_path(
    plan: FlightPlan,
    state: SatelliteState,
    motion: Motion,
    neighbour_states: NeighbourPhases,
    law: tuple[Any, ControlStep],
) -> tuple[Reference, Action, _Phase]:
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
        moment = np.empty(phase.shape)
        moment.fill((state.step + 1) * plan.step)
        message = PhaseMessage(moment, next_arc_length - plan.phase_offset, next_rate)
    return reference, action, _Phase(next_arc_length, next_rate, message)


def _follow_neighbour(
    plan: FlightPlan,
    state: SatelliteState,
    motion: Motion,
    neighbour_states: NeighbourMotion,
    law: tuple[Any, ControlStep],
) -> tuple[Reference, Action, _Phase]:
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
    return reference, action, _Phase(state.arc_length, state.rate, message)


def _estimated(
    estimator: Estimator, state: SatelliteState, measurement: Measurement, applied: Array | None
) -> EstimatorMemory:
    """The estimate at this step; after a gap it is carried over it with what was applied in it."""
    if state.estimate is None or applied is None:
        return estimator.start(measurement)
    memory = state.estimate
    if state.missed:
        assert state.acceleration is not None  # noqa: S101 - it has acted
        memory = estimator.resume(memory, state.missed, state.acceleration, applied)
    return estimator.observe(memory, measurement, applied)


def _navigated(
    navigation: SatelliteNavigation, state: SatelliteState, sensed: NavigationInput, applied: Array | None
) -> NavigationMemory:
    """The navigation at this step; after a gap it is carried over it with what was applied in it."""
    if state.navigation is None or applied is None:
        return navigation.observe(navigation.start(state.step), sensed, None)
    memory = state.navigation
    if state.missed:
        assert state.acceleration is not None  # noqa: S101 - it has acted
        memory = navigation.resume(memory, state.missed, state.acceleration, applied)
    return navigation.observe(memory, sensed, applied)


def _turned(
    plan: FlightPlan, state: SatelliteState, wheel_momentum: Array, readings: Array
) -> EstimatedAttitude | None:
    """The attitude by its filter at this step; None for a satellite without one."""
    own = plan.attitude_filter
    if own is None or plan.orientation is None:
        return None
    earlier = wheel_momentum
    if state.attitude is None:
        memory = own.first(readings, begins_again=state.step > 0)
    else:
        memory = state.attitude.memory
        if state.missed:
            memory = own.resume(memory, state.missed)
        else:
            earlier = state.attitude.attitude.wheel_momentum
        memory = own.observe(memory, readings)
    time = np.full_like(state.arc_length, state.step * plan.step)
    attitude = plan.orientation.estimated(memory, wheel_momentum, earlier, time, plan.step)
    return EstimatedAttitude(memory, attitude)


def _scalar(value: float) -> Array:
    """A number of one satellite, which stacks like an array and computes faster than one of no axes."""
    scalar: Array = np.asarray(value, dtype=np.float64)[()]
    return scalar
