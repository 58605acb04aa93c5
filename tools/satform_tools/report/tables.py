# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints the result of a run: expectations, figures of the satellites, timing and speed."""

import math
from collections.abc import Sequence
from typing import Any

from satform.evaluation.conclusion import conclusion_of
from satform.scenario.expectation import Verdict
from satform_tools import console
from satform_tools.console import Table, number
from satform_tools.run import progress
from satform_tools.run.flight_summary import Summary
from satform_tools.run.pair_figures import PAIR_HEADINGS, tetrahedron_text
from satform_tools.run.run_result import RunResult, Speed

_PASS, _MISS, _NOTE = "green", "bold red", "yellow"


def print_result(result: RunResult, *, quiet: bool = False) -> None:
    """Print the result of a run: expectations with their verdicts, events, conclusion and speed.

    Args:
        result: of the run.
        quiet: whether nothing is printed that depends on the wall clock, which differs from run to run.
    """
    console.heading(f"{result.scenario.name}: {result.scenario.title}")
    if result.verdicts:
        print_verdicts(result.verdicts)
    for event in result.events:
        console.line(event)
    for finding in () if result.summary is None else result.summary.findings:
        console.line(finding, _NOTE)
    console.line(conclusion(result), _PASS if result.exit_code == 0 else _MISS)
    if result.punctuality and not quiet:
        _print_punctuality(result.punctuality)
    # The plant's host measures the time.
    if result.speed.steps and result.speed.seconds > 0.0 and not quiet:
        _print_speed(result)
    if result.state_hash:
        console.line(f"state hash {result.state_hash[:16]}")
    console.line(
        f"stored in {result.folder}"
        + (f" ({result.messages} messages in the bag)" if result.messages else "")
    )


def conclusion(result: RunResult) -> str:
    """The result of a run in one line."""
    flown = f"step {result.speed.steps} of {result.scenario.timing.steps}"
    if result.stopped:
        return f"Stopped at {flown}: no expectation is evaluated."
    if result.early_end is not None:
        missed = sum(not verdict.met for verdict in result.verdicts)
        judged = f" {missed} of {len(result.verdicts)} expectations missed." if result.verdicts else ""
        return f"ENDED EARLY after {flown}: {result.early_end.sentence}.{judged}"
    if result.lost and not result.complete:
        return f"Lost {', '.join(result.lost)} at {flown}: {result.reason}."
    if not result.complete:
        return f"The expectations cannot be evaluated: {result.reason or f'it ended at {flown}'}."
    if result.judged_on:
        return (
            f"Flown to the end. The expectations are evaluated on host {result.judged_on}, which has the bag."
        )
    if not result.recorded:
        return "Flown to the end. Nothing was recorded, so no expectation is evaluated."
    if result.tolerated:
        return f"{conclusion_of(result.scenario, result.verdicts)}."
    met = sum(verdict.met for verdict in result.verdicts)
    return (
        f"LOST {', '.join(result.lost)}, which the scenario does not allow; the others flew to the end "
        f"({met} of {len(result.verdicts)} expectations met)."
    )


def print_verdicts(verdicts: Sequence[Verdict]) -> None:
    """Print each expectation with its figure, allowed range and verdict."""
    rows = [
        (
            verdict.label,
            number(verdict.figure),
            verdict.unit,
            verdict.allowed,
            "pass" if verdict.met else "MISSED",
        )
        for verdict in verdicts
    ]
    styles = {index: _MISS for index, verdict in enumerate(verdicts) if not verdict.met}
    console.table(Table(("expectation", "figure", "unit", "allowed", "result"), rows, frozenset({1}), styles))


def print_summary(summary: Summary) -> None:
    """Print the figures of each satellite and of the formation."""
    headings = (
        "satellite",
        "final error [m]",
        "final sliding variable [m/s]",
        "mean control [m/s²]",
        "largest control [m/s²]",
        "delta-v [m/s]",
        "delta-v per orbit [m/s]",
    )
    rows = [entry.row() for entry in summary.satellites]
    console.table(Table(headings, rows, frozenset(range(1, len(headings)))))
    _print_thrusters(summary)
    _print_filters(summary)
    _print_pairs(summary)
    for finding in summary.findings:
        console.line(finding, _NOTE)
    for entry in summary.satellites:
        if entry.absent:
            console.line(
                f"{entry.name} did not fly in {entry.absent} steps, which are excluded from its errors"
            )
    console.line(f"final and mean: from {summary.final_from:g} s to {summary.duration:g} s")
    if len(summary.satellites) > 1:
        console.line(
            f"arc-length spread {number(summary.spread_at_start)} m at the start, "
            f"{number(summary.spread_at_end)} m at the end; "
            f"smallest distance between two satellites {number(summary.smallest_distance)} m"
        )


def _print_thrusters(summary: Summary) -> None:
    headings = (
        "satellite",
        "propellant used [kg]",
        "saturated steps",
        "below minimum impulse",
        "propellant depleted",
    )
    rows = [
        (
            entry.name,
            number(entry.propellant_used),
            str(entry.saturated_steps),
            str(entry.below_minimum_impulse_steps),
            str(entry.propellant_depleted_steps),
        )
        for entry in summary.satellites
        if not math.isnan(entry.propellant_used)
    ]
    if rows:
        console.table(Table(headings, rows, frozenset(range(1, len(headings)))))


def _print_filters(summary: Summary) -> None:
    headings = ("satellite", "mean NEES (6 is consistent)", "mean innovation squared", "rejected")
    rows = [
        (entry.name, number(entry.mean_nees), number(entry.mean_innovation), str(entry.rejected))
        for entry in summary.satellites
        if not math.isnan(entry.mean_nees)
    ]
    if rows:
        console.table(Table(headings, rows, frozenset(range(1, len(headings)))))


def _print_pairs(summary: Summary) -> None:
    rows = [entry.row() for entry in summary.pairs]
    if rows:
        console.table(Table(PAIR_HEADINGS, rows, frozenset(range(1, len(PAIR_HEADINGS)))))
    quality = tetrahedron_text(summary.tetrahedron_quality)
    if quality:
        console.line(quality)


def _print_punctuality(clock: dict[str, Any]) -> None:
    """Print how far the plant and the satellites kept to the wall clock."""
    headings = (
        "satellite",
        "missed steps",
        "late commands",
        "timed-out commands",
        "skipped states",
        "mean message age [s]",
        "largest message age [s]",
        "CPU time [s]",
    )
    rows = [
        (
            name,
            str(clock["misses"].get(name, 0)),
            str(clock["late"].get(name, 0)),
            str(clock["timed_out"].get(name, 0)),
            str(own["skipped"]),
            number(own["age_mean"]),
            number(own["age_largest"]),
            number(own["processor"]),
        )
        for name, own in clock["satellites"].items()
    ]
    console.table(Table(headings, rows, frozenset(range(1, len(headings)))))
    console.line(
        f"step period {1e3 * clock['period']:.3g} ms; start delay {1e3 * clock['delay_mean']:.3g} ms mean, "
        f"{1e3 * clock['delay_99']:.3g} ms at 99 %, {1e3 * clock['delay_largest']:.3g} ms maximum; "
        f"{clock['overruns']} overruns; CPU time of the plant {clock['processor']:.3g} s"
    )


def _print_speed(result: RunResult) -> None:
    speed = result.speed
    start = f", start {speed.start_seconds:.2f} s" if speed.start_seconds else ""
    took = f"{speed.steps} steps in {speed.seconds:.2f} s{start}"
    console.line(f"{progress.speed_text(result.scenario, speed.steps_per_second)} ({took})")
    fractions = speed.fractions()
    # The parts are not measured in a flight that ended early.
    if fractions and result.complete:
        console.line(_fractions_text(speed, fractions))
    if speed.ping_pong_seconds is not None:
        console.line(f"round trip of an empty message: {1e6 * speed.ping_pong_seconds:.0f} us")


def _fractions_text(speed: Speed, fractions: dict[str, float]) -> str:
    step = 1e6 * speed.seconds / speed.steps
    parts = [("DDS and waiting", "dds"), ("plant", "plant"), ("slowest satellite", "slowest_satellite")]
    listed = ", ".join(
        f"{name} {100 * fractions[key]:.0f} % ({step * fractions[key]:.0f} us)" for name, key in parts
    )
    return f"step of {step:.0f} us: {listed}"
