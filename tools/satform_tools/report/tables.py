# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a run came to, as tables and lines for people."""

import math
from collections.abc import Sequence
from typing import Any

from satform.evaluation.conclusion import conclusion_of
from satform.scenario.expectation import Verdict
from satform_tools import console
from satform_tools.console import Table, number
from satform_tools.run import progress
from satform_tools.run.flight_summary import Summary
from satform_tools.run.run_result import Outcome, Speed

_PASS, _MISS, _NOTE = "green", "bold red", "yellow"


def print_outcome(outcome: Outcome) -> None:
    """Print the result of a run: expectations, whether they were met, and how fast it was."""
    console.heading(f"{outcome.scenario.name}: {outcome.scenario.title}")
    if outcome.verdicts:
        print_verdicts(outcome.verdicts)
    for event in outcome.events:
        console.line(event)
    for finding in () if outcome.summary is None else outcome.summary.findings:
        console.line(finding, _NOTE)
    console.line(conclusion(outcome), _PASS if outcome.exit_code == 0 else _MISS)
    if outcome.punctuality:
        _print_punctuality(outcome.punctuality)
    # The plant's host measures the time.
    if outcome.speed.steps and outcome.speed.seconds > 0.0:
        _print_speed(outcome)
    if outcome.state_hash:
        console.line(f"state hash {outcome.state_hash[:16]}, the same in every run with the same bits")
    console.line(
        f"kept in {outcome.folder}"
        + (f" ({outcome.messages} messages in the bag)" if outcome.messages else "")
    )


def conclusion(outcome: Outcome) -> str:
    """What came of a run in one line."""
    flown = f"step {outcome.speed.steps} of {outcome.scenario.timing.steps}"
    if outcome.stopped:
        return f"Stopped at {flown}: nothing is judged."
    if outcome.early_end is not None:
        missed = sum(not verdict.met for verdict in outcome.verdicts)
        judged = f" {missed} of {len(outcome.verdicts)} expectations missed." if outcome.verdicts else ""
        return f"ENDED EARLY after {flown}: {outcome.early_end.sentence}.{judged}"
    if outcome.lost and not outcome.complete:
        return f"Lost {', '.join(outcome.lost)} at {flown}: {outcome.reason}."
    if not outcome.complete:
        return f"The flight cannot be judged: {outcome.reason or f'it ended at {flown}'}."
    if outcome.judged_on:
        return f"Flown to the end. It is judged on host {outcome.judged_on}, which records."
    if not outcome.recorded:
        return "Flown to the end. Nothing was recorded, so there is nothing to judge by."
    if outcome.tolerated:
        return f"{conclusion_of(outcome.scenario, outcome.verdicts)}."
    met = sum(verdict.met for verdict in outcome.verdicts)
    return (
        f"LOST {', '.join(outcome.lost)}, which the scenario does not allow; the others flew to the end "
        f"({met} of {len(outcome.verdicts)} expectations met)."
    )


def print_verdicts(verdicts: Sequence[Verdict]) -> None:
    """Print each expectation with its figure, what is allowed, and whether it was met."""
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
    """Print a flight in figures."""
    headings = (
        "satellite",
        "final error [m]",
        "final sliding variable [m/s]",
        "mean control [m/s²]",
        "largest control [m/s²]",
        "delta-v [m/s]",
    )
    rows = [
        (
            entry.name,
            number(entry.final_error),
            number(entry.final_sliding_variable),
            number(entry.mean_control),
            number(entry.largest_control),
            number(entry.delta_v),
        )
        for entry in summary.satellites
    ]
    console.table(Table(headings, rows, frozenset(range(1, len(headings)))))
    _print_thrusters(summary)
    _print_filters(summary)
    for finding in summary.findings:
        console.line(finding, _NOTE)
    for entry in summary.satellites:
        if entry.absent:
            console.line(
                f"{entry.name} did not fly in {entry.absent} steps, which have no part in its errors"
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
        "saturated_steps",
        "below_minimum_impulse_steps",
        "propellant_depleted_steps",
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


def _print_punctuality(kept: dict[str, Any]) -> None:
    """How well the plant kept to the clock, and the satellites with it."""
    headings = (
        "satellite",
        "missed steps",
        "late commands",
        "timed-out commands",
        "states left out",
        "mean age heard [s]",
        "largest age heard [s]",
        "processor [s]",
    )
    rows = [
        (
            name,
            str(kept["misses"].get(name, 0)),
            str(kept["late"].get(name, 0)),
            str(kept["timed_out"].get(name, 0)),
            str(own["skipped"]),
            number(own["age_mean"]),
            number(own["age_largest"]),
            number(own["processor"]),
        )
        for name, own in kept["satellites"].items()
    ]
    console.table(Table(headings, rows, frozenset(range(1, len(headings)))))
    console.line(
        f"a step every {1e3 * kept['period']:.3g} ms: begun late by {1e3 * kept['delay_mean']:.3g} ms on the "
        f"average, {1e3 * kept['delay_99']:.3g} ms at 99 %, {1e3 * kept['delay_largest']:.3g} ms at most; "
        f"the clock was set anew {kept['overruns']} times; "
        f"the plant used {kept['processor']:.3g} s of processor"
    )


def _print_speed(outcome: Outcome) -> None:
    speed = outcome.speed
    start = f", start {speed.start_seconds:.2f} s" if speed.start_seconds else ""
    took = f"{speed.steps} steps in {speed.seconds:.2f} s{start}"
    console.line(f"{progress.pace(outcome.scenario, speed.steps_per_second)} ({took})")
    shares = speed.shares()
    # A flight that ended early has no tally of its parts.
    if shares and outcome.complete:
        console.line(_share_words(speed, shares))
    if speed.ping_pong_seconds is not None:
        console.line(f"bare message there and back: {1e6 * speed.ping_pong_seconds:.0f} us")


def _share_words(speed: Speed, shares: dict[str, float]) -> str:
    step = 1e6 * speed.seconds / speed.steps
    parts = [("DDS and waiting", "dds"), ("plant", "plant"), ("slowest satellite", "slowest_satellite")]
    words = [f"{name} {100 * shares[key]:.0f} % ({step * shares[key]:.0f} us)" for name, key in parts]
    return f"of a step of {step:.0f} us: {', '.join(words)}"
