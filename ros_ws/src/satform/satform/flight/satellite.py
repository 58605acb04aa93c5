# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The flight software of one satellite: from received messages to its own message and commands.

The same object flies one satellite, with vectors of shape (3,), or many at once, with a leading
axis over satellites; both give the same bits.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from satform.attitude.guidance import Attitude, PointingReference
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
from satform.consensus.arc_length import Announces
from satform.consensus.motion_sharing import MotionSharing, NeighbourMotion
from satform.control.protocol import (
    ControllerSpec,
    ControlStep,
    FlightSetting,
    MakesPlans,
    Motion,
    ReportsFailures,
)
from satform.equipment.sensors.relative_motion import Measurement
from satform.flight.float_act import WORTHWHILE, FloatAct, StepInputs
from satform.flight.plans import FlightPlan
from satform.flight.satellite_step import (
    Decision,
    SatelliteState,
    applied_before,
    estimated,
    first_announcement,
    follow_neighbour,
    follow_path,
    law_memory,
    navigated,
    turned_by_filter,
)
from satform.navigation.relative_state_filter import EstimatorMemory
from satform.navigation.satellite_navigation import NavigationInput, NavigationMemory
from satform.numeric import stacking
from satform.numeric.elementwise import Array, scalar
from satform.orbits.curve import Curve
from satform.orbits.path_reference import Path


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
        self._floats: FloatAct | None = None
        self._state: SatelliteState | None = SatelliteState(
            0, plan.arc_length, plan.rate, first_announcement(plan), None, inbox
        )

    @property
    def state(self) -> SatelliteState:
        """What the satellite remembers before its next step."""
        if self._state is None:
            assert self._floats is not None  # noqa: S101 - it has flown the last step
            self._state = self._floats.program.state
        return self._state

    @state.setter
    def state(self, state: SatelliteState) -> None:
        self._state = state

    @property
    def step(self) -> int:
        """Number of the step that comes next."""
        if self._state is None and self._floats is not None:
            return self._floats.program.step
        return self.state.step

    def repeat_on_floats(self, steps: int) -> None:
        """Fly by a program on floats where it has the bits of arrays, which is faster for few satellites.

        Args:
            steps: of the whole flight.
        """
        self._floats = FloatAct(steps) if steps >= WORTHWHILE else None

    def fly_over_arrays(self) -> None:
        """Fly over arrays, as a new satellite does."""
        self._state, self._floats = self.state, None

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
        if self._state is None and self._floats is not None:
            return self._floats.program.announcement
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
        floats = self._floats
        if floats is None or sensed is not None or not received.complete or self.plan.estimator is not None:
            return self._act(motion, received, measured_step, attitude, applied_acceleration, sensed)
        inputs = StepInputs(
            motion, received.values, received.stamp, received.linked, attitude, applied_acceleration
        )
        decision = floats.act(self, self._state, inputs)
        if decision is not None:
            self._state = None
            return decision
        decision = self._act(motion, received, measured_step, attitude, applied_acceleration)
        floats.compare(decision, self.state)
        return decision

    def _act(
        self,
        motion: Motion,
        received: Received,
        measured_step: int | None = None,
        attitude: Attitude | None = None,
        applied_acceleration: Array | None = None,
        sensed: NavigationInput | None = None,
    ) -> Decision:
        """One step over arrays; see `act`."""
        plan, state = self.plan, self.state
        inbox = state.inbox.after(received)
        neighbour_states = self._neighbour_states(inbox, received)
        applied = applied_before(state, applied_acceleration)
        estimate: EstimatorMemory | None = None
        navigation: NavigationMemory | None = None
        if plan.navigation is not None:
            assert sensed is not None  # noqa: S101 - the plant publishes the readings of every step
            navigation = navigated(plan.navigation, state, sensed, applied)
            motion = Motion(navigation.state[:3], navigation.state[3:])
        elif plan.estimator is not None:
            at = state.step if measured_step is None else measured_step
            measurement = Measurement(motion.position, motion.velocity, at)
            estimate = estimated(plan.estimator, state, measurement, applied)
            motion = Motion(estimate.state[..., :3], estimate.state[..., 3:])
        turned = None
        if attitude is not None and sensed is not None:
            turned = turned_by_filter(plan, state, attitude.wheel_momentum, sensed.readings)
            attitude = attitude if turned is None else turned.attitude
        memory = law_memory(plan, state, motion, applied)
        commanded = applied if state.missed else state.acceleration
        step = ControlStep(state.step, plan.step, applied, commanded, state.skipped)
        if isinstance(neighbour_states, NeighbourMotion):
            reference, action, phase = follow_neighbour(plan, state, motion, neighbour_states, (memory, step))
        else:
            reference, action, phase = follow_path(plan, state, motion, neighbour_states, (memory, step))
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
        self.plan = replace(self.plan, phase_offset=scalar(offset))

    def use_curve(self, curve: Curve) -> None:
        """Fly another orbit from the next step on, with the same generalised arc length per revolution.

        Raises:
            ValueError: one of the two is a fixed point, and the other one is not.
        """
        plan = self.plan
        path = replace(plan.path, curve=curve, scale=scalar(1.0))
        lap, own = float(plan.path.period), float(path.period)
        if (lap > 0.0) != (own > 0.0):
            raise ValueError("an orbit cannot become a fixed point, nor a fixed point an orbit")
        scale = scalar(own / lap if lap > 0.0 else 1.0)
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
        plan, nominal = self.plan, scalar(nominal_rate)
        if nominal != plan.nominal_rate and self.state.step <= since:
            self.state = replace(self.state, rate=nominal)
        self.plan = replace(plan, path=path, phase_offset=scalar(phase_offset), nominal_rate=nominal)

    def use_attitude_controller(self, spec: AttitudeTrackingSpec) -> None:
        """Change the gains of the attitude from the next step on.

        Raises:
            ValueError: the satellite has no attitude, or these inertias belong to no body.
        """
        if self.plan.orientation is None:
            raise ValueError("this satellite has no attitude")
        self.plan = replace(self.plan, orientation=replace(self.plan.orientation, law=spec.build()))
