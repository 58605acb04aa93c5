# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The result of a run as JUnit XML: a test case for the flight and one for each of its expectations."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from satform.common.exit_codes import EXIT_DONE, EXIT_ENDED_EARLY, EXIT_MISSED, EXIT_STOPPED
from satform.scenario.expectation import Verdict
from satform_tools import console
from satform_tools.report import junit, tables
from satform_tools.report.junit import FLIGHT, FLIGHT_SUITE, Case, Suite
from satform_tools.run.run_result import RunResult
from satform_tools.run.versions import versions


def write(result: RunResult, file: Path | None) -> None:
    """Write the result of a run.

    Args:
        result: of the run.
        file: to write; None for none.

    Raises:
        CommandError: it cannot be written.
    """
    if file is not None:
        junit.write(suite_of(result), file)


def suite_of(result: RunResult) -> Suite:
    """The flight and its expectations as test cases.

    An expectation that was not evaluated is skipped, with the reason.
    """
    scenario = result.scenario
    seconds = result.speed.start_seconds + result.speed.seconds
    lines = [tables.conclusion(result), *result.events]
    lines += [f"state hash {result.state_hash}"] if result.state_hash else []
    lines += [f"stored in {result.folder}"]
    return Suite(
        name=f"{FLIGHT_SUITE} {scenario.name}",
        classname=scenario.name,
        cases=_distinct([_flight(result, seconds), *_expectations(result)]),
        properties={
            "mode": result.mode,
            "seed": str(scenario.seed),
            "digest": scenario.digest(),
            "state_hash": result.state_hash,
            **versions(),
        },
        seconds=seconds,
        output="\n".join(lines),
    )


def _flight(result: RunResult, seconds: float) -> Case:
    """The test case of the flight: an error where it could not be finished, a failure where it diverged."""
    if result.exit_code in {EXIT_DONE, EXIT_MISSED}:
        return Case(FLIGHT, seconds=seconds)
    message = tables.conclusion(result)
    if result.exit_code == EXIT_ENDED_EARLY:
        return Case(FLIGHT, "failure", message, "ended early", seconds=seconds)
    kind = "stopped" if result.exit_code == EXIT_STOPPED else "lost"
    return Case(FLIGHT, "error", message, kind, seconds=seconds)


def _expectations(result: RunResult) -> Iterator[Case]:
    if result.verdicts:
        yield from map(_judged, result.verdicts)
    else:
        for expectation in result.scenario.expect:
            yield Case(expectation.describe(), "skipped", tables.conclusion(result))
    for omitted in result.scenario.omitted_expectations:
        yield Case(omitted, "skipped", "left out: the flight ends before it")


def _judged(verdict: Verdict) -> Case:
    if verdict.met:
        return Case(verdict.label)
    found = f"{console.number(verdict.figure)} {verdict.unit}".strip()
    message = f"expected {verdict.allowed}, found {found}"
    return Case(verdict.label, "failure", message, "missed", f"source: {verdict.origin}")


def _distinct(cases: list[Case]) -> list[Case]:
    """The cases, those after the first of a name with a number: servers tell them apart by name."""
    seen: Counter[str] = Counter()
    distinct = []
    for case in cases:
        seen[case.name] += 1
        number = seen[case.name]
        name = case.name if number == 1 else f"{case.name} ({number})"
        distinct.append(replace(case, name=name))
    return distinct
