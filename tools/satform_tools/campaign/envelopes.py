# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Percentiles over time of what a campaign retains, in memory that does not grow with the number of cases."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.campaign.model import Campaign
from satform.campaign.result_files import all_series
from satform.campaign.retained_data import RetainedSeries
from satform.numeric.elementwise import Array
from satform.record.derived import COLUMNS
from satform_tools.campaign.summary import PERCENTILES, Summary

MOST_SAMPLED = 5000
"""Cases from which an envelope is computed; of more a random sample."""

MOST_TIMES = 200
"""Times at which an envelope is computed."""

_MOST_VALUES = 4_000_000
"""Numbers of a series in memory for an envelope, unless one case alone has more."""

_MOST_COMPONENTS = 3
_SEED = 20260101


@dataclass(frozen=True)
class Envelope:
    """Percentiles of a retained quantity over time; every satellite of every case is one member.

    Attributes:
        quantity: name of the quantity, with its component.
        unit: of it.
        time: s, shape (T,).
        percentiles: 5 %, 50 % and 95 %, shape (T, 3).
        members: shape (T,); fewer where flights ended early.
        cases: from which it is computed.
    """

    quantity: str
    unit: str
    time: Array
    percentiles: Array
    members: NDArray[np.int64]
    cases: int


def sampled_cases(cases: int, most: int) -> NDArray[np.int64]:
    """Numbers of the cases that are sampled, ascending: all, or a random choice that is always the same."""
    if cases <= most:
        return np.arange(cases)
    chosen = np.random.default_rng(_SEED).choice(cases, most, replace=False)
    return np.sort(chosen).astype(np.int64)


class _Members:
    """Values of one quantity at the times of its envelope, one member for each satellite of each case."""

    def __init__(self, series: RetainedSeries, campaign: Campaign) -> None:
        timing = campaign.base.timing
        stride = series.stride(timing.step)
        rows = timing.steps // stride + 1
        self.rows = np.unique(np.linspace(0, rows - 1, min(rows, MOST_TIMES)).round().astype(np.int64))
        self.time: Array = (self.rows * stride).astype(np.float64) * timing.step
        self.values_of_cases: list[Array] = []

    def add(self, series: Array) -> None:
        """Take the series of a case, shape (K, N, ...)."""
        flat = series.reshape(len(series), series.shape[1], -1) if series.ndim > 1 else series[:, None, None]
        if flat.shape[2] > _MOST_COMPONENTS:
            flat = np.max(np.abs(flat), axis=2, keepdims=True)
        values = np.full((len(self.rows), *flat.shape[1:]), np.nan)
        rows = self.rows[self.rows < len(flat)]
        values[: len(rows)] = flat[rows]
        self.values_of_cases.append(values)

    def envelopes(self, quantity: str) -> Iterator[Envelope]:
        """An envelope of each component."""
        values = np.concatenate(self.values_of_cases, axis=1)
        components = values.shape[2]
        for component in range(components):
            suffix = f" {'xyz'[component]}" if components > 1 else ""
            name, unit = quantity.replace("_", " ") + suffix, COLUMNS[quantity].unit
            members = [row[np.isfinite(row)] for row in values[:, :, component]]
            known = [index for index, row in enumerate(members) if len(row)]
            if known:
                yield Envelope(
                    quantity=name,
                    unit=unit,
                    time=self.time[known],
                    percentiles=np.array([np.percentile(members[index], PERCENTILES) for index in known]),
                    members=np.array([len(members[index]) for index in known]),
                    cases=len(self.values_of_cases),
                )


def envelopes(summary: Summary) -> Iterator[Envelope]:
    """The envelopes of all retained series, component by component.

    Args:
        summary: of the campaign, whose files of results are read.

    Raises:
        OSError: a file of results cannot be read.
        ResultFileError: a file of results is damaged.
    """
    campaign = summary.campaign
    if not campaign.keep.series:
        return
    most = _MOST_VALUES // (MOST_TIMES * len(campaign.base.satellites) * _MOST_COMPONENTS)
    chosen = set(sampled_cases(summary.cases, min(MOST_SAMPLED, max(most, 1))).tolist())
    members = {series.quantity: _Members(series, campaign) for series in campaign.keep.series}
    for number, found in all_series(summary.folder.path, summary.result_files):
        if number in chosen:
            for quantity, values in found.items():
                if quantity in members:
                    members[quantity].add(values)
    for quantity, own in members.items():
        if own.values_of_cases:
            yield from own.envelopes(quantity)
