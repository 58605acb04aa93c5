# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Speed of campaigns: cases beside the same cases flown one after another, the engine's own cost, memory."""

import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from satform.campaign.cases import case_scenario, case_values
from satform.campaign.chunk import fly_chunk
from satform.campaign.engine import ChunkObserver, ChunkScheduler, Job, chunk_size
from satform.campaign.folder import CampaignFolder
from satform.campaign.loader import load_campaign
from satform.campaign.local_engine import LocalEngine
from satform.campaign.model import Campaign
from satform.campaign.result_store import ResultStore
from satform.campaign.results import CaseResult
from satform.evaluation.evaluate import evaluate
from satform.flight.simulate import simulate
from satform_tools.bench import basilisk
from satform_tools.bench.figures import Figure, numpy_loop
from satform_tools.bench.processor import processor_time
from satform_tools.run.scenario_library import SCENARIOS

ONE_BY_ONE = "simulate, one by one"
FLOWN = "flight of the case"
NUMPY_LOOP = "numpy loop"
BASILISK = "Basilisk, a deputy's step"

_CAMPAIGN = """
name: bench
title: The triangle with dispersed starts, gains and noise
scenario: triangle
runs: {runs}
seed: 1
set: {{timing.duration: {duration}, satellite_defaults.sensor: {{position_noise: 1.0, velocity_noise: 0.01}}}}
dispersions:
  - path: satellites[*].position_error[*]
    distribution: {{kind: normal, standard_deviation: 1000.0}}
    applied: add
  - path: satellites[*].arc_length
    distribution: {{kind: uniform, low: -10.0e3, high: 10.0e3}}
    applied: add
  - path: satellites[*].controller.reaching_gain[*]
    distribution: {{kind: uniform, low: 0.8, high: 1.2}}
    applied: scale
    shared: true
"""

_SHORT = 20.0
"""Duration of a short case, s."""

_DEPUTIES = 100
_PAGE = os.sysconf("SC_PAGE_SIZE")
_READING = 0.1
"""Time between two readings of the memory, s."""


@dataclass(frozen=True)
class Size:
    """How much is flown.

    Attributes:
        runs: cases of the triangle.
        duration: of each, s.
        compared: cases that are flown one by one beside them.
        short: short cases of which the engine's own cost is measured.
        workers: processes.
    """

    runs: int = 1000
    duration: float = 12_000.0
    compared: int = 6
    short: int = 10_000
    workers: int = 2


QUICK = Size(runs=60, duration=300.0, compared=3, short=500)
"""For trying out: some seconds."""


@dataclass(frozen=True)
class Flown:
    """What a campaign has cost.

    Attributes:
        cases: flown.
        stacked: of them in stacks.
        seconds: of wall-clock time, from the first chunk to the last result.
        processor: time of all processes of the command, its start and its report included, s.
        memory: largest memory of all these processes together, bytes.
    """

    cases: int
    stacked: int
    seconds: float
    processor: float
    memory: int


def measure(size: Size, repetitions: int) -> list[Figure]:
    """All figures of campaigns.

    Args:
        size: how much is flown.
        repetitions: how often.

    Raises:
        RuntimeError: a campaign could not be flown.
    """
    with tempfile.TemporaryDirectory() as folder:
        campaign = _made(Path(folder), size.runs, size.duration)
        found = _throughput(campaign, Path(folder), size, repetitions)
        short = _made(Path(folder), size.short, _SHORT)
        return [*found, _overhead(short, Path(folder), size, repetitions)]


def _made(folder: Path, runs: int, duration: float) -> Campaign:
    file = folder / f"bench_{runs}.yaml"
    file.write_text(_CAMPAIGN.format(runs=runs, duration=duration), encoding="utf-8")
    return load_campaign(file, SCENARIOS)


def _throughput(campaign: Campaign, folder: Path, size: Size, repetitions: int) -> list[Figure]:
    """A case of a campaign beside the same cases one by one, and a satellite's step."""
    file = folder / f"bench_{size.runs}.yaml"
    alone, waits, flights = [], [], []
    for number in range(repetitions):
        cost, wait = _one_by_one(campaign, size.compared)
        alone.append(cost)
        waits.append(wait)
        flights.append(_campaign(file, folder / f"out{number}", size.workers))
    costs = [flown.processor / flown.cases for flown in flights]
    last = flights[-1]
    details = {
        "wall_seconds": min(flown.seconds for flown in flights),
        "cases_per_second": max(flown.cases / flown.seconds for flown in flights),
        "throughput_ratio": statistics.median(
            flown.cases / flown.seconds * wait for flown, wait in zip(flights, waits, strict=True)
        ),
        "memory": float(max(flown.memory for flown in flights)),
        "stacked": float(last.stacked),
        "workers": float(size.workers),
    }
    base = campaign.base
    steps = base.timing.steps * len(base.satellites)
    deputies = _deputies(repetitions)
    beside = BASILISK if deputies else NUMPY_LOOP
    yardstick = deputies or [numpy_loop() for _ in range(repetitions)]
    return [
        Figure(f"campaign, a case of {size.runs}", tuple(costs), ONE_BY_ONE, tuple(alone), details),
        Figure(
            "campaign, a satellite's step",
            tuple(cost / steps for cost in costs),
            beside,
            tuple(yardstick),
            {"one_by_one": min(alone) / steps},
        ),
    ]


def _one_by_one(campaign: Campaign, cases: int) -> tuple[float, float]:
    """Processor time and wall-clock time of a case that is flown and judged alone, s."""
    begin, begun = time.process_time(), time.perf_counter()
    for number in range(cases):
        scenario = case_scenario(campaign, number)
        evaluate(scenario, simulate(scenario))
    return (time.process_time() - begin) / cases, (time.perf_counter() - begun) / cases


def _campaign(file: Path, out: Path, workers: int) -> Flown:
    """Fly a campaign by its command, in a process whose time and memory are measured."""
    command = [sys.executable, "-m", "satform_tools", "campaign", "run", str(file)]
    command += ["--out", str(out), "--workers", str(workers), "--json"]
    path = os.pathsep.join(entry for entry in sys.path if entry)
    with tempfile.TemporaryFile() as answer:
        process = subprocess.Popen(
            command, stdout=answer, stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path}
        )
        memory, usage = 0, None
        try:
            while usage is None:
                memory = max(memory, _memory(process.pid))
                time.sleep(_READING)  # polls: memory is sampled, and there is no event for it
                ended, _, used = os.wait4(process.pid, os.WNOHANG)
                usage = used if ended else None
        finally:
            if usage is None:
                process.kill()
                process.wait()
        # Its end has been waited for here, of which subprocess does not know.
        process.returncode = 0
        answer.seek(0)
        try:
            data = json.loads(answer.read())
            speed = data["speed"]
            cases = int(speed["cases"])
        except (ValueError, KeyError, TypeError):
            raise RuntimeError(f"the campaign {file.stem} could not be flown") from None
    return Flown(
        cases, int(data["stacked"]), float(speed["seconds"]), usage.ru_utime + usage.ru_stime, memory
    )


def _memory(process: int) -> int:
    """Resident memory of a process and of all that it has started, bytes."""
    found, waiting = 0, [process]
    while waiting:
        number = waiting.pop()
        try:
            found += int(Path(f"/proc/{number}/statm").read_text(encoding="ascii").split()[1]) * _PAGE
            for task in Path(f"/proc/{number}/task").iterdir():
                waiting += map(int, (task / "children").read_text(encoding="ascii").split())
        except (OSError, IndexError):
            # It has just ended.
            continue
    return found


def _deputies(repetitions: int) -> list[float]:
    """Processor time of a deputy's step in Basilisk, s; empty where it is not installed."""
    try:
        return [1.0 / (basilisk.steps_per_second(_DEPUTIES) * _DEPUTIES) for _ in range(repetitions)]
    except ImportError:
        return []


def canned_chunk(
    about: Any, numbers: Sequence[int], observer: ChunkObserver | None = None, records: str | None = None
) -> list[CaseResult]:
    """Give cases a result that is made already: what is left is what the engine costs.

    Args:
        about: the result that every case gets.
        numbers: of the cases.
        observer: as for `satform.campaign.chunk.fly_chunk`.
        records: likewise.
    """
    results = [replace(about, number=number) for number in numbers]
    if observer is not None:
        observer.begin(numbers)
        observer.finished(results)
    return results


def _overhead(campaign: Campaign, folder: Path, size: Size, repetitions: int) -> Figure:
    """What the engine adds to a short case: chunks, pipes, storage; beside the flight of the case."""
    count = chunk_size(size.short, size.workers, len(campaign.base.satellites))
    costs, flights = [], []
    for repetition in range(repetitions):
        flights.append(_flight(campaign, count))
        costs.append(_engine_cost(campaign, folder / f"engine{repetition}", size, count))
    details = {"case_seconds": min(flights), "cases_in_a_chunk": float(count)}
    name = f"campaign, the engine's share of {size.short} cases of {_SHORT:g} s"
    return Figure(name, tuple(costs), FLOWN, tuple(flights), details)


def _flight(campaign: Campaign, count: int) -> float:
    """Processor time of a short case in a chunk, s."""
    begin = time.process_time()
    fly_chunk(campaign, range(count))
    return max(time.process_time() - begin, math.ulp(1.0)) / count


def _engine_cost(campaign: Campaign, folder: Path, size: Size, count: int) -> float:
    """Processor time that all processes spend on a case whose result is made already, s."""
    names = campaign.figure_names
    judged = names[len(campaign.figures) :]
    about = CaseResult(
        0, case_values(campaign, 0), dict.fromkeys(names, 1.0), dict.fromkeys(judged, True), success=True
    )
    folder.mkdir()
    store = ResultStore(CampaignFolder.create(folder, campaign, None, ""))
    engine = LocalEngine(Job(canned_chunk, about), size.workers)

    def spent() -> float:
        return time.process_time() + sum(processor_time(process) or 0.0 for process in engine.pids)

    try:
        # Workers start with their first chunks.
        ChunkScheduler(lambda _: about.changes, lambda _: None).fly(range(2 * size.workers), 1, engine)
        before = spent()
        ChunkScheduler(lambda _: about.changes, store.store).fly(range(size.short), count, engine)
        store.flush()
        return max(spent() - before, math.ulp(1.0)) / size.short
    finally:
        engine.close()
