# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Speed over the number of satellites, over DDS and in one process."""

import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from satform.flight.simulate import simulate
from satform.scenario import Scenario, parse_scenario
from satform_tools.bench.processor import ProcessorClock
from satform_tools.run.round_trip import median_round_trip

_RING = """
name: ring
title: Satellites on one circle, each receiving from its two neighbours
text: Made for measuring speed.
orbit: {{period: 6000.0}}
timing: {{step: 1.0, duration: {steps}.0}}
dynamics: {{kind: cw, perturbations: [{{kind: harmonic, amplitude: 0.01, phase_step: 0.7}}]}}
graph: {{kind: {graph}}}
consensus: {{kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}}
nominal_motion: {{period: 6000.0}}
node_timeout: {timeout}
satellite_defaults:
  curve: {{kind: circle, radius: 50.0e3}}
  controller: {{kind: sliding_mode, boundary_layer: 0.1}}
satellites:
"""

OWN = "own"
"""The nodes' executor, with its compiled part if that is built."""

EXECUTORS: dict[str, list[str]] = {
    OWN: [],
    "python": ["without the compiled part"],
    "events": ["rclpy's events executor"],
    "single": ["rclpy's single-threaded executor"],
}
"""Executors that can be compared, each with what is added to the name of its figure."""

_TIMEOUT, _TIMEOUT_PER_SATELLITE = 10.0, 0.1
"""Smallest node timeout, and per satellite, s: the first step of a large formation takes longer."""


@dataclass(frozen=True)
class OverDds:
    """A lockstep flight.

    Attributes:
        satellites: how many.
        processes: plant, satellites' processes and recorder.
        steps_per_second: of wall-clock time.
        start_seconds: from the start of the first process to the first step.
        memory_per_process: largest resident memory of the satellites' processes, bytes, on the average.
        processor_per_step: processor time of all processes, s a step.
        edges: of the communication graph, each direction counted.
        round_trip: the bare round trip, median, s.
    """

    satellites: int
    processes: int
    steps_per_second: float
    start_seconds: float
    memory_per_process: float
    processor_per_step: float
    edges: int
    round_trip: float


@dataclass(frozen=True)
class InProcess:
    """An in-process flight.

    Attributes:
        satellites: how many.
        steps_per_second: of processor time, making the formation not counted.
    """

    satellites: int
    steps_per_second: float


def ring(count: int, steps: int, graph: str = "ring") -> Scenario:
    """A formation of any size: sliding mode, consensus and a harmonic disturbance, as in `triangle`.

    Args:
        count: satellites.
        steps: length of the flight.
        graph: kind of the communication graph with its fields, as in a scenario; none below 3 satellites.
    """
    graph = "none" if count < 3 else graph
    satellites = "".join(
        f"  - {{name: s{index}, arc_length: {1000.0 * (index * 7 % count)}}}\n" for index in range(count)
    )
    timeout = max(_TIMEOUT, _TIMEOUT_PER_SATELLITE * count)
    text = _RING.format(steps=steps, graph=graph, timeout=timeout) + satellites
    return parse_scenario(text, f"a ring of {count}")


def over_dds(
    count: int,
    group: int,
    steps: int,
    *,
    record: bool,
    arrays: bool = False,
    executor: str = OWN,
    scenario: Scenario | None = None,
    round_trips: int = 1000,
) -> OverDds:
    """Fly a formation in lockstep.

    Args:
        count: satellites.
        group: satellites that share a process.
        steps: length of the flight.
        record: whether a recorder takes part.
        arrays: whether satellites that share a process exchange arrays.
        executor: one of `EXECUTORS`.
        scenario: what to fly; a ring when left out.
        round_trips: bare ones that are measured right before; 0 for none, which makes their figures NaN.

    Returns:
        The figures of the flight.

    Raises:
        RuntimeError: a process was lost.
        KeyboardInterrupt: it was stopped by a signal, which also stops the measurement.
    """
    from satform_bringup.supervisor.run import fly  # noqa: PLC0415

    trip = median_round_trip(round_trips) if round_trips else math.nan
    flown = scenario or ring(count, steps)
    clock = ProcessorClock()
    with tempfile.TemporaryDirectory() as folder:
        flight = fly(
            flown,
            Path(folder),
            record=record,
            progress=clock.read,
            group=group,
            arrays=arrays,
            environment=_environment(executor),
        )
        if flight.stopped:
            raise KeyboardInterrupt
        if flight.lost:
            raise RuntimeError(f"{count} satellites: {flight.reason}")
    return OverDds(
        satellites=count,
        processes=len(flight.memory) + 1 + int(record),
        steps_per_second=flight.steps / flight.seconds,
        start_seconds=flight.start_seconds,
        memory_per_process=sum(flight.memory.values()) / len(flight.memory),
        processor_per_step=clock.per_step(),
        edges=int(flown.communication_graph().adjacency.astype(bool).sum()),
        round_trip=trip,
    )


def _environment(executor: str) -> dict[str, str]:
    """Variables by which the nodes use an executor."""
    from satform_nodes.transport.compiled import PYTHON_TRANSPORT  # noqa: PLC0415
    from satform_nodes.transport.fast_path import STOCK  # noqa: PLC0415

    variables: dict[str, dict[str, str]] = {OWN: {}, "python": {PYTHON_TRANSPORT: "1"}}
    return variables.get(executor, {STOCK: executor})


def in_process(count: int) -> InProcess:
    """Fly a ring in this process, for about two seconds or ten steps."""
    steps = max(10, min(5000, 200_000 // count))
    times: list[float] = []
    simulate(ring(count, steps), progress=lambda _step: times.append(time.thread_time()))
    # The first step makes what later ones reuse.
    return InProcess(count, (len(times) - 1) / (times[-1] - times[0]))
