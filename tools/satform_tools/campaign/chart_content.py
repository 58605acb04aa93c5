# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the charts of a page and the figures of exports both show: which pairs and cases, axes and limits."""

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array
from satform_tools.campaign.envelopes import Envelope
from satform_tools.campaign.report_statistics import (
    WIDE,
    Correlation,
    Histogram,
    ReportStatistics,
    is_wide_range,
)

MOST_SCATTERS = 12
"""Pairs of an input and a figure that are drawn."""

MOST_POINTS = 1000
"""Cases in a scatter plot."""


def drawn_pairs(statistics: ReportStatistics) -> list[Correlation]:
    """The strongest pairs of an input and a figure, which are drawn case by case."""
    return [pair for pair in statistics.correlations if not pair.of_success][:MOST_SCATTERS]


def scatter_of(
    pair: Correlation, statistics: ReportStatistics
) -> tuple[NDArray[np.int64], Array, Array, NDArray[np.bool_]]:
    """Numbers of the cases, input, figure and success of a pair, of at most as many cases as are drawn."""
    sample = statistics.sample
    first, second = sample.inputs[pair.input], sample.figures[pair.figure]
    rows = np.flatnonzero(np.isfinite(first) & np.isfinite(second))
    if len(rows) > MOST_POINTS:
        rows = np.sort(np.random.default_rng(0).choice(rows, MOST_POINTS, replace=False))
    return sample.numbers[rows], first[rows], second[rows], sample.success[rows]


def is_wide(values: Array) -> bool:
    """Whether values need a logarithmic axis."""
    known = values[np.isfinite(values)]
    return bool(known.size) and is_wide_range(float(known.min()), float(known.max()))


def is_near(value: float, found: Histogram) -> bool:
    """Whether a limit can be drawn and leaves room for the cases."""
    low, high = float(found.edges[0]), float(found.edges[-1])
    if found.logarithmic:
        return low / WIDE <= value <= high * WIDE
    return low - (high - low) <= value <= high + (high - low)


def with_unit(name: str, unit: str) -> str:
    """The title of an axis."""
    return f"{name} [{unit}]" if unit else name


def members_text(found: Envelope) -> str:
    """How many members an envelope has."""
    least, most = int(found.members.min()), int(found.members.max())
    counted = f"{most} members" if least == most else f"{least} to {most} members"
    return f"{counted}: the satellites of {found.cases} cases."
