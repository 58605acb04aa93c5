# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flies some cases of a campaign in this process, and gives each its result.

Cases that are alike are flown as one formation, with the same figures to the bit as one by one. A case that
ends early, or whose record is retained, is flown alone.
"""

import logging
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from satform.campaign.cases import case_scenario, case_values
from satform.campaign.engine import ChunkObserver
from satform.campaign.model import Campaign
from satform.campaign.results import CaseResult, Columns, Kind, failure_text
from satform.campaign.stacked_cases import Case, fly_stack, stacks
from satform.common.angle_text import radians_of
from satform.common.name_list import listed
from satform.evaluation.evaluate import judge
from satform.evaluation.sampled_loops import sampled_loops
from satform.files.durable_file import reason_text
from satform.flight.simulate import simulate
from satform.numeric.elementwise import Array
from satform.record.archive import RECORD, save_record
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario, ScenarioError, save_scenario
from satform.scenario.expectation import Verdict
from satform.scenario.loader import SCENARIO_FILE

FEWEST_IN_A_STACK = 2
"""Cases from which on they are flown as one formation."""

_LOG = logging.getLogger(__name__)
"""Python writes exceptions to standard error unless told otherwise: `workers.log` of a local campaign."""


def fly_chunk(
    campaign: Campaign,
    numbers: Sequence[int],
    observer: ChunkObserver | None = None,
    records: str | None = None,
) -> list[CaseResult]:
    """Fly cases of a campaign. Each result depends on the campaign and the number alone.

    Args:
        campaign: that they belong to.
        numbers: of the cases.
        observer: what to report to meanwhile; None for nothing.
        records: existing folder for the records that the campaign retains; None to retain none.

    Returns:
        A result for each case, in the order of the numbers. A case that cannot be flown has the reason in its
        result.
    """
    found: dict[int, CaseResult] = {}
    alone = records is not None and campaign.keep.record == "always"
    for cases in [] if alone or len(numbers) < FEWEST_IN_A_STACK else _stacks(campaign, numbers):
        if observer is not None:
            observer.begin([case.number for case in cases])
        flown = _stacked_results(campaign, cases, records, observer)
        if observer is not None and flown:
            observer.finished(flown)
        found.update({result.number: result for result in flown})
    for number in numbers:
        if number in found:
            continue
        if observer is not None:
            observer.begin([number])
        found[number] = fly_case(campaign, number, records)
        if observer is not None:
            observer.finished([found[number]])
    return [found[number] for number in numbers]


def _stacks(campaign: Campaign, numbers: Sequence[int]) -> list[list[Case]]:
    """Cases that can be flown together; none if a user's own part raises an exception."""
    try:
        return stacks(campaign, numbers)
    except Exception:  # of a user's own part: each case is flown alone, and says what is wrong with it
        _LOG.exception("cases %s are flown one by one", listed([str(number) for number in numbers]))
        return []


def _stacked_results(
    campaign: Campaign, cases: Sequence[Case], records: str | None, observer: ChunkObserver | None
) -> list[CaseResult]:
    """Results of cases flown as one formation; of none that ended early, or whose record is retained."""
    try:
        flown = fly_stack(campaign, cases, None if observer is None else observer.advanced)
    except Exception:  # of a user's own part: each case is flown alone, and says what is wrong with it
        _LOG.exception("cases %s are flown one by one", listed([str(case.number) for case in cases]))
        return []
    results = [_result(campaign, own.case, own.figures, series=own.series) for own in flown]
    return [result for result in results if records is None or not is_retained(campaign, result)]


def _result(campaign: Campaign, case: Case, figures: Sequence[float], series: dict[str, Array]) -> CaseResult:
    """The result of a case that was flown in a stack to its end."""
    measured = zip(campaign.measured(case.scenario), figures, strict=True)
    verdicts = [expectation.verdict(figure) for expectation, figure in measured]
    return replace(_judged(campaign, case.number, verdicts, ""), stacked=True, series=series)


def _judged(campaign: Campaign, number: int, verdicts: Sequence[Verdict], early_end: str) -> CaseResult:
    """The result of a case by the verdicts of the campaign's figures and the scenario's expectations."""
    names, own = campaign.figure_names, len(campaign.figures)
    judged = dict(zip(names[own:], verdicts[own:], strict=True))
    reason = reason_of(early_end, judged)
    return CaseResult(
        number=number,
        changes=case_values(campaign, number),
        figures={name: verdict.figure for name, verdict in zip(names, verdicts, strict=True)},
        met={name: verdict.met for name, verdict in judged.items()},
        success=not reason,
        reason=reason,
    )


def fly_case(campaign: Campaign, number: int, records: str | None = None) -> CaseResult:
    """Fly one case alone; as `fly_chunk`."""
    changes = case_values(campaign, number)
    try:
        scenario = case_scenario(campaign, number)
        record = simulate(scenario)
        result = result_of(campaign, number, scenario, record)
    except ScenarioError as error:
        sentences = "; ".join(
            f"{found.field or found.file}: {found.sentence}" for found in error.problems[:3]
        )
        return CaseResult(number, changes, reason=f"the scenario cannot be flown: {sentences}")
    except MemoryError as error:
        return CaseResult(number, changes, reason=failure_text(error), lost=True)
    except Exception as error:  # of a user's own controller, curve, model or figure
        return CaseResult(number, changes, reason=failure_text(error))
    if records is None or not is_retained(campaign, result):
        return result
    return with_record(result, scenario, record, Path(records))


def result_of(campaign: Campaign, number: int, scenario: Scenario, record: FlightRecord) -> CaseResult:
    """The result of a case by the record of its whole flight.

    Args:
        campaign: that it belongs to.
        number: of the case.
        scenario: of the case.
        record: of its flight.
    """
    expectations = campaign.measured(scenario)
    verdicts = judge(expectations, record, lambda: sampled_loops(scenario), scenario.setting)
    return replace(
        _judged(campaign, number, verdicts, record.early_end.sentence if record.early_end else ""),
        state_hash=record.digest() if record.steps else None,
        series=retained_series(campaign, record),
    )


def reason_of(early_end: str, judged: dict[str, Verdict]) -> str:
    """Why a case is no success, in a sentence without a full stop; empty when it is one.

    Args:
        early_end: sentence about an early end; empty when there was none.
        judged: verdicts of the scenario's expectations by the name of the figure.
    """
    missed = [name for name, verdict in judged.items() if not verdict.met]
    return early_end or (f"not as expected: {'; '.join(missed)}" if missed else "")


def retained_series(campaign: Campaign, record: FlightRecord) -> dict[str, Array]:
    """The series of a flight that the campaign retains, by name of the quantity, shape (T, N, ...)."""
    series, flight = campaign.keep.decimated(record.step), FlightBlock.of(record)
    for own in series.values():
        own.update(flight)
    return {name: own.series()[0] for name, own in series.items()}


def is_retained(campaign: Campaign, result: CaseResult) -> bool:
    """Whether the campaign retains the record of a case with such a result."""
    wanted = campaign.keep.record
    return wanted == "always" or (wanted == "on_failure" and not result.success)


def with_record(result: CaseResult, scenario: Scenario, record: FlightRecord, folder: Path) -> CaseResult:
    """Store the record of a case as the folder of a run, which `satform report` opens.

    Args:
        result: of the case.
        scenario: of the case.
        record: of its flight.
        folder: for all retained records.

    Returns:
        The result with the path of the record; without it where the record cannot be stored, which is written
        to a file beside it.
    """
    run = folder / f"case-{result.number:08d}"
    try:
        run.mkdir(exist_ok=True)
        save_scenario(scenario, run / SCENARIO_FILE)
        save_record(record, run / RECORD)
    except OSError as error:
        with suppress(OSError):
            (folder / "not_stored.txt").write_text(f"{run}: {reason_text(error, run)}\n", encoding="utf-8")
        return result
    return replace(result, record_path=f"{folder.name}/{run.name}")


def columns_of(campaign: Campaign) -> Columns:
    """The columns that the results of all cases of a campaign have."""
    kinds: dict[str, Kind] = {}
    for dispersion, found in zip(campaign.dispersions, campaign.targets, strict=True):
        texts = [value for value in dispersion.values() if isinstance(value, str)]
        for target in found:
            has_text = any(radians_of(text, target.angle) is None for text in texts)
            boolean: Kind = "boolean" if target.types == {bool} else "text"
            kinds[target.text] = "number" if target.is_number and not has_text else boolean
    kinds["seed"] = "integer"
    names = campaign.figure_names
    measured = zip(names, campaign.measured(campaign.base), strict=True)
    of_loops = tuple(name for name, measure in measured if measure.of_loops)
    return Columns(kinds, names, names[len(campaign.figures) :], of_loops)
