# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Model-predictive control: the fuel-optimal plan within an error box, flown and renewed at intervals.

Equations: docs/controllers/model_predictive.md.
"""

import math
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import NonNegative, Positive, PositivePerAxis
from satform.control.fuel_optimal_plan import FuelPlan, FuelProblem, solve
from satform.control.keep_out import KeepOut, KeepOutSpec, keep_out_of
from satform.control.protocol import Action, ControllerSpec, ControlStep, FlightSetting, Gap, Motion
from satform.dynamics.linear import multiply
from satform.dynamics.relative_motion_models import (
    CwModel,
    ModelName,
    RelativeMotionModel,
    input_matrix,
    relative_motion_model,
)
from satform.numeric import stacking
from satform.numeric.elementwise import Array, Indices, dot
from satform.orbits.path_reference import Reference

_FIRST_PASSES = 4
"""Linearisations of the regions for a satellite's first plan; later ones start from the plan before."""

_MOST_INTERVALS = 1000
"""Largest number of intervals of a horizon."""


@dataclass(frozen=True)
class PlanMemory:
    """Memory of the law.

    Attributes:
        commands: acceleration over each interval of the plan, LVLH, m/s^2, shape (..., N, 3).
        begin: step at which the plan begins, shape (...).
        due: step from which a new plan is wanted, shape (...).
        planned: 1 if there has been a plan, shape (...).
        unsolved: plans so far that the solver did not finish within its iterations, shape (...).
    """

    commands: Array
    begin: Indices
    due: Indices
    planned: Indices
    unsolved: Indices


@dataclass(frozen=True)
class ModelPredictive:
    """The law.

    Attributes:
        model: of the relative motion, by which it is predicted.
        tolerance: largest error of position (m) and velocity (m/s) per axis, shape (..., 6).
        limit: largest acceleration, per axis, m/s^2, shape (..., 3).
        arrival_time: simulated time from which the tolerance holds, s, shape (...).
        keep_out: regions to stay out of.
        interval_steps: control steps of an interval.
        intervals: of a plan.
        iterations: largest number for a plan.
    """

    model: RelativeMotionModel
    tolerance: Array
    limit: Array
    arrival_time: Array
    keep_out: KeepOut
    interval_steps: int
    intervals: int
    iterations: int

    def start(self, motion: Motion) -> PlanMemory:
        """A plan without thrust, to be replaced at once.

        Args:
            motion: position and velocity at the first step, LVLH.
        """
        shape = motion.position.shape[:-1]
        return PlanMemory(
            commands=np.zeros((*shape, self.intervals, 3)),
            begin=np.zeros(shape, dtype=np.int64),
            due=np.zeros(shape, dtype=np.int64),
            planned=np.zeros(shape, dtype=np.int64),
            unsolved=np.zeros(shape, dtype=np.int64),
        )

    def resume(self, memory: PlanMemory, gap: Gap) -> PlanMemory:
        """The plan is kept; what it has for the steps of the gap is not made up for before the next plan."""
        return memory

    def act(self, motion: Motion, reference: Reference, memory: PlanMemory, step: ControlStep) -> Action:
        """The plan's command at this step; the plan is renewed when it is due.

        A plan that the solver has not finished within its iterations is counted, and the plan before is
        flown on; after its last interval nothing is commanded.

        Args:
            motion: measured or estimated position and velocity, LVLH.
            reference: desired position, velocity and acceleration, LVLH.
            memory: the plan so far.
            step: whose number says which interval of the plan it is.

        Returns:
            Commanded acceleration and the plan; the sliding variable is zero.
        """
        if memory.commands.shape[-2] != self.intervals:
            # The horizon or the interval was changed in flight: the plan has no place in the new intervals.
            memory = replace(self.start(motion), unsolved=memory.unsolved)
        if np.any(memory.due <= step.number):
            memory = self._renewed(motion, reference, memory, step)
        interval = (step.number - memory.begin) // self.interval_steps
        within = np.minimum(interval, self.intervals - 1)[..., None, None]
        planned = np.take_along_axis(memory.commands, within, axis=-2)[..., 0, :]
        acceleration = np.where((interval < self.intervals)[..., None], planned, 0.0)
        return Action(acceleration, np.zeros_like(acceleration), memory)

    def _renewed(
        self, motion: Motion, reference: Reference, memory: PlanMemory, step: ControlStep
    ) -> PlanMemory:
        """The memory with a new plan for each satellite whose plan is due."""
        commands, unsolved = memory.commands.copy(), np.array(memory.unsolved)
        begin, due, planned = np.array(memory.begin), np.array(memory.due), np.array(memory.planned)
        for where in np.ndindex(begin.shape):
            if due[where] > step.number:
                continue
            single = _single((self, motion, reference, memory), where)
            law, own_motion, own_reference, own_memory = single
            plan = law.plan(own_motion, own_reference, own_memory, step)
            due[where] = step.number + self.interval_steps
            if plan is None:
                unsolved[where] += 1
                continue
            commands[where], begin[where], planned[where] = plan.commands, step.number, 1
        return PlanMemory(commands, begin, due, planned, unsolved)

    def unsolved_plans(self, memory: PlanMemory) -> Indices:
        """Plans so far that were not finished, as in `MakesPlans`, shape (...)."""
        return memory.unsolved

    def failures(self, memory: PlanMemory) -> dict[str, int]:
        """What has failed so far, as in `ReportsFailures`: plans of one satellite that were not finished."""
        return {"plans not solved": int(memory.unsolved)}

    def plan(
        self, motion: Motion, reference: Reference, memory: PlanMemory, step: ControlStep
    ) -> FuelPlan | None:
        """The plan that one satellite makes at a step.

        Args:
            motion: its position and velocity, LVLH, shape (3,) each.
            reference: desired motion, LVLH.
            memory: the plan before, along which regions are linearised.
            step: in which it is made.

        Returns:
            The plan; None if the solver has not finished it within its iterations.
        """
        problem = self._problem(motion, reference, step)
        times = self._times(step)
        if not len(self.keep_out.radius):
            return solve(problem, self.iterations)
        if int(memory.planned):
            elapsed = (step.number - int(memory.begin)) // self.interval_steps
            commands = np.zeros((self.intervals, 3))
            left = memory.commands[elapsed:]
            commands[: len(left)] = left
            return solve(self._linearised(problem, times, problem.propagated(commands)), self.iterations)
        return self._first(problem, times, motion)

    def _first(self, problem: FuelProblem, times: Array, motion: Motion) -> FuelPlan | None:
        """A satellite's first plan, whose half-spaces begin without a plan before.

        Normals that turn from the start's direction to the goal's lead around what lies between both. Where
        the plan that knows no region goes round a centre more than once, they would have the satellite hover
        on one side: the half-spaces along that plan go round with it, and the cheaper of both is taken.
        """
        turned = np.arange(1, self.intervals + 1) / min(self.intervals, problem.first_bound + 1)
        normals = self.keep_out.turning(motion.position, problem.reference[:, :3], np.minimum(1.0, turned))
        turning = solve(self._with_regions(problem, normals, np.zeros(normals.shape[:2])), self.iterations)
        around = self._improved(problem, times, turning)
        free = solve(problem, self.iterations)
        if free is None or self.keep_out.swept(free.states[:, :3]) <= math.tau:
            return around
        along = self._improved(problem, times, self._again(problem, times, free))
        if around is None or along is None:
            return along or around
        return along if along.cost < around.cost else around

    def _improved(self, problem: FuelProblem, times: Array, plan: FuelPlan | None) -> FuelPlan | None:
        """A first plan after all its passes; the last one that was solved."""
        for _ in range(_FIRST_PASSES - 1):
            plan = self._again(problem, times, plan) or plan
        return plan

    def _again(self, problem: FuelProblem, times: Array, plan: FuelPlan | None) -> FuelPlan | None:
        """The plan with half-spaces along another one; None if either was not solved."""
        if plan is None:
            return None
        return solve(self._linearised(problem, times, plan.states), self.iterations)

    def _problem(self, motion: Motion, reference: Reference, step: ControlStep) -> FuelProblem:
        """What the plan has to do, without regions."""
        interval = self.interval_steps * step.length
        times = self._times(step)
        transitions = self.model.transition(times[:-1], times[1:])
        inputs = input_matrix(self.model, times[:-1], times[1:])
        until = (float(self.arrival_time) - step.time) / interval
        problem = FuelProblem(
            state=np.concatenate((reference.position, reference.velocity)),
            transitions=transitions,
            inputs=inputs,
            interval=interval,
            reference=np.zeros((self.intervals, 6)),
            tolerance=self.tolerance,
            first_bound=min(self.intervals, max(0, math.ceil(until - 1e-9) - 1)),
            limit=self.limit,
            normals=np.zeros((self.intervals, 0, 3)),
            offsets=np.zeros((self.intervals, 0)),
        )
        # The reference moves on as under the command that holds it now.
        holding = np.broadcast_to(self._holding(reference, step), (self.intervals, 3))
        desired = problem.propagated(holding)
        return replace(problem, state=np.concatenate((motion.position, motion.velocity)), reference=desired)

    def _times(self, step: ControlStep) -> Array:
        """Ends of the intervals of a plan, and its begin in front, s, shape (N + 1,)."""
        return np.asarray(step.time + self.interval_steps * step.length * np.arange(self.intervals + 1.0))

    def _holding(self, reference: Reference, step: ControlStep) -> Array:
        """The command that holds the reference in the middle of the step."""
        half = 0.5 * step.length
        middle = reference.position + half * (reference.velocity + (0.5 * half) * reference.acceleration)
        moving = reference.velocity + half * reference.acceleration
        free = self._natural(step.time + half, np.concatenate((middle, moving)))
        holding: Array = reference.acceleration - free
        return holding

    def _natural(self, time: float | Array, states: Array) -> Array:
        """Acceleration of free motion in states of shape (..., 6) at times of shape (...), shape (..., 3)."""
        return multiply(self.model.system_matrix(time)[..., 3:, :], states)

    def _linearised(self, problem: FuelProblem, times: Array, states: Array) -> FuelProblem:
        """The problem with the regions' half-spaces along a motion: N + 1 times, states at the last N."""
        motion = np.concatenate((problem.state[None], states))
        normals = self.keep_out.along(motion[:, :3])
        natural = self._natural(times, motion)
        across = np.abs(dot(normals, natural[:-1, None, :])), np.abs(dot(normals, natural[1:, None, :]))
        return self._with_regions(problem, normals, np.maximum(*across))

    def _with_regions(self, problem: FuelProblem, normals: Array, natural: Array) -> FuelProblem:
        """The problem with half-spaces, further out by the sag of a motion below its chord.

        Args:
            problem: without regions.
            normals: of each interval, shape (N, K, 3).
            natural: magnitude of the free acceleration along them, m/s^2, shape (N, K).
        """
        acceleration = dot(np.abs(normals), self.limit) + natural
        offsets = self.keep_out.offsets(normals, acceleration * (0.125 * problem.interval * problem.interval))
        return replace(problem, normals=normals, offsets=offsets)


def _single(
    stacked: tuple[ModelPredictive, Motion, Reference, PlanMemory], where: tuple[int, ...]
) -> tuple[ModelPredictive, Motion, Reference, PlanMemory]:
    """What one satellite has of law, motion, reference and memory."""
    for row in where:
        stacked = stacking.item(stacked, row)
    return stacked


def _model(name: ModelName, setting: FlightSetting) -> RelativeMotionModel:
    """The model of a name; about a circular chief both are the same."""
    if name == "cw" or setting.chief is None:
        return CwModel(setting.mean_motion)
    return relative_motion_model(name, setting.chief)


class ModelPredictiveSpec(ControllerSpec):
    """Model-predictive control: the least fuel within limits, an error box and regions to avoid.

    The plan is for intervals over which a command is held, and is renewed after each. It needs the optional
    dependency `satform[mpc]`.
    """

    makes_plans: ClassVar[bool] = True

    kind: Literal["model_predictive"] = "model_predictive"
    model: Literal["cw", "yamanaka_ankersen"] = "cw"
    """Relative motion by which is predicted: cw, or yamanaka_ankersen about an eccentric chief."""
    horizon: Positive = 6000.0
    """How far a plan reaches, s; rounded to intervals."""
    interval: Positive = 60.0
    """How long a command of the plan is held, and time between plans, s; rounded to steps."""
    arrival_time: NonNegative = 0.0
    """Simulated time from which the error has to be within the tolerances, s."""
    position_tolerance: PositivePerAxis = (1.0, 1.0, 1.0)
    """Half the side of the error box, per axis, m."""
    velocity_tolerance: PositivePerAxis | None = None
    """Likewise of the velocity, per axis, m/s; by default the position's times twice the mean motion."""
    maximum_acceleration: PositivePerAxis = (1e-3, 1e-3, 1e-3)
    """Largest command, per axis, m/s^2."""
    keep_out: Annotated[tuple[KeepOutSpec, ...], Field(max_length=16)] = ()
    """Regions in which no position may be."""
    iterations: Annotated[int, Field(ge=1, le=1000)] = 100
    """Most iterations of the solver for a plan; without a solution the plan before is flown on."""

    def assumes_circular_chief(self) -> bool:
        """Whether the model that predicts is about a circular chief."""
        return self.model == "cw"

    def linearisation(self, setting: FlightSetting) -> str:
        """The loop is not linear."""
        return "whose command is the solution of a linear program"

    def build(self, setting: FlightSetting) -> ModelPredictive:
        """The law.

        Raises:
            ValueError: the solver is not installed, or the horizon has less than two or too many intervals.
        """
        if find_spec("clarabel") is None:
            raise ValueError("model_predictive needs the package clarabel; install satform[mpc]")
        steps = max(1, round(self.interval / setting.step))
        interval = steps * setting.step
        intervals = round(self.horizon / interval)
        if not 2 <= intervals <= _MOST_INTERVALS:
            raise ValueError(
                f"model_predictive: a horizon of {self.horizon:g} s is {intervals} intervals of {interval:g} "
                f"s; 2 to {_MOST_INTERVALS} are allowed"
            )
        slow = tuple(2.0 * setting.mean_motion * side for side in self.position_tolerance)
        return ModelPredictive(
            model=_model(self.model, setting),
            tolerance=np.array([*self.position_tolerance, *(self.velocity_tolerance or slow)]),
            limit=np.array(self.maximum_acceleration),
            arrival_time=np.asarray(self.arrival_time, dtype=np.float64),
            keep_out=keep_out_of(self.keep_out),
            interval_steps=steps,
            intervals=intervals,
            iterations=self.iterations,
        )
