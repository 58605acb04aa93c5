# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The action `/formation/reconfigure`: new targets of satellites, with progress and cancel.

The plant decides at which step the formation changes, so the action server is in its node.
"""

import math
import time
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from satform_msgs.action import Reconfigure

from satform.common.name_list import listed
from satform.communication.topic_table import relative
from satform.flight.compile import FormationPlan
from satform.flight.plant import Plant
from satform.flight.reconfiguration_progress import Arrival, ReconfigurationProgress
from satform.flight.requested_targets import requested_targets
from satform.membership.formation import Event
from satform.membership.membership_manager import MembershipManager
from satform.membership.reconfiguration import TargetsChanged, TargetSpec, present_targets
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.transport.executor import StepExecutor

RECONFIGURE = "/formation/reconfigure"

_FEEDBACK_PERIOD = 0.2
"""Wall-clock time between two feedback messages, s."""

_RESULT_RETENTION = 30
"""Wall-clock time for which the result of an ended goal is stored, s."""

_POLLS_TO_SEND = 10
"""Background polls of the executor in which an outcome becomes a result that is sent."""

_RESULT_TIMEOUT = 2.0
"""Wall-clock time for which the end of a flight waits for the result of a goal to be sent, s."""


class ReconfigurationControl(Protocol):
    """What the action needs of the plant's node."""

    plan: FormationPlan
    names: list[str]
    flying: bool
    membership: MembershipManager
    plant: Plant

    @property
    def last_step_taken(self) -> bool:
        """Whether no step follows in which something could take effect."""

    def phase(self, satellite: int) -> float | None:
        """What a satellite has announced as its phase for the present step, m; None if nothing."""

    def schedule_event(self, event: Event) -> int:
        """Schedule an event for the next step; returns the step."""


@dataclass
class _Goal:
    """A goal that is followed.

    Attributes:
        handle: of rclpy.
        progress: of its satellites.
        before: their targets before the change.
        ended: gets the outcome: `succeed`, `abort` or `canceled`, its step and a sentence.
        back_at: after a cancel the first step with the former targets.
    """

    handle: ServerGoalHandle
    progress: ReconfigurationProgress
    before: dict[int, TargetSpec]
    ended: Future
    back_at: int | None = None


class ReconfigurationServer:
    """Follows one goal at a time."""

    def __init__(self, node: FormationNode, control: ReconfigurationControl, executor: StepExecutor) -> None:
        """No goal yet.

        Args:
            node: of the plant.
            control: decides at which step a change takes effect.
            executor: of the node.
        """
        self._control = control
        self._executor = executor
        self._node = node
        self._goal: _Goal | None = None
        self._next_feedback = 0.0
        self._polls = 0
        self._server = ActionServer(
            node,
            Reconfigure,
            relative(RECONFIGURE),
            self._execute,
            cancel_callback=self._on_cancel,
            result_timeout=_RESULT_RETENTION,
        )
        executor.add_periodic(self._report)

    # By the executor

    async def _execute(self, handle: ServerGoalHandle) -> Any:
        """Take up a goal, wait for its end, and fill its result."""
        try:
            goal = self._taken_up(handle)
        except ValueError as error:
            self._polls = _POLLS_TO_SEND
            handle.abort()
            return Reconfigure.Result(step=self._control.plant.step, message=str(error))
        self._goal = goal
        outcome, step, sentence = await goal.ended
        self._goal = None
        getattr(handle, outcome)()
        return Reconfigure.Result(
            step=step,
            delta_v=goal.progress.delta_v.tolist(),
            message=sentence,
        )

    def _on_cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        goal = self._goal
        followed = goal is not None and goal.handle is handle and not goal.ended.done()
        return CancelResponse.ACCEPT if followed else CancelResponse.REJECT

    def _taken_up(self, handle: ServerGoalHandle) -> _Goal:
        """Schedule the change of a goal.

        Raises:
            ValueError: it cannot be flown, with the sentence why not.
        """
        control, request = self._control, handle.request
        if control.plan.groups is not None:
            raise ValueError(
                "groups that exchange arrays keep their targets; fly without --arrays to set them"
            )
        if self._goal is not None:
            raise ValueError("another reconfiguration is under way: cancel it first")
        if not control.flying:
            raise ValueError("the flight has not begun")
        if control.last_step_taken:
            raise ValueError("the last step has been taken")
        arrival = _arrival(request, control.plan.timing.step)
        present = control.membership.next_targets
        plan = control.plan.reconfiguration
        targets = requested_targets(plan, request.satellites, request.targets, present)
        names = [control.names[index] for index in targets]
        event = TargetsChanged(targets, f"the targets of {listed(names)} were changed by an action")
        since = control.schedule_event(event)
        whole = event.applied(present, since)
        specs = {index: whole[index].spec for index in targets}
        progress = ReconfigurationProgress(control.plan, specs, since, arrival)
        self._look(progress)
        return _Goal(handle, progress, present_targets(present, targets), Future())

    # By the plant

    def after_step(self) -> None:
        """Take in the states of a step that has been flown; nothing without a goal."""
        goal, control = self._goal, self._control
        if goal is None or goal.ended.done():
            return
        progress = goal.progress
        self._look(progress)
        if goal.back_at is not None:
            if control.plant.step >= goal.back_at:
                self._end("canceled", f"cancelled: the former targets are back since step {goal.back_at}")
        elif progress.reached:
            self._end("succeed", f"reached at step {control.plant.step}")
        elif replaced := self._replaced(goal):
            self._end("abort", replaced)
        elif progress.timed_out:
            after = (control.plant.step - progress.since) * control.plan.timing.step
            self._end("abort", f"not reached within {after:g} s; the satellites keep the new targets")

    def _replaced(self, goal: _Goal) -> str:
        """Which satellites of a goal get another target at the next step; empty for none."""
        control, since = self._control, goal.progress.since
        targets = control.membership.next_targets
        others = [control.names[index] for index in goal.before if targets[index].since != since]
        if not others:
            return ""
        step = control.membership.next_step
        return f"not reached before {listed(others)} got another target at step {step}"

    def _look(self, progress: ReconfigurationProgress) -> None:
        """Have progress take in the states of the present step."""
        control, plant = self._control, self._control.plant
        phases = [control.phase(index) for index in progress.satellites]
        alive = control.membership.formation.alive
        progress.update(plant.step, plant.motion().position, plant.applied, phases, alive)

    def end(self, reason: str) -> None:
        """End the goal, as the flight ends; its result is sent before this returns, or not at all.

        Args:
            reason: why the flight ends.
        """
        goal = self._goal
        if goal is not None and not goal.ended.done():
            missed = "not reached" if goal.back_at is None else "cancelled, and the former targets not back"
            self._end("abort", f"{missed} before the flight ended: {reason}")
        self._executor.spin_until(lambda: not self._polls, _RESULT_TIMEOUT)

    def _end(self, outcome: str, sentence: str) -> None:
        goal = self._goal
        if goal is not None:
            self._publish_feedback(goal)
            step = self._control.plant.step
            if goal.back_at is not None:
                step = min(step, goal.back_at)
            goal.ended.set_result((outcome, step, sentence))
            self._polls = _POLLS_TO_SEND

    # Now and then

    def _report(self) -> None:
        """Have a result sent, publish feedback, and take up a cancel."""
        if self._polls:
            self._polls -= 1
            # The executor goes on with coroutines and callbacks of futures when it looks at everything.
            self._executor.wake()
        goal = self._goal
        if goal is None or goal.ended.done():
            return
        if goal.handle.is_cancel_requested and goal.back_at is None:
            self._cancel(goal)
        now = time.monotonic()
        if now >= self._next_feedback:
            self._next_feedback = now + _FEEDBACK_PERIOD
            self._publish_feedback(goal)

    def _cancel(self, goal: _Goal) -> None:
        """Schedule the targets that the satellites had before."""
        control = self._control
        if control.last_step_taken:
            self._end("canceled", "cancelled after the last step: the satellites keep the new targets")
            return
        if replaced := self._replaced(goal):
            # Former targets would undo that change.
            self._end("abort", replaced)
            return
        names = [control.names[index] for index in goal.before]
        reason = f"the former targets of {listed(names)} are back, as an action was cancelled"
        goal.back_at = control.schedule_event(TargetsChanged(goal.before, reason, whole=True))

    def _publish_feedback(self, goal: _Goal) -> None:
        progress = goal.progress
        goal.handle.publish_feedback(
            Reconfigure.Feedback(
                step=self._control.plant.step,
                since=progress.since,
                distance=progress.distance.tolist(),
                fraction=progress.fraction,
            )
        )


def _arrival(request: Any, step: float) -> Arrival:
    """When a goal counts as reached.

    Args:
        request: the goal.
        step: control period, s.

    Raises:
        ValueError: a number cannot be so.
    """
    if not (math.isfinite(request.tolerance) and request.tolerance > 0.0):
        raise ValueError(f"tolerance: found {request.tolerance:g}; it has to be a length above 0, m")
    for name in ("hold", "timeout"):
        value = getattr(request, name)
        if not 0.0 <= value <= 1e9:
            raise ValueError(f"{name}: found {value:g}; it has to be a time from 0 to 1e9 s")
    timeout = int(np.ceil(request.timeout / step)) if request.timeout > 0.0 else None
    return Arrival(request.tolerance, int(np.ceil(request.hold / step)), timeout)
