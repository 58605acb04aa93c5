# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Outcome of a goal of the action for new targets when the flight ends, without a graph."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from satform_msgs.action import Reconfigure

from flights import shortened
from satform.flight.compile import compile_scenario
from satform.membership.formation import Formation
from satform.membership.reconfiguration import TargetsChanged
from satform_nodes.plant import reconfiguration

STEP = 5
"""Present step of the plant."""


@pytest.mark.parametrize("cancelled", [False, True])
def test_the_result_at_the_end_of_a_flight_names_a_step_that_was_taken(
    monkeypatch: pytest.MonkeyPatch, cancelled: bool
) -> None:
    entries: dict[str, Any] = {}

    def action_server(_node: Any, _kind: Any, _name: str, execute: Any, **_other: Any) -> None:
        entries["execute"] = execute

    monkeypatch.setattr(reconfiguration, "ActionServer", action_server)
    executor = SimpleNamespace(
        add_periodic=lambda report: entries.update(report=report),
        spin_until=lambda condition, timeout: False,
        wake=lambda: None,
    )
    plan = compile_scenario(shortened("reconfiguration", 100.0))
    count = len(plan.names)
    position = np.zeros((count, 3))
    membership = SimpleNamespace(formation=Formation.of(plan.membership), next_targets={})

    def schedule(event: TargetsChanged) -> int:
        membership.next_targets = event.applied(membership.next_targets, STEP + 1)
        return STEP + 1

    control = SimpleNamespace(
        plan=plan,
        names=list(plan.names),
        flying=True,
        last_step_taken=False,
        membership=membership,
        plant=SimpleNamespace(step=STEP, motion=lambda: SimpleNamespace(position=position), applied=position),
        phase=lambda satellite: 0.0,
        schedule_event=schedule,
    )
    server = reconfiguration.ReconfigurationServer(SimpleNamespace(), control, executor)
    request = Reconfigure.Goal(satellites=["ahead"], targets=["{phase_offset: 9.0}"], tolerance=1.0)
    outcomes: list[str] = []
    handle = SimpleNamespace(
        request=request,
        is_cancel_requested=cancelled,
        publish_feedback=lambda feedback: None,
        abort=lambda: outcomes.append("abort"),
    )
    running = entries["execute"](handle)
    running.send(None)
    entries["report"]()
    server.end("asked to stop")
    with pytest.raises(StopIteration) as ended:
        running.send(None)
    result = ended.value.value
    assert outcomes == ["abort"]
    assert result.step == STEP
    start = "cancelled, and the former targets not back" if cancelled else "not reached"
    assert result.message == f"{start} before the flight ended: asked to stop"
