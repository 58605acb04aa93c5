# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How near the straight line between two satellites comes to the Earth."""

import numpy as np

from satform.numeric.elementwise import Array, dot, norm


def line_of_sight_distance(first: Array, second: Array) -> Array:
    """Least distance of the segment between two positions from the Earth's centre.

    Args:
        first: from the Earth's centre, m, shape (..., 3).
        second: likewise.

    Returns:
        m, shape (...).
    """
    between = second - first
    squared = dot(between, between)
    along = np.clip(-dot(first, between) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
    return norm(first + along[..., None] * between)
