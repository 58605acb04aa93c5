# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Statistics of a campaign for its report: histograms, rank correlations, success by value, envelopes.

Memory does not grow with the number of cases: what is counted is counted over all cases in one pass, and what
needs the values themselves takes a random sample of the cases, the same in every report.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from satform.campaign.model import Campaign
from satform.campaign.results import CaseResult, ChangeValue
from satform.numeric.elementwise import Array
from satform_tools.campaign.envelopes import MOST_SAMPLED, Envelope, envelopes, sampled_cases
from satform_tools.campaign.summary import FigureSummary, Summary, rate_of

_MOST_BINS = 40
WIDE = 100.0
"""Positive values that differ by more than this factor have a logarithmic axis and bins of equal ratio."""

_FAR, _ROOM = 2.0, 0.5
"""A histogram shows all values up to so far from the middle 90 %, in the width of these; where there are
values beyond, it ends sooner."""

_MOST_VALUES_OF_AN_INPUT = 200


@dataclass(frozen=True)
class Input:
    """A dispersed field, or several of one draw.

    Attributes:
        name: of the dispersion, or path of the field.
        path: of the field.
        fields: that have this draw.
        values: to which it is set one by one; empty for a continuous distribution.
    """

    name: str
    path: str
    fields: int
    values: tuple[ChangeValue, ...]


@dataclass(frozen=True)
class Limit:
    """A limit of a figure, with the words that a chart prints beside it."""

    value: float
    text: str


@dataclass(frozen=True)
class Histogram:
    """How a figure is distributed over all cases that have it.

    Attributes:
        figure: its percentiles and number of cases.
        edges: of the bins, shape (B + 1,).
        counts: cases in each bin, shape (B,); the last bin has its upper edge, too.
        failed: cases among them that were no success, shape (B,).
        logarithmic: whether the bins have equal ratios.
        limits: that the scenario sets every case, and the campaign all of them together.
    """

    figure: FigureSummary
    edges: Array
    counts: NDArray[np.int64]
    failed: NDArray[np.int64]
    logarithmic: bool
    limits: tuple[Limit, ...]

    @property
    def outside(self) -> int:
        """Cases that have the figure, too far from all others to be in a bin."""
        return self.figure.cases - int(self.counts.sum())


@dataclass(frozen=True)
class Correlation:
    """Spearman's rank correlation of an input and a figure.

    Attributes:
        input: name of the input.
        figure: name of the figure; for success "success", or another name where a figure has this one.
        coefficient: from -1 to 1.
        p_value: probability of a coefficient at least as large without any dependence; NaN where the sampling
            is not random.
        cases: that it is computed from.
        significant: whether the p-value is below 5 % divided by the number of all pairs (Bonferroni).
        of_success: whether it is of success, 1 or 0, and of no figure.
    """

    input: str
    figure: str
    coefficient: float
    p_value: float
    cases: int
    significant: bool
    of_success: bool = False


@dataclass(frozen=True)
class RateByValue:
    """Success rate for each value of an input that has listed values.

    Attributes:
        input: the input.
        values: that were flown, in order.
        cases: flown with each.
        rates: success rate and limits of its 95 % interval (Wilson), shape (V, 3); the limits are NaN where
            the sampling is not random.
    """

    input: Input
    values: tuple[ChangeValue, ...]
    cases: tuple[int, ...]
    rates: Array


@dataclass(frozen=True)
class Sample:
    """Inputs and figures of sampled cases.

    Attributes:
        numbers: of the cases, shape (S,).
        success: of each, shape (S,).
        inputs: by name of the input, shape (S,); NaN where a case leaves it out. Inputs that are text are not
            among them.
        figures: by name, shape (S,).
    """

    numbers: NDArray[np.int64]
    success: NDArray[np.bool_]
    inputs: dict[str, Array]
    figures: dict[str, Array]


@dataclass(frozen=True)
class ReportStatistics:
    """What a report shows besides the summary.

    Attributes:
        summary: of the campaign.
        inputs: all that is dispersed.
        histograms: of the figures that some case has.
        sample: of the cases.
        correlations: strongest first.
        rates: success by value.
        envelopes: of the retained series.
    """

    summary: Summary
    inputs: tuple[Input, ...]
    histograms: tuple[Histogram, ...]
    sample: Sample
    correlations: tuple[Correlation, ...]
    rates: tuple[RateByValue, ...]
    envelopes: tuple[Envelope, ...]


@dataclass
class _Counts:
    """What one pass over all cases gathers."""

    histograms: dict[str, tuple[Array, NDArray[np.int64], NDArray[np.int64]]]
    by_value: dict[str, dict[ChangeValue, list[int]]]
    sampled: list[CaseResult] = field(default_factory=list)


def report_statistics(summary: Summary) -> ReportStatistics:
    """Compute the statistics of a campaign, complete or under way, from the files of results of its summary.

    Args:
        summary: of it.

    Raises:
        OSError: a file of results cannot be read.
        ResultFileError: a file of results is damaged.
    """
    campaign = summary.campaign
    inputs = inputs_of(campaign)
    known = [figure for figure in summary.figures if figure.cases]
    wanted = sampled_cases(summary.cases, MOST_SAMPLED)
    counts = _counted(summary, known, inputs, wanted)
    sample = _sample(counts.sampled, inputs, summary)
    return ReportStatistics(
        summary=summary,
        inputs=inputs,
        histograms=_histograms(campaign, known, counts),
        sample=sample,
        correlations=tuple(correlations(sample, is_random=campaign.sampling.is_random)),
        rates=tuple(_rates(inputs, counts.by_value, is_random=campaign.sampling.is_random)),
        envelopes=tuple(envelopes(summary)),
    )


def distributions(summary: Summary) -> tuple[Histogram, ...]:
    """The histograms of the figures that some case has, and nothing else.

    Args:
        summary: of the campaign.

    Raises:
        OSError: a file of results cannot be read.
        ResultFileError: a file of results is damaged.
    """
    known = [figure for figure in summary.figures if figure.cases]
    counts = _counted(summary, known, (), np.empty(0, dtype=np.int64))
    return _histograms(summary.campaign, known, counts)


def _histograms(campaign: Campaign, known: Sequence[FigureSummary], counts: _Counts) -> tuple[Histogram, ...]:
    return tuple(
        Histogram(
            figure,
            *counts.histograms[figure.name],
            logarithmic=_is_wide(figure),
            limits=limits_of(campaign, figure.name),
        )
        for figure in known
    )


def inputs_of(campaign: Campaign) -> tuple[Input, ...]:
    """All that is dispersed; fields that share a draw are one input."""
    found = []
    for dispersion, fields in zip(campaign.dispersions, campaign.targets, strict=True):
        # A path with one field is that field; of several each has its own path.
        parts = fields[:1] if dispersion.shared else fields
        for part in parts:
            name = dispersion.label if len(parts) == 1 else part.text
            if dispersion.name and len(parts) > 1:
                name = f"{dispersion.name}: {part.text}"
            count = len(fields) if dispersion.shared else 1
            values = dispersion.values() if dispersion.applied == "replace" else ()
            found.append(Input(name, part.text, count, values))
    return tuple(found)


def limits_of(campaign: Campaign, figure: str) -> tuple[Limit, ...]:
    """Limits of a figure: those of the scenario for every case, then those of the campaign for all."""
    found = []
    own = len(campaign.figures)
    index = campaign.figure_names.index(figure) - own
    if index >= 0:
        expected = campaign.base.expect[index]
        bounds = (expected.smallest_allowed, "lower limit"), (expected.largest_allowed, "upper limit")
        found += [Limit(value, text) for value, text in bounds if math.isfinite(value)]
    for wanted in campaign.expect:
        if getattr(wanted, "figure", None) == figure:
            for sign, value in (("≥", wanted.above), ("≤", wanted.below)):
                if value is not None:
                    found.append(Limit(value, f"{_statistic(wanted)} {sign} {value:g}"))
    return tuple(found)


def correlations(sample: Sample, *, is_random: bool) -> list[Correlation]:
    """Spearman's rank correlation of every input and figure, and of every input and success; strongest first.

    Pairs of which one is the same in all cases are left out, as are fewer than four cases. Without random
    sampling they have no p-value, and none is significant.
    """
    figures, success = dict(sample.figures), _name_of_success(sample)
    if 0 < np.count_nonzero(sample.success) < len(sample.success):
        figures[success] = sample.success.astype(np.float64)
    pairs = [
        (first, second, *found)
        for second, values in figures.items()
        for first, found in _correlated(sample.inputs, values)
    ]
    level = 0.05 / max(1, len(pairs))
    found = [
        Correlation(
            input=first,
            figure=second,
            coefficient=coefficient,
            p_value=p_value if is_random else math.nan,
            cases=cases,
            significant=is_random and p_value < level,
            of_success=second == success,
        )
        for first, second, coefficient, p_value, cases in pairs
    ]
    return sorted(found, key=lambda pair: (-abs(pair.coefficient), pair.figure, pair.input))


def _name_of_success(sample: Sample) -> str:
    """Name of success among the figures: one that no figure has."""
    name = "success"
    while name in sample.figures:
        name += " of the case"
    return name


def _correlated(inputs: dict[str, Array], figure: Array) -> Iterator[tuple[str, tuple[float, float, int]]]:
    from scipy.stats import spearmanr  # noqa: PLC0415 - slow to import

    has_figure = np.isfinite(figure)
    for name, values in inputs.items():
        both = has_figure & np.isfinite(values)
        first, second = values[both], figure[both]
        if len(first) >= 4 and np.ptp(first) > 0.0 and np.ptp(second) > 0.0:
            result = spearmanr(first, second)
            yield name, (float(result.statistic), float(result.pvalue), len(first))


def _statistic(wanted: object) -> str:
    percentile = getattr(wanted, "percentile", None)
    return "mean" if percentile is None else f"{percentile:g} % percentile"


def is_wide_range(minimum: float, maximum: float) -> bool:
    """Whether values between two numbers need a logarithmic axis."""
    return minimum > 0.0 and maximum > WIDE * minimum


def _is_wide(figure: FigureSummary) -> bool:
    if is_wide_range(figure.minimum, figure.maximum):
        return True
    # Many that are nearly zero, and a few that have grown.
    middle = figure.percentiles[1]
    return figure.minimum == 0.0 < middle and figure.maximum > WIDE * middle


def _range(figure: FigureSummary) -> tuple[float, float]:
    """The values that a histogram shows: all but a few that are far from all others."""
    low, middle, high = figure.percentiles
    if _is_wide(figure):
        return figure.minimum or low or middle / WIDE**3, figure.maximum
    span = high - low
    if span == 0.0:
        return figure.minimum, figure.maximum
    return (
        figure.minimum if figure.minimum >= low - _FAR * span else low - _ROOM * span,
        figure.maximum if figure.maximum <= high + _FAR * span else high + _ROOM * span,
    )


def _edges(figure: FigureSummary) -> Array:
    """Edges of the bins of a histogram."""
    low, high = _range(figure)
    if not low < high:
        room = max(abs(low) * 0.05, 1e-9)
        return np.array([low - room, low + room])
    count = min(_MOST_BINS, max(8, math.ceil(math.sqrt(figure.cases))))
    edges = np.geomspace(low, high, count + 1) if _is_wide(figure) else np.linspace(low, high, count + 1)
    # Rounded ends would leave the extremes out.
    edges[0], edges[-1] = low, high
    return edges


def _counted(
    summary: Summary,
    figures: Sequence[FigureSummary],
    inputs: Sequence[Input],
    wanted: NDArray[np.int64],
) -> _Counts:
    counts = _Counts({}, {})
    for figure in figures:
        edges = _edges(figure)
        counts.histograms[figure.name] = (edges, *np.zeros((2, len(edges) - 1), dtype=np.int64))
    listed = [found for found in inputs if 0 < len(found.values) <= _MOST_VALUES_OF_AN_INPUT]
    counts.by_value = {found.path: {} for found in listed}
    chosen = set(wanted.tolist())
    for results in summary.batches():
        success = np.array([result.success for result in results])
        for name, (edges, cases, failed) in counts.histograms.items():
            values = np.array([result.figures[name] for result in results])
            known = np.isfinite(values)
            cases[:] += np.histogram(values[known], edges)[0]
            failed[:] += np.histogram(values[known & ~success], edges)[0]
        for path, found in counts.by_value.items():
            for result in results:
                if path in result.changes:
                    entry = found.setdefault(result.changes[path], [0, 0])
                    entry[0] += 1
                    entry[1] += result.success
        counts.sampled += [result for result in results if result.number in chosen]
    return counts


def _sample(results: Sequence[CaseResult], inputs: Sequence[Input], summary: Summary) -> Sample:
    kinds = summary.folder.manifest.columns.changes
    return Sample(
        numbers=np.array([result.number for result in results], dtype=np.int64),
        success=np.array([result.success for result in results], dtype=np.bool_),
        inputs={
            found.name: np.array([float(result.changes.get(found.path, math.nan)) for result in results])
            for found in inputs
            if kinds[found.path] != "text"
        },
        figures={
            figure.name: np.array([result.figures[figure.name] for result in results])
            for figure in summary.figures
        },
    )


def _rates(
    inputs: Sequence[Input], by_value: dict[str, dict[ChangeValue, list[int]]], *, is_random: bool
) -> Iterator[RateByValue]:
    for found in inputs:
        counted = by_value.get(found.path, {})
        if len(counted) < 2:
            continue
        values = sorted(counted, key=lambda value: (isinstance(value, str), value))
        rates = [
            rate_of(np.arange(counted[value][0]) < counted[value][1], is_random=is_random) for value in values
        ]
        yield RateByValue(found, tuple(values), tuple(counted[value][0] for value in values), np.array(rates))
