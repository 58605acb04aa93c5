# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs a scenario, in this process or over DDS, and judges the flight by its expectations.

The exit code is decided in `run_result`.
"""

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path

from satform.evaluation.evaluate import evaluate
from satform.flight.array_exchange import array_complaints, recorded_every
from satform.record.archive import RECORD, save_record
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, save_scenario
from satform.scenario.deployment import HostSpec
from satform.scenario.expectation import Verdict
from satform.scenario.loader import SCENARIO_FILE
from satform_bringup.supervisor.flight import Flight, Policy
from satform_nodes.runtime.signals import StopRequest
from satform_tools import console
from satform_tools.errors import CommandError, sentence_of
from satform_tools.run import host_part, output_folders, progress, ros_packages
from satform_tools.run.flight_summary import Summary, summarise
from satform_tools.run.round_trip import median_round_trip
from satform_tools.run.run_result import Mode, RunResult, Speed

_SMALLEST_GROUP = 2
"""Satellites of a group that exchanges arrays, at least."""

_ROUND_TRIPS = 3000
"""Bare round trips that are measured."""


@dataclass(frozen=True)
class RunOptions:
    """How a scenario is flown over DDS.

    Attributes:
        measure_round_trip: whether to measure a bare round trip, too.
        satellites_per_process: satellites that share a process.
        arrays: whether these exchange arrays, in place of messages of each.
        restart: whether lost satellites are restarted.
        continue_without_recorder: whether the flight goes on if the recorder is lost.
        rate: simulated seconds in a second of wall-clock time; 0 for lockstep.
        display: whether to publish markers, poses and paths for RViz and Foxglove.
        host: name of this machine's host in the scenario; None when it runs everything.
        keystore: with the nodes' keys; None to fly unsecured.
        profile: whether to write what every process did when.
        namespace: of all nodes and topics, such as `/f1`; empty for the root.
        quiet: whether neither progress nor a time of the wall clock is printed.
        live: whether the flight can be watched, on a page or in Foxglove.
    """

    measure_round_trip: bool = False
    satellites_per_process: int = 1
    arrays: bool = False
    restart: bool = False
    continue_without_recorder: bool = False
    rate: float = 0.0
    display: bool = False
    host: str | None = None
    keystore: Path | None = None
    profile: bool = False
    namespace: str = ""
    quiet: bool = False
    live: bool = False


def run(
    scenario: Scenario, mode: Mode, *, record: bool, out: Path | None, options: RunOptions | None = None
) -> RunResult:
    """Fly a scenario, and write and return the result.

    Args:
        scenario: to fly.
        mode: in this process, or as separate processes over DDS.
        record: whether to record the flight.
        out: folder of the run; None for a new one.
        options: of a flight over DDS.

    Returns:
        The result; also written to the folder.

    Raises:
        CommandError: the run cannot be started or stored.
    """
    options = options or RunOptions()
    _require_fitting(options, mode)
    if options.arrays:
        _require_arrays(scenario, options)
    part = None if options.host is None else host_part.part(scenario, options.host, mode, record=record)
    folder = output_folders.make(out, scenario.name)
    try:
        if mode == "inprocess":
            save_scenario(scenario, folder / SCENARIO_FILE)
            result = _in_process(scenario, folder, record=record, quiet=options.quiet)
        else:
            result = _over_dds(scenario, folder, record=record, options=options, host=part)
        if part is not None:
            result = host_part.on_host(result, part)
    except OSError as error:
        raise CommandError(f"the run cannot be stored: {sentence_of(error)}") from None
    return _write_result(result)


def _write_result(result: RunResult) -> RunResult:
    """Write the result; where that fails its reason says so, and it is still returned."""
    try:
        result.write(result.folder / output_folders.RESULT)
    except OSError as error:
        reason = f"the result cannot be stored: {sentence_of(error)}"
        return replace(result, reason="; ".join(filter(None, (result.reason, reason))))
    return result


def _require_fitting(options: RunOptions, mode: Mode) -> None:
    """Check that the options can be combined.

    Raises:
        CommandError: they cannot.
    """
    if mode == "inprocess":
        needs_dds = (
            (options.display, "--display", "needs topics"),
            (options.live, "--live or --foxglove", "needs topics"),
            (options.keystore, "--secure", "needs DDS"),
            (options.profile, "--profile", "needs several processes"),
            (options.satellites_per_process > 1, "--satellites-per-process", "needs several processes"),
            (options.arrays, "--arrays", "needs several processes"),
            (options.restart, "--restart", "needs several processes"),
            (options.continue_without_recorder, "--continue-without-recorder", "needs a recorder process"),
            (options.namespace != "", "--namespace", "needs topics"),
            (options.measure_round_trip, "--measure-round-trip", "needs several processes"),
        )
        for wanted, option, purpose in needs_dds:
            if wanted:
                raise CommandError(f"{option} {purpose}; --mode inprocess flies in one process without DDS")
    if options.profile and mode == "realtime":
        raise CommandError(
            "--profile is for lockstep; against the wall clock a step waits for its time, not for work"
        )
    if options.namespace and options.keystore is not None:
        raise CommandError(
            "--namespace and --secure exclude each other: a keystore's permissions are for the root namespace"
        )
    if options.live and options.keystore is not None:
        raise CommandError(
            "--live or --foxglove and --secure exclude each other: a keystore has no keys for an observer"
        )
    if options.display and options.keystore is not None:
        raise CommandError(
            "--display and --secure exclude each other: a keystore has no keys for the display"
        )


def _require_arrays(scenario: Scenario, options: RunOptions) -> None:
    """Check that groups of satellites can exchange arrays in this flight.

    Raises:
        CommandError: they cannot.
    """
    if options.satellites_per_process < _SMALLEST_GROUP:
        raise CommandError("--arrays needs --satellites-per-process N with at least 2, the size of a group")
    excluded = (
        (options.rate, "--mode realtime"),
        (options.restart, "--restart"),
        (options.continue_without_recorder, "--continue-without-recorder"),
        (options.display, "--display"),
        (options.live, "--live or --foxglove"),
        (options.profile, "--profile"),
        (options.host is not None, "--host"),
        (options.keystore is not None, "--secure"),
    )
    for wanted, option in excluded:
        if wanted:
            raise CommandError(f"--arrays and {option} exclude each other yet: fly without one of them")
    complaints = array_complaints(scenario)
    if complaints:
        raise CommandError(complaints[0])


def _in_process(scenario: Scenario, folder: Path, *, record: bool, quiet: bool) -> RunResult:
    from satform.flight.simulate import simulate  # noqa: PLC0415 - lockstep does without

    total = scenario.timing.steps
    with StopRequest() as request, progress.displayed(scenario, quiet=quiet) as report:
        start = time.perf_counter()
        flight = simulate(scenario, progress=lambda steps: report(steps, total), stop=lambda: request.asked)
        speed = Speed(flight.steps, time.perf_counter() - start, scenario.timing.step)
        # A run that is stopped still stores the steps flown.
        unkept = _save_record(flight, folder) if record else ""
    if flight.steps < total and flight.early_end is None:
        reason = "; ".join(filter(None, (f"stopped by {request.name}", unkept)))
        return RunResult(scenario, "inprocess", folder, speed, recorded=record, reason=reason, stopped=True)
    ended = "" if flight.early_end is None else flight.early_end.sentence
    reason = "; ".join(filter(None, (ended, unkept)))
    verdicts, summary = _judged(scenario, flight)
    return RunResult(
        scenario,
        "inprocess",
        folder,
        speed,
        verdicts,
        summary,
        reason=reason,
        state_hash=flight.digest() if flight.steps else "",
        early_end=flight.early_end,
    )


def _save_record(flight: FlightRecord, folder: Path) -> str:
    """Store a flight; returns a sentence where that fails, since the flight is judged all the same."""
    try:
        save_record(flight, folder / RECORD)
    except OSError as error:
        return f"flown to step {flight.steps}, but the record cannot be stored: {sentence_of(error)}"
    return ""


def _tracing(folder: Path) -> dict[str, str]:
    """The environment variable with which every process of a run writes its trace."""
    from satform_nodes.transport import trace  # noqa: PLC0415 - in-process runs do without

    traces = folder / output_folders.TRACE
    traces.mkdir()
    return {trace.FOLDER: str(traces.absolute())}


def _over_dds(
    scenario: Scenario, folder: Path, *, record: bool, options: RunOptions, host: HostSpec | None
) -> RunResult:
    ros_packages.require()
    from satform_bringup.supervisor.run import fly  # noqa: PLC0415 - in-process runs do without

    policy = Policy(options.restart, options.continue_without_recorder, options.rate)
    try:
        with progress.displayed(scenario, quiet=options.quiet) as report:
            flight = fly(
                scenario,
                folder,
                record=record,
                progress=report,
                group=options.satellites_per_process,
                arrays=options.arrays,
                display=options.display,
                policy=policy,
                host=host,
                keystore=options.keystore,
                environment=_tracing(folder) if options.profile else None,
                namespace=options.namespace,
                notice=console.note,
            )
    except RuntimeError as error:
        raise CommandError(str(error)) from None
    speed = Speed(
        steps=flight.steps,
        seconds=flight.seconds,
        step_length=scenario.timing.step,
        start_seconds=flight.start_seconds,
        plant_seconds=flight.plant_seconds,
        satellite_seconds=flight.satellite_seconds,
        ping_pong_seconds=_round_trip() if options.measure_round_trip and not flight.stopped else None,
    )
    reason = flight.reason or "; ".join(flight.missed)
    broken = bool(flight.stopped or reason)
    verdicts: tuple[Verdict, ...] = ()
    summary = None
    state_hash = ""
    thinned = recorded_every(len(scenario.satellites), scenario.timing.steps) if options.arrays else 1
    if flight.bag is not None and thinned == 1 and (flight.early_end or not broken):
        try:
            recorded = _read(scenario, flight.bag)
            verdicts, summary = _judged(scenario, recorded)
            state_hash = "" if options.rate or not recorded.steps else recorded.digest()
        except CommandError as error:
            reason = reason or str(error)
            if flight.early_end:
                # No step was flown of which there could be a figure.
                verdicts = tuple(expectation.verdict(math.nan) for expectation in scenario.expect)
    return RunResult(
        scenario=scenario,
        mode="realtime" if options.rate else "lockstep",
        punctuality=flight.punctuality,
        state_hash=state_hash,
        folder=folder,
        speed=speed,
        verdicts=verdicts,
        summary=summary,
        recorded=flight.bag is not None,
        lost=flight.lost,
        events=(*_events(flight, quiet=options.quiet), *_thinned(flight, thinned)),
        reason=reason,
        stopped=flight.stopped,
        messages=flight.messages,
        early_end=flight.early_end,
    )


def _events(flight: "Flight", *, quiet: bool) -> tuple[str, ...]:
    """Sentences about losses and rejoins, in the order of the steps, and warnings."""

    def later(seconds: float) -> str:
        return "" if quiet else f", {seconds:.2f} s of wall-clock time later"

    losses = [
        (
            loss.step,
            f"{loss.name} lost at step {loss.step}, {'as planned' if loss.planned else loss.reason}",
        )
        for loss in flight.losses
    ]
    returns = [
        (
            rejoin.step,
            f"{rejoin.name} rejoined at step {rejoin.step}{later(rejoin.seconds)}",
        )
        for rejoin in flight.returns
    ]
    ordered = sorted([*losses, *returns], key=lambda entry: entry[0])
    return (*(sentence for _, sentence in ordered), *flight.warnings)


def _thinned(flight: "Flight", every: int) -> tuple[str, ...]:
    """A sentence about a bag from which steps were left out."""
    if flight.bag is None or every == 1:
        return ()
    return (f"the bag has each step that is divisible by {every}; the expectations were not evaluated",)


def _read(scenario: Scenario, path: Path) -> FlightRecord:
    """The whole flight from its bag.

    Raises:
        CommandError: the bag does not hold the whole flight.
    """
    from satform.bag.errors import BagError  # noqa: PLC0415 - in-process runs do without
    from satform.bag.reader import read_bag  # noqa: PLC0415 - needs ROS, in-process runs do not

    try:
        bag = read_bag(path)
    except BagError as error:
        raise CommandError(str(error)) from None
    if not bag.complete:
        steps = f"{bag.record.steps} of {scenario.timing.steps} steps"
        raise CommandError(f"the bag is not complete: it has {steps}")
    return bag.record


def _judged(scenario: Scenario, flight: FlightRecord) -> tuple[tuple[Verdict, ...], Summary | None]:
    """Verdicts and summary of a flight; no summary of a flight without a step."""
    return tuple(evaluate(scenario, flight)), summarise(flight, scenario.setting) if flight.steps else None


def _round_trip() -> float | None:
    """Median time of a bare round trip between two processes, s; None where it fails."""
    try:
        return median_round_trip(_ROUND_TRIPS)
    except RuntimeError as error:
        console.note(f"the round trip was not measured: {error}")
        return None
