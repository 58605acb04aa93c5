# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flight loop of the recorder: waits for all topics, records to the end of the flight, and closes the bag."""

import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path

from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_LOST
from satform.files.durable_file import reason_text
from satform.record.early_end import EarlyEnd
from satform_nodes.recorder.node import RecorderNode
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.lifecycle import (
    discovery_timeout,
    exit_code_of,
    plant_timeout,
    run,
    scenario_and_plan,
)
from satform_nodes.runtime.parameters import declare_rate, declare_start
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError

_LATE = 2.0
"""Wall-clock time without a message after which those that are missing at the end count as lost, s."""

_LAST_MESSAGES = 0.1
"""Wall-clock time after the end of the flight in which messages are still recorded, s."""


def fly(node: FormationNode, executor: StepExecutor, stop: StopRequest, report: SupervisorPipe) -> int:
    """Record from the first step to the end of the flight, and close the bag."""
    declare_start(node, "scenario")
    declare_start(node, "groups")
    folder = declare_start(node, "bag")
    clocked = declare_rate(node) > 0.0
    scenario, plan = scenario_and_plan(node)
    if not folder:
        raise NodeError(
            "recorder needs the parameter bag: the folder of the bag to be written", EXIT_BAD_INPUT
        )
    recorder = RecorderNode(node, executor, scenario, plan, Path(folder), report, clocked)
    steps = recorder.steps
    try:
        first = discovery_timeout(recorder.plan)
        _record(recorder, executor, stop, first, max(first, plant_timeout(scenario.node_timeout)))
    except OSError as error:
        step = max(0, steps.recorded_step)
        reason = reason_text(error, Path(folder))
        sentence = f"{folder}: the bag cannot be written after step {step}: {reason}"
        raise NodeError(sentence, EXIT_LOST) from None
    finally:
        ended = steps.ended
        end = None if ended is None else EarlyEnd.of_message(ended, scenario.timing.step)
        if ended is not None and ended.phase == FormationStatus.ABORTED:
            recorder.report.send("aborted", reason=ended.reason)
        if end is not None:
            # On a host without the plant no other process can report it.
            recorder.report.send("end_received", end=end.data())
        recorder.report.send(
            "recorded",
            messages=recorder.bag.messages,
            complete=steps.complete,
            missed=steps.missing()[:20],
        )
        node.get_logger().info(recorder.summary())
    return exit_code_of(stop, steps.ended)


def _record(
    recorder: RecorderNode, executor: StepExecutor, stop: StopRequest, first: float, longest: float
) -> None:
    """Write until the flight is over or a stop is asked for; the bag is closed in any case.

    Args:
        recorder: to write with.
        executor: hands out the messages.
        stop: ends the recording.
        first: wall-clock time within which all topics have to be found, s.
        longest: wall-clock time without a message after which the plant counts as lost, s.
    """
    steps = recorder.steps
    try:
        if not executor.spin_until(lambda: recorder.matched() or steps.ended or stop.asked, first):
            raise NodeError(f"the recorder has not found all topics within {first:g} s", EXIT_LOST)
        recorder.publish_ready()
        recorder.report.send("ready", node="recorder")
        recorder.node.get_logger().info(f"recording into {recorder.folder}")
        over = executor.spin_polling(lambda: steps.ended is None and not stop.asked, longest, stop.pause)
        if not over:
            sentence = f"nothing to record for {longest:g} s: no message from the plant"
            recorder.report.send("lost", who=["plant"], step=steps.recorded_step, reason=sentence)
            raise NodeError(sentence, EXIT_LOST)
        # Messages of the last steps may still arrive, or be retransmitted.
        executor.spin_while(lambda: steps.lacks_messages() and not stop.asked, _LATE)
        # So may messages of topics that are polled in the background.
        executor.spin_until(lambda: stop.asked, _LAST_MESSAGES)
    finally:
        recorder.bag.close()


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Record a flight; entry point of the executable `recorder_node`."""
    return run("recorder", fly, arguments, SupervisorPipe(pipe))


if __name__ == "__main__":
    sys.exit(main())
