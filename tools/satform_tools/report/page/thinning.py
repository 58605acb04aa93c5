# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Long series made short enough for a page, with every peak and every trough kept."""

import numpy as np
from numpy.typing import NDArray

from satform.numeric.elementwise import Array


def extremes(values: Array, stretches: int) -> NDArray[np.int64]:
    """Places of a series that show it like the whole: the smallest and the largest of each short stretch.

    Args:
        values: shape (K,); what is not a number is passed over.
        stretches: into which it is cut, at least one.

    Returns:
        Ascending places, at most two for each stretch besides the first and the last of the series.
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
