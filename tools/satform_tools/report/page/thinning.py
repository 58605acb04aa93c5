# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Decimates long series for a page by the extremes of each interval, so that no peak is lost."""

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array


def extremes(values: Array, stretches: int) -> NDArray[np.int64]:
    """Indices of a decimated series: the smallest and the largest value of each short interval.

    Args:
        values: shape (K,); NaN is ignored.
        stretches: into which it is cut, at least one.

    Returns:
        Ascending indices, at most two for each stretch besides the first and the last of the series.
    """
    count = len(values)
    if count <= 2 * stretches + 2:
        return np.arange(count)
    length = -(-count // stretches)
    padded = np.full(-(-count // length) * length, np.nan)
    padded[:count] = values
    rows = padded.reshape(-1, length)
    unknown = np.isnan(rows)
    smallest = np.where(unknown, np.inf, rows).argmin(axis=1)
    largest = np.where(unknown, -np.inf, rows).argmax(axis=1)
    starts = np.arange(len(rows)) * length
    return np.unique(np.concatenate(([0], starts + smallest, starts + largest, [count - 1])))
