# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C in `satform reconfigure`: what is said of the cancel, without a graph."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from satform_msgs.msg import FormationStatus

from satform_tools.errors import CommandError
from satform_tools.inspect import reconfigure
from satform_tools.inspect.reconfigure import Arrival

ACCEPTED = CancelGoal.Response(goals_canceling=[GoalInfo()])
REJECTED = CancelGoal.Response(return_code=CancelGoal.Response.ERROR_REJECTED)


class Interrupted:
    """An observer whose second wait is interrupted by Ctrl-C; other waits end at once."""

    timeout = 5.0
    node = None

    def __init__(self, phase: int, plant: bool) -> None:
        self._phase, self._plant = phase, plant
        self._waits = 0

    def find_formation(self) -> None:
        pass

    def full_name(self, topic: str) -> str:
        return topic

    def plant_exists(self) -> bool:
        return self._plant

    def latest_status(self) -> FormationStatus:
        return FormationStatus(phase=self._phase)

    def wait(self, condition: Callable[[], bool], seconds: float) -> bool:
        if seconds == reconfigure._FOREVER:
            raise KeyboardInterrupt
        return condition()


def future(result: Any) -> SimpleNamespace:
    return SimpleNamespace(done=lambda: result is not None, result=lambda: result)


@pytest.mark.parametrize(
    ("reply", "phase", "plant", "sentence"),
    [
        (ACCEPTED, FormationStatus.PAUSED, True, "cancel requested; the flight is paused"),
        (ACCEPTED, FormationStatus.FLYING, True, "cancel requested; the goal has not ended within 5 s"),
        (REJECTED, FormationStatus.FLYING, True, "rejects the cancel request: the goal cannot be cancelled"),
        (None, FormationStatus.FLYING, True, "cancel requested; the action does not reply within 5 s"),
        (ACCEPTED, FormationStatus.FLYING, False, "the flight ended before the goal did"),
    ],
)
def test_what_becomes_of_a_cancel_is_said(
    monkeypatch: pytest.MonkeyPatch, reply: Any, phase: int, plant: bool, sentence: str
) -> None:
    handle = SimpleNamespace(
        accepted=True,
        get_result_async=lambda: future(None),
        cancel_goal_async=lambda: future(reply),
    )
    client = SimpleNamespace(
        server_is_ready=lambda: True,
        destroy=lambda: None,
        send_goal_async=lambda goal, feedback_callback: future(handle),
    )
    monkeypatch.setattr(reconfigure, "ActionClient", lambda *_: client)
    observer: Any = Interrupted(phase, plant)
    with pytest.raises(CommandError) as refused:
        reconfigure.reconfigure(observer, ["sat1={scale: 2.0}"], Arrival(1.0, 0.0, 0.0), as_json=True)
    assert sentence in str(refused.value)
