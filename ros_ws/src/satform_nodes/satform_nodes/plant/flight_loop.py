# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flight loop of the plant: waits for all nodes, detects lost nodes by timeout, and ends the flight.

Before the first step it waits until every node has published on `/formation/node_ready` and all endpoints are
matched (`transport.matched_endpoints`). A lost satellite is removed by
`satform.membership.membership_manager`.
"""

import sys
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

from satform.common.exit_codes import EXIT_DONE, EXIT_ENDED_EARLY, EXIT_LOST, EXIT_STOPPED
from satform.flight.compile import FormationPlan
from satform.protocol.formation_view import STOPPED
from satform.protocol.status import FormationPhase
from satform.record.early_end import EarlyEnd
from satform_nodes.plant.node import PlantNode, PlantSettings
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import plan_of, run
from satform_nodes.runtime.parameters import declare_rate, declare_start
from satform_nodes.runtime.realtime_loop import processor_seconds, run_realtime
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError


def fly(node: FormationNode, executor: StepExecutor, stop: StopRequest, report: SupervisorPipe) -> int:
    """Wait for all nodes, fly the scenario to its end, and report the result."""
    declare_start(node, "scenario")
    declare_start(node, "groups")
    settings = PlantSettings(
        recorded=declare_start(node, "recorded"),
        recorder_needed=declare_start(node, "recorder_needed"),
        rate=declare_rate(node),
    )
    plan = plan_of(node)
    plant = PlantNode(node, executor, plan, settings, report)
    steps = plant.steps
    if not executor.spin_until(lambda: plant.all_ready() or steps.over or stop.asked, plant.start_timeout):
        return _abort(plant, *plant.not_ready())
    if steps.aborted:
        return _abort(plant, *steps.aborted)
    begin = time.perf_counter()
    plant.report.send("flying")
    node.get_logger().info(f"flying {_description(plan, settings.rate)}")
    if not (stop.asked or steps.stop_asked):
        plant.begin()
    timing: dict[str, Any] = {}
    if plant.clocked:
        kept = run_realtime(plant, executor, stop, plan.timing.step / settings.rate)
        timing = {
            **kept.data(),
            "processor": processor_seconds(),
            **plant.subscriptions.command_monitor.data(plant.names),
        }
    _fly_on(plant, executor, stop)
    if steps.early_end:
        return _end_early(plant, steps.early_end)
    if steps.aborted:
        return _abort(plant, *steps.aborted)
    if stop.asked or steps.stop_asked:
        plant.report.send("stopped", step=steps.plant.step)
        node.get_logger().info(f"stopped at step {steps.plant.step}")
        plant.publish_status(FormationPhase.ABORTED, STOPPED)
        return EXIT_STOPPED
    _finish(plant, time.perf_counter() - begin, timing)
    return EXIT_DONE


def _finish(plant: PlantNode, seconds: float, timing: dict[str, Any]) -> None:
    """Report and publish that the last step has been taken.

    Args:
        plant: node of the plant.
        seconds: wall-clock time of the flight.
        timing: figures of a flight on the wall clock.
    """
    step = plant.steps.plant.step
    plant.report.send(
        "finished",
        step=step,
        seconds=seconds,
        busy=plant.steps.busy_seconds,
        refused=plant.rejections.sentences(),
        timing=timing,
    )
    plant.node.get_logger().info(
        f"finished: {step} steps, {step * plant.plan.timing.step:g} s, in {seconds:.2f} s "
        f"({step / max(seconds, 1e-9):.0f} steps/s)"
    )
    plant.publish_status(FormationPhase.FINISHED, "")


def _description(plan: FormationPlan, rate: float) -> str:
    """What is flown, and how time passes."""
    manner = f"{rate:g} simulated seconds in each second" if rate else "in lockstep"
    timing = plan.timing
    return f"{plan.name}: {len(plan.names)} satellites, {timing.steps} steps of {timing.step:g} s, {manner}"


def _fly_on(plant: PlantNode, executor: StepExecutor, stop: StopRequest) -> None:
    """Take steps until the flight is over; a node that does not answer within its timeout is lost."""
    steps, timeout = plant.steps, plant.plan.timing.node_timeout
    while not executor.spin_while(
        lambda: not (steps.over or stop.asked), timeout, plant.retransmit, plant.progress
    ):
        plant.end_waiting()


def _end_early(plant: PlantNode, end: EarlyEnd) -> int:
    """Publish that a quantity was not finite or beyond its limit, and that the flight ends."""
    plant.report.send("ended_early", step=plant.steps.flown_steps, end=end.data())
    plant.publish_status(FormationPhase.ABORTED, end.sentence)
    raise NodeError(f"the flight ended early: {end.sentence}", EXIT_ENDED_EARLY)


def _abort(plant: PlantNode, who: list[str], reason: str) -> int:
    step = plant.steps.plant.step
    sentence = f"lost at step {step}: {reason}" if plant.steps.flying else reason
    plant.report.send("lost", who=who, step=step, reason=sentence)
    plant.publish_status(FormationPhase.ABORTED, sentence)
    raise NodeError(sentence, EXIT_LOST)


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Run the plant; entry point of the executable `plant_node`."""
    return run("plant", fly, arguments, SupervisorPipe(pipe))


if __name__ == "__main__":
    sys.exit(main())
