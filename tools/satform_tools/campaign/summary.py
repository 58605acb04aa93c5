# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What came of a campaign: success rate, verdicts, figures, failures, and the hash over all results."""

import math
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from satform.campaign.chunk import is_retained
from satform.campaign.expectations import CampaignVerdict, judge
from satform.campaign.folder import CampaignFolder
from satform.campaign.model import Campaign
from satform.campaign.result_files import ResultFile, result_files
from satform.campaign.results import CaseResult, ResultsHash
from satform.campaign.statistics import success_rate
from satform.common.exit_codes import EXIT_DONE, EXIT_LOST, EXIT_MISSED, EXIT_STOPPED
from satform.numeric.elementwise import Array

CONFIDENCE = 0.95
"""Of the interval of the success rate."""

MOST_FAILURES = 100
"""Failed cases that are listed one by one."""

_MOST_AT_ONCE = 5000
"""Results that are held at once."""

_MOST_KINDS = 1000
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])", re.IGNORECASE)

NOTHING_FLOWN = "there is no success rate and no figure yet"
"""What a campaign has of which no case is flown."""

PERCENTILES = (5.0, 50.0, 95.0)


@dataclass(frozen=True)
class FigureSummary:
    """A figure over all cases that have it.

    Attributes:
        name: of the figure.
        unit: of the figure.
        cases: that have it.
        minimum: NaN where none has it, as all that follow.
        percentiles: 5 %, 50 % and 95 %.
        maximum: of the figure.
        mean: of the figure.
        met: cases that met its limit; None where it has none.
    """

    name: str
    unit: str
    cases: int
    minimum: float
    percentiles: tuple[float, ...]
    maximum: float
    mean: float
    met: int | None


@dataclass(frozen=True)
class Failure:
    """A case that was no success.

    Attributes:
        number: of the case.
        reason: in a sentence without a full stop.
        record: folder of its record; empty where none is retained.
        lost: whether the machine and not the flight ended it.
    """

    number: int
    reason: str
    record: str
    lost: bool


@dataclass(frozen=True)
class Speed:
    """How fast cases were flown.

    Attributes:
        cases: flown by this command.
        seconds: of wall-clock time.
        workers: processes that flew them.
        engine: name of the engine.
    """

    cases: int
    seconds: float
    workers: int
    engine: str


@dataclass(frozen=True)
class Summary:
    """What came of a campaign.

    Attributes:
        folder: of the campaign.
        campaign: that was flown.
        flown: cases that have a result.
        succeeded: cases that were a success.
        rate: success rate of the flown cases and the limits of its 95 % interval (Wilson), NaN where the
            sampling is not random.
        lost: cases that a timeout or the end of a worker process ended.
        stacked: cases that were flown in stacks.
        records_missing: cases whose record the campaign retains, and could not be stored.
        verdicts: one for each expectation of the campaign.
        figures: one for each figure.
        kinds: reasons without their numbers, and how many cases have each; the most frequent first.
        failures: the first failed cases.
        results_hash: over all results; None while cases are missing or lost.
        result_files: files of results that were read. While cases are flown more are written; whatever is
            computed for the same report reads these alone.
        stopped: whether the user stopped it.
        reason: why cases are missing, in a sentence; empty when none are or it was stopped.
        speed: None where nothing was flown.
        files: of its report, the page first; empty where none is written.
    """

    folder: CampaignFolder
    campaign: Campaign
    flown: int
    succeeded: int
    rate: tuple[float, float, float]
    lost: int
    stacked: int
    records_missing: int
    verdicts: Sequence[CampaignVerdict]
    figures: Sequence[FigureSummary]
    kinds: Mapping[str, int]
    failures: Sequence[Failure]
    results_hash: str | None
    result_files: Sequence[ResultFile]
    stopped: bool = False
    reason: str = ""
    speed: Speed | None = None
    files: Sequence[Path] = ()

    @property
    def cases(self) -> int:
        """Number of all cases."""
        return self.folder.manifest.cases

    @property
    def complete(self) -> bool:
        """Whether every case has a result."""
        return self.flown == self.cases

    @property
    def failed(self) -> int:
        """Cases that were no success."""
        return self.flown - self.succeeded

    @property
    def exit_code(self) -> int:
        """As expected, expectation missed, something lost, or stopped by the user."""
        if self.stopped:
            return EXIT_STOPPED
        if self.reason or not self.complete:
            return EXIT_LOST
        return EXIT_DONE if all(verdict.met for verdict in self.verdicts) else EXIT_MISSED

    @property
    def file(self) -> str:
        """File of the campaign, to be named on the command line."""
        return self.folder.manifest.file or str(self.folder.path / "campaign.json")

    def batches(self) -> Iterator[list[CaseResult]]:
        """All results in order of their numbers, some thousand at a time.

        Raises:
            OSError: a file of results cannot be read.
            ResultFileError: a file of results is damaged.
        """
        results = self.folder.results(self.result_files)
        while batch := list(islice(results, _MOST_AT_ONCE)):
            yield batch

    def command(self, number: int) -> str:
        """The command that flies a case with the values that it has in the folder."""
        folder = shlex.quote(str(self.folder.path.absolute()))
        return f"satform run --campaign {folder} --case {number}"

    def data(self) -> dict[str, Any]:
        """Everything, for `summary.json` and `--json`."""
        rate, low, high = self.rate
        return {
            "campaign": self.campaign.name,
            "title": self.campaign.title,
            "file": self.file,
            "folder": str(self.folder.path),
            "digest": self.folder.manifest.digest,
            "cases": self.cases,
            "flown": self.flown,
            "complete": self.complete,
            "succeeded": self.succeeded,
            "failed": self.failed,
            "success_rate": {"estimate": rate, "low": low, "high": high, "confidence": CONFIDENCE},
            "lost": self.lost,
            "stacked": self.stacked,
            "records_missing": self.records_missing,
            "expectations": [asdict(verdict) for verdict in self.verdicts],
            "figures": [asdict(figure) for figure in self.figures],
            "reasons": dict(self.kinds),
            "failures": [
                {**asdict(failure), "command": self.command(failure.number)} for failure in self.failures
            ],
            "results_hash": self.results_hash,
            "stopped": self.stopped,
            "reason": self.reason,
            "exit_code": self.exit_code,
            "speed": None if self.speed is None else asdict(self.speed),
            "started": self.folder.manifest.started,
            "versions": dict(self.folder.manifest.versions),
            "report": str(self.files[0]) if self.files else None,
            "files": [str(file) for file in self.files],
        }


@dataclass
class _Gathered:
    """What one pass over the results gathers."""

    flown: int = 0
    lost: int = 0
    stacked: int = 0
    records_missing: int = 0
    kinds: dict[str, int] = field(default_factory=dict)
    failures: list[Failure] = field(default_factory=list)


def summarise(
    folder: CampaignFolder,
    campaign: Campaign,
    *,
    stopped: bool = False,
    reason: str = "",
    speed: Speed | None = None,
) -> Summary:
    """What came of a campaign so far.

    Args:
        folder: of the campaign.
        campaign: that is flown there.
        stopped: whether the user stopped it.
        reason: why cases are missing; empty for none.
        speed: how fast cases were flown.

    Raises:
        OSError: a file of results cannot be read.
        ResultFileError: a file of results is damaged.
    """
    columns = folder.manifest.columns
    count = folder.manifest.cases
    found, hashed = _Gathered(), ResultsHash(columns)
    success = np.zeros(count, dtype=np.bool_)
    figures = {name: np.empty(count) for name in columns.figures}
    met = dict.fromkeys(columns.judged, 0)
    files = result_files(folder.path)
    for row, result in enumerate(folder.results(files)):
        hashed.add(result)
        success[row] = result.success
        for name, value in result.figures.items():
            figures[name][row] = value
        for name, is_met in result.met.items():
            met[name] += is_met
        found.flown = row + 1
        found.lost += result.lost
        found.stacked += result.stacked
        # One that could not be flown has no record.
        has_none = result.record_path is None and result.state_hash is not None
        found.records_missing += has_none and is_retained(campaign, result)
        if not result.success:
            _add_failure(found, Failure(result.number, result.reason, result.record_path or "", result.lost))
    success = success[: found.flown]
    figures = {name: values[: found.flown] for name, values in figures.items()}
    units, is_random = campaign.figure_units, campaign.sampling.is_random
    return Summary(
        folder=folder,
        campaign=campaign,
        flown=found.flown,
        succeeded=int(np.count_nonzero(success)),
        rate=rate_of(success, is_random=is_random),
        lost=found.lost,
        stacked=found.stacked,
        records_missing=found.records_missing,
        verdicts=judge(campaign.expect, success, figures, units, is_random=is_random) if found.flown else (),
        figures=[
            _figure(name, units.get(name, ""), values, met.get(name)) for name, values in figures.items()
        ],
        kinds=dict(sorted(found.kinds.items(), key=lambda kind: (-kind[1], kind[0]))),
        failures=found.failures,
        results_hash=hashed.hexdigest() if found.flown == count and not found.lost else None,
        result_files=files,
        stopped=stopped,
        reason=reason,
        speed=speed,
    )


def rate_of(success: NDArray[np.bool_], *, is_random: bool) -> tuple[float, float, float]:
    """Success rate of cases, shape (R,), and the limits of its 95 % interval, NaN if they are not random."""
    rate, low, high = success_rate(success, CONFIDENCE, "wilson")
    return (rate, low, high) if is_random else (rate, math.nan, math.nan)


def interval_text(low: float, high: float, form: str) -> str:
    """An interval with its numbers in a format, as `0.1 to 0.2`; empty where there is none."""
    return "" if math.isnan(low) and math.isnan(high) else f"{low:{form}} to {high:{form}}"


def kind_of(reason: str) -> str:
    """A reason without its numbers, so that equal failures of different cases are counted as one kind."""
    return _NUMBER.sub("...", reason.partition("; likely cause")[0])


def _add_failure(found: _Gathered, failure: Failure) -> None:
    if len(found.failures) < MOST_FAILURES:
        found.failures.append(failure)
    kind = kind_of(failure.reason)
    if kind not in found.kinds and len(found.kinds) >= _MOST_KINDS:
        kind = "other reasons"
    found.kinds[kind] = found.kinds.get(kind, 0) + 1


def _figure(name: str, unit: str, values: Array, met: int | None) -> FigureSummary:
    known = values[np.isfinite(values)]
    if not known.size:
        nothing = float("nan")
        return FigureSummary(name, unit, 0, nothing, (nothing,) * len(PERCENTILES), nothing, nothing, met)
    return FigureSummary(
        name=name,
        unit=unit,
        cases=len(known),
        minimum=float(known.min()),
        percentiles=tuple(float(value) for value in np.percentile(known, PERCENTILES)),
        maximum=float(known.max()),
        mean=float(known.mean()),
        met=met,
    )
