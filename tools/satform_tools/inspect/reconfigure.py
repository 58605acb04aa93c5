# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Gives satellites of a running formation new targets, with progress; Ctrl-C gives the former ones back."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from satform_msgs.action import Reconfigure
from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_MISSED
from satform_nodes.plant.reconfiguration import RECONFIGURE
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.inspect.observer_node import Observer

_LAST_RESULT = 1.0
"""Wall-clock time for which a result is waited for after the plant has ended, s."""

_FOREVER = 1e9
"""Wall-clock time for which a goal may last, s."""


@dataclass(frozen=True)
class Arrival:
    """When a reconfiguration counts as done.

    Attributes:
        tolerance: distance from the target within which a satellite has reached it, m.
        hold: simulated time for which all have to stay within the tolerance, s.
        within: simulated time after which the goal is aborted, s; 0 for none.
    """

    tolerance: float
    hold: float
    within: float


def reconfigure(observer: Observer, targets: Sequence[str], arrival: Arrival, *, as_json: bool) -> int:
    """Send a goal, print its progress, and return the exit code.

    Args:
        observer: in the formation's domain.
        targets: each `SATELLITE={curve: ...}`.
        arrival: when they count as reached.
        as_json: print JSON.

    Raises:
        CommandError: the formation has no such action, a target is of another form, or no answer arrives.
    """
    pairs = [_pair(text) for text in targets]
    observer.find_formation()
    goal = Reconfigure.Goal(
        satellites=[name for name, _ in pairs],
        targets=[text for _, text in pairs],
        tolerance=arrival.tolerance,
        hold=arrival.hold,
        timeout=arrival.within,
    )
    name = observer.full_name(RECONFIGURE)
    client = ActionClient(observer.node, Reconfigure, name)
    try:
        if not observer.wait(client.server_is_ready, observer.timeout):
            raise CommandError(f"the action {name} is not there within {observer.timeout:g} s")
        result = _followed(observer, client, goal, quiet=as_json)
    finally:
        client.destroy()
    return _printed(result, goal.satellites, as_json=as_json)


def _pair(text: str) -> tuple[str, str]:
    """Name of a satellite and its target."""
    name, separator, target = text.partition("=")
    if not separator or not name or not target:
        raise CommandError(f"found {text!r}; a target is written SATELLITE={{curve: ...}}")
    return name, target


def _followed(observer: Observer, client: Any, goal: Any, *, quiet: bool) -> Any:
    """The end of a goal; Ctrl-C cancels it."""
    shown = [-1]

    def show(message: Any) -> None:
        feedback = message.feedback
        if quiet or feedback.step == shown[0]:
            return
        shown[0] = feedback.step
        known = [own for own in feedback.distance if not math.isnan(own)]
        largest = f"{max(known):.4g} m from the target" if known else "not begun"
        done = f"{100.0 * feedback.fraction:.0f} %"
        console.line(f"step {feedback.step}, changed at step {feedback.since}: {done}, {largest}")

    sent = client.send_goal_async(goal, feedback_callback=show)
    if not observer.wait(sent.done, observer.timeout):
        raise CommandError(f"the action does not reply within {observer.timeout:g} s")
    handle = sent.result()
    if not handle.accepted:
        raise CommandError("the plant rejects the goal without a reason")
    ended = handle.get_result_async()
    try:
        observer.wait(lambda: ended.done() or not observer.plant_exists(), _FOREVER)
    except KeyboardInterrupt:
        _cancel(observer, handle, ended)
    # The result may still be on its way when the plant is gone.
    if not observer.wait(ended.done, _LAST_RESULT):
        raise CommandError("the flight ended before the goal did")
    return ended.result()


def _cancel(observer: Observer, handle: Any, ended: Any) -> None:
    """Cancel a goal and wait for its end, or for that of the plant.

    Args:
        observer: in the formation's domain.
        handle: of the goal.
        ended: future of its result.

    Raises:
        CommandError: the plant rejects the request or does not reply, or the goal goes on.
    """
    reply = handle.cancel_goal_async()
    observer.wait(lambda: reply.done() or ended.done() or not observer.plant_exists(), observer.timeout)
    if ended.done() or not observer.plant_exists():
        return
    if not reply.done():
        raise CommandError(f"cancel requested; the action does not reply within {observer.timeout:g} s")
    answer = reply.result()
    if not answer.goals_canceling:
        # A goal that has just ended cannot be cancelled; its result follows.
        if observer.wait(ended.done, _LAST_RESULT):
            return
        reason = _REJECTIONS.get(answer.return_code, f"return code {answer.return_code}")
        raise CommandError(f"the plant rejects the cancel request: {reason}")
    observer.wait(lambda: ended.done() or not observer.plant_exists(), observer.timeout)
    if ended.done() or not observer.plant_exists():
        return
    if observer.latest_status().phase == FormationStatus.PAUSED:
        raise CommandError(
            "cancel requested; the flight is paused: the former targets come back with its next step"
        )
    raise CommandError(f"cancel requested; the goal has not ended within {observer.timeout:g} s")


_REJECTIONS = {
    CancelGoal.Response.ERROR_REJECTED: "the goal cannot be cancelled now",
    CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID: "it does not know the goal",
    CancelGoal.Response.ERROR_GOAL_TERMINATED: "the goal has already ended",
}
"""What the return code of a rejected cancel request means."""

_OUTCOMES = {
    GoalStatus.STATUS_SUCCEEDED: ("reached", EXIT_DONE),
    GoalStatus.STATUS_CANCELED: ("cancelled", EXIT_MISSED),
    GoalStatus.STATUS_ABORTED: ("aborted", EXIT_MISSED),
}
"""What the status of a goal means, and the exit code."""


def _printed(answer: Any, satellites: Sequence[str], *, as_json: bool) -> int:
    outcome, code = _OUTCOMES.get(answer.status, ("unknown", EXIT_MISSED))
    result = answer.result
    rejected = outcome == "aborted" and not len(result.delta_v)
    if as_json:
        spent = dict(zip(satellites, [float(own) for own in result.delta_v], strict=False))
        console.as_json(
            {
                "outcome": "rejected" if rejected else outcome,
                "step": int(result.step),
                "delta_v": spent,
                "message": result.message,
            }
        )
    elif rejected:
        console.error(result.message)
    else:
        spent_text = ", ".join(
            f"{name} {own:.4g} m/s" for name, own in zip(satellites, result.delta_v, strict=False)
        )
        console.line(f"{result.message}; delta-v {spent_text}")
    return EXIT_BAD_INPUT if rejected else code
