"""How steps in a second depend on the number of satellites, over DDS and in one process."""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from satform.scenario import Scenario, parse_scenario
from satform.simulate import simulate

_RING = """
name: ring
title: Satellites on one circle, each hearing its two neighbours
text: Made for measuring speed.
orbit: {{period: 6000.0}}
timing: {{step: 1.0, duration: {steps}.0}}
dynamics: {{kind: cw, perturbations: [{{kind: harmonic, amplitude: 0.01, phase_step: 0.7}}]}}
graph: {{kind: {graph}}}
consensus: {{kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}}
circulation: {{period: 6000.0}}
every_satellite:
  curve: {{kind: circle, radius: 50.0e3}}
  controller: {{kind: sliding_mode, boundary_layer: 0.1}}
satellites:
"""


@dataclass(frozen=True)
class OverDds:
    """A lockstep flight.

    Attributes:
        satellites: how many.
        processes: plant, satellites' processes and recorder.
        steps_per_second: of wall-clock time.
        round_trips_per_step: length of a step in bare round trips over DDS, measured right before.
        start_seconds: from the start of the first process to the first step.
        memory_per_process: largest resident memory of the satellites' processes, bytes, on the average.
    """

    satellites: int
    processes: int
    steps_per_second: float
    round_trips_per_step: float
    start_seconds: float
    memory_per_process: float


@dataclass(frozen=True)
class InProcess:
    """An in-process flight.

    Attributes:
        satellites: how many.
        steps_per_second: of wall-clock time, making the formation not counted.
    """

    satellites: int
    steps_per_second: float


def ring(count: int, steps: int) -> Scenario:
    """A formation of any size: sliding mode, consensus and a harmonic disturbance, as in `triangle`."""
    graph = "none" if count < 3 else "ring"
    satellites = "".join(
        f"  - {{name: s{index}, arc_length: {1000.0 * (index * 7 % count)}}}\n" for index in range(count)
    )
    return parse_scenario(_RING.format(steps=steps, graph=graph) + satellites, f"a ring of {count}")


def over_dds(count: int, group: int, steps: int, *, record: bool) -> OverDds:
    """Fly a ring in lockstep.

    Args:
        count: satellites.
        group: satellites that share a process.
        steps: length of the flight.
        record: whether a recorder takes part.

    Returns:
        How fast it was.

    Raises:
        RuntimeError: a process was lost.
    """
    from satform_bringup.domain import on_domain, own_domain  # noqa: PLC0415
    from satform_bringup.supervise import fly  # noqa: PLC0415
    from satform_nodes import ping_pong  # noqa: PLC0415

    with own_domain() as domain, on_domain(domain):
        round_trip = ping_pong.measure(1000).median
    with tempfile.TemporaryDirectory() as folder:
        scenario = ring(count, steps)
        flight = fly(scenario, Path(folder), record=record, progress=lambda _done, _all: None, group=group)
        if flight.lost or flight.stopped:
            raise RuntimeError(f"{count} satellites: {flight.reason}")
    return OverDds(
        satellites=count,
        processes=len(flight.memory) + 1 + int(record),
        steps_per_second=flight.steps / flight.seconds,
        round_trips_per_step=flight.seconds / flight.steps / round_trip,
        start_seconds=flight.start_seconds,
        memory_per_process=sum(flight.memory.values()) / len(flight.memory),
    )


def in_process(count: int) -> InProcess:
    """Fly a ring in this process, for about two seconds or ten steps."""
    steps = max(10, min(5000, 200_000 // count))
    times: list[float] = []
    simulate(ring(count, steps), progress=lambda _step: times.append(time.perf_counter()))
    # The first step makes what later ones reuse.
    return InProcess(count, (len(times) - 1) / (times[-1] - times[0]))
