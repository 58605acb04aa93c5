# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of `satform bench`, each measured alternating with its yardstick."""

import math
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from satform.scenario import Scenario, load_scenario
from satform_tools.bench import scaling, startup
from satform_tools.bench.figures import Figure, numpy_loop, repeated
from satform_tools.bench.flight_software import step_cost
from satform_tools.run.round_trip import median_round_trip

NUMPY_LOOP = "numpy loop"
ROUND_TRIP = "round trip"

CONTROLLERS = {
    "sliding_mode": "triangle",
    "lqr": "geo_sphere_lqr",
    "distance": "directed_triangle",
    "sliding_mode with attitude": "formation_pointing",
}
"""Scenarios whose first satellite stands for its control law."""

_ROUND_TRIPS = 500


def round_trip(repetitions: int) -> list[Figure]:
    """Round trip of a bare message between two processes, against the numpy loop."""
    return [
        repeated(
            ROUND_TRIP,
            NUMPY_LOOP,
            numpy_loop,
            lambda: median_round_trip(_ROUND_TRIPS),
            repetitions,
        )
    ]


def lockstep(
    counts: Sequence[int],
    group: int,
    steps: int,
    repetitions: int,
    *,
    record: bool,
    arrays: bool = False,
    executors: Sequence[str] = (scaling.OWN,),
) -> list[Figure]:
    """A step over DDS, against bare round trips; with several executors, these alternate."""
    found = []
    for count in counts:
        runs: dict[str, list[scaling.OverDds]] = {executor: [] for executor in executors}
        for _ in range(repetitions):
            for executor, own in runs.items():
                own.append(
                    scaling.over_dds(
                        count,
                        group,
                        steps,
                        record=record,
                        arrays=arrays,
                        executor=executor,
                        round_trips=_ROUND_TRIPS,
                    )
                )
        labels = [f"lockstep, {count} satellites"]
        labels += [f"{group} to a process"] if group > 1 else []
        labels += ["arrays"] if arrays else []
        labels += ["recorded"] if record else []
        found += [
            Figure(
                ", ".join([*labels, *scaling.EXECUTORS[executor]]),
                tuple(1.0 / run.steps_per_second for run in own),
                ROUND_TRIP,
                tuple(run.round_trip for run in own),
                _details(own),
            )
            for executor, own in runs.items()
        ]
    return found


def _details(runs: Sequence[scaling.OverDds]) -> dict[str, float]:
    """Medians over repetitions of what else is known of a flight; what is not known is left out."""
    series = {
        "processes": [float(run.processes) for run in runs],
        "processor_per_step": [run.processor_per_step for run in runs],
        "start_seconds": [run.start_seconds for run in runs],
        "memory_per_process": [run.memory_per_process for run in runs],
    }
    known = {name: [value for value in values if math.isfinite(value)] for name, values in series.items()}
    return {name: statistics.median(values) for name, values in known.items() if values}


def satellite(scenarios: Path, repetitions: int) -> list[Figure]:
    """A satellite's own step under each control law, processor time against the numpy loop."""
    return [
        repeated(
            f"satellite, {law}",
            NUMPY_LOOP,
            numpy_loop,
            _step_of(load_scenario(scenarios / f"{name}.yaml")),
            repetitions,
        )
        for law, name in CONTROLLERS.items()
    ]


def in_process(counts: Sequence[int], repetitions: int) -> list[Figure]:
    """A step of a whole formation in one process, against the numpy loop."""
    return [
        repeated(
            f"in process, {count} satellites", NUMPY_LOOP, numpy_loop, _step_in_process(count), repetitions
        )
        for count in counts
    ]


def start_up(counts: Sequence[int], times: int) -> list[Figure]:
    """From the command to the first step, against the numpy loop."""
    found = []
    for count in counts:
        details: dict[str, float] = {}

        def _start(count: int = count, details: dict[str, float] = details) -> float:
            whole, processes = startup.command_to_first_step(count)
            details["processes_seconds"] = processes
            return whole

        name = f"start, {count} satellites"
        found.append(repeated(name, NUMPY_LOOP, numpy_loop, _start, times, details))
    return found


def recorder(repetitions: int, messages: int = 20_000) -> list[Figure]:
    """A message written into a bag, processor time against the numpy loop."""
    return [repeated("recorder, a message", NUMPY_LOOP, numpy_loop, lambda: _written(messages), repetitions)]


def _step_of(scenario: Scenario) -> Callable[[], float]:
    return lambda: step_cost(scenario)


def _step_in_process(count: int) -> Callable[[], float]:
    return lambda: 1.0 / scaling.in_process(count).steps_per_second


def _written(messages: int) -> float:
    """Processor time of a message, s."""
    from satform_msgs.msg import Command  # noqa: PLC0415 - needs ROS

    from satform.communication import topic_table  # noqa: PLC0415
    from satform_nodes.bag.writer import BagWriter  # noqa: PLC0415
    from satform_nodes.transport.cdr_codec import layout  # noqa: PLC0415
    from satform_nodes.transport.message_definitions import described  # noqa: PLC0415

    form = layout(Command, topic_table.FRAME)
    data = form.pack(*(0 for _ in form.fields))
    with tempfile.TemporaryDirectory() as folder:
        bag = BagWriter(Path(folder) / "bag", scaling.ring(3, 1), {})
        channel = bag.add_topic("/sat1/command", described(Command), [])
        begin = time.thread_time()
        for step in range(messages):
            bag.write(channel, step * 1_000_000, data, step)
        seconds = time.thread_time() - begin
        bag.close()
    return max(seconds, math.ulp(1.0)) / messages
