"""The flight software of one satellite: what it hears in, what it says and does out.

The same object flies one satellite, with vectors of shape (3,), or many at once, with a leading
axis over satellites; both give the same bits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from satform import batch
from satform.consensus.arc_length import ArcLengthConsensus, Heard, propagate
from satform.control.protocol import Controller, ControllerSpec, FlightSetting, Motion
from satform.elementwise import Array
from satform.navigation import Estimator, EstimatorMemory, Measurement
from satform.reference import Path, Reference
from satform.scenario.model import SatelliteSpec, Scenario


@dataclass(frozen=True)
class FlightPlan:
    """What a satellite is given before flight; arrays carry a leading axis when many fly as one.

    Attributes:
        path: the closed orbit to fly and how it is parametrised.
        controller: the control law.
        consensus: the law by which satellites agree on their phase.
        nominal_rate: rate of the generalised arc length once all agree, m/s, shape (...).
        phase_offset: by how much this satellite leads the agreement, m, shape (...).
        arc_length: generalised, at the start, m, shape (...).
        rate: of the generalised arc length at the start, m/s, shape (...).
        step: control period, s.
        estimator: what is made of the measurements; None to take them as they are.
    """

    path: Path
    controller: Controller
    consensus: ArcLengthConsensus
    nominal_rate: Array
    phase_offset: Array
    arc_length: Array
    rate: Array
    step: float
    estimator: Estimator | None = None


@dataclass(frozen=True)
class Announcement:
    """What a satellite tells its neighbours.

    Attributes:
        time: simulated moment at which the values hold, s, shape (...).
        arc_length: generalised arc length less the satellite's phase offset, m, shape (...).
        rate: of the generalised arc length, m/s, shape (...).
    """

    time: Array
    arc_length: Array
    rate: Array


@dataclass(frozen=True)
class SatelliteState:
    """All that a satellite remembers from one step to the next.

    Attributes:
        step: number of the step that comes next.
        arc_length: generalised, of the reference, m, shape (...).
        rate: of the generalised arc length, m/s, shape (...).
        announcement: what the neighbours hear in that step.
        memory: the control law's own state.
        estimate: the estimator's state; None without one and before the first step.
        acceleration: commanded in the step before, m/s^2, shape (..., 3); None before the first step.
    """

    step: int
    arc_length: Array
    rate: Array
    announcement: Announcement
    memory: Any
    estimate: EstimatorMemory | None = None
    acceleration: Array | None = None


@dataclass(frozen=True)
class Decision:
    """What a satellite decides in one step.

    Attributes:
        acceleration: commanded until the next step, LVLH, m/s^2, shape (..., 3).
        reference: the motion that is desired.
        sliding_variable: of the control law, m/s, shape (..., 3).
        motion: where the satellite believes to be: the estimator's word, or what it was told.
    """

    acceleration: Array
    reference: Reference
    sliding_variable: Array
    motion: Motion


class Satellite:
    """One satellite's flight software, or that of many satellites flown as one."""

    def __init__(self, plan: FlightPlan) -> None:
        self.plan = plan
        start = Announcement(np.zeros_like(plan.arc_length), plan.arc_length - plan.phase_offset, plan.rate)
        self.state = SatelliteState(0, plan.arc_length, plan.rate, start, None)

    @classmethod
    def of(cls, scenario: Scenario, index: int) -> "Satellite":
        """The satellite of a scenario with the given place in the list."""
        return cls(flight_plan(scenario, index))

    @classmethod
    def together(cls, scenario: Scenario, indices: Sequence[int]) -> "Satellite":
        """Several satellites of a scenario flown as one.

        Raises:
            ValueError: they differ in kind, so that they cannot be stacked.
        """
        return cls(batch.stack([flight_plan(scenario, index) for index in indices]))

    def announce(self) -> Announcement:
        """What the neighbours may hear in the coming step."""
        return self.state.announcement

    def act(self, motion: Motion, heard: Heard, measured_step: int | None = None) -> Decision:
        """One step of flight software: decide the command and move on to the next step.

        Args:
            motion: the satellite's own position and velocity, measured or true, shapes (..., 3).
            heard: the announcements of its neighbours, shapes (..., K).
            measured_step: number of the step at which the motion was so; this one when left out.

        Returns:
            The command with the reference that it follows.
        """
        plan, state = self.plan, self.state
        estimate = None
        if plan.estimator is not None:
            at = state.step if measured_step is None else measured_step
            estimate = _estimated(plan.estimator, state, Measurement(motion.position, motion.velocity, at))
            motion = Motion(estimate.state[..., :3], estimate.state[..., 3:])
        if state.step == 0:
            state = replace(state, memory=plan.controller.start(motion))
        time = state.step * plan.step
        follows_itself = plan.consensus.arc_length_source == "projected"
        if follows_itself:
            arc_length, rate = plan.path.projected(motion.position, motion.velocity, state.arc_length)
        else:
            arc_length, rate = state.arc_length, state.rate
        phase = arc_length - plan.phase_offset
        rate_change = plan.consensus.acceleration(phase, rate, plan.nominal_rate, heard, time)
        reference = plan.path.at_step(arc_length, rate, rate_change, plan.step)
        action = plan.controller.act(motion, reference, state.memory)
        next_arc_length, next_rate = propagate(arc_length, rate, rate_change, plan.step)
        if follows_itself:
            said = Announcement(np.full_like(phase, time), phase, rate)
        else:
            moment = np.full_like(phase, (state.step + 1) * plan.step)
            said = Announcement(moment, next_arc_length - plan.phase_offset, next_rate)
        self.state = SatelliteState(
            state.step + 1, next_arc_length, next_rate, said, action.memory, estimate, action.acceleration
        )
        return Decision(action.acceleration, reference, action.sliding_variable, motion)

    def use_controller(self, spec: ControllerSpec, setting: FlightSetting) -> None:
        """Change the gains from the next step on, keeping what the control law remembers.

        Raises:
            ValueError: the gains cannot fly in this setting.
        """
        self.plan = replace(self.plan, controller=spec.build(setting))


def _estimated(estimator: Estimator, state: SatelliteState, measurement: Measurement) -> EstimatorMemory:
    if state.estimate is None or state.acceleration is None:
        return estimator.start(measurement)
    return estimator.observe(state.estimate, measurement, state.acceleration)


def flight_setting(scenario: Scenario) -> FlightSetting:
    """What controllers may know of a scenario."""
    return FlightSetting(mean_motion=scenario.orbit.rate, step=scenario.timing.step)


def flight_plan(scenario: Scenario, index: int) -> FlightPlan:
    """What the satellite with the given place in a scenario's list is given before flight."""
    spec = scenario.satellite(index)
    assert spec.curve is not None  # noqa: S101 - the scenario's validator has seen to both
    assert spec.controller is not None  # noqa: S101
    path = Path(spec.curve.build(), _scalar(spec.scale), spec.parameter, spec.feed_forward)
    circulation = scenario.circulation
    nominal = circulation.rate
    if nominal is None:
        assert circulation.period is not None  # noqa: S101
        nominal = float(path.period) / circulation.period
    return FlightPlan(
        path=path,
        controller=spec.controller.build(flight_setting(scenario)),
        consensus=scenario.consensus.build(),
        nominal_rate=_scalar(nominal),
        phase_offset=_scalar(spec.phase_offset),
        arc_length=_scalar(spec.arc_length),
        rate=_scalar(nominal if spec.rate is None else spec.rate),
        step=scenario.timing.step,
        estimator=_estimator(scenario, spec),
    )


def _estimator(scenario: Scenario, spec: SatelliteSpec) -> Estimator | None:
    if spec.filter is None:
        return None
    assert spec.sensor is not None  # noqa: S101 - the scenario's validator has seen to it
    return spec.filter.build(scenario.orbit.rate, scenario.timing.step, spec.sensor)


def _scalar(value: float) -> Array:
    """A number of one satellite, which stacks like an array and computes faster than one of no axes."""
    scalar: Array = np.asarray(value, dtype=np.float64)[()]
    return scalar


def motion_at_start(scenario: Scenario) -> Motion:
    """Where all satellites begin: on their references, off by the scenario's errors.

    Returns:
        Position in m and velocity in m/s in LVLH, shapes (N, 3).
    """
    positions, velocities = [], []
    for index in range(len(scenario.satellites)):
        spec, plan = scenario.satellite(index), flight_plan(scenario, index)
        desired = plan.path.reference(plan.arc_length, plan.rate, np.zeros_like(plan.rate))
        positions.append(desired.position + np.asarray(spec.position_error))
        velocities.append(desired.velocity + np.asarray(spec.velocity_error))
    return Motion(np.stack(positions), np.stack(velocities))
