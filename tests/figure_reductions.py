# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Reductions of arrays of figures: of what is known, of each satellite, and in time."""

import math

import numpy as np


def length(vectors: np.ndarray) -> np.ndarray:
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.sqrt(x * x + y * y + z * z)


def numbers(values: np.ndarray | None) -> list[float]:
    return [] if values is None else [own for own in np.ravel(values).tolist() if not math.isnan(own)]


def greatest(values: np.ndarray | None) -> float:
    return max(numbers(values), default=math.nan)


def least(values: np.ndarray | None) -> float:
    return min(numbers(values), default=math.nan)


def total(values: list[float]) -> float:
    found = 0.0
    for own in values:
        found += own
    return found


def by_satellite(values: np.ndarray | None) -> list[list[float]]:
    return [] if values is None else [numbers(values[:, n]) for n in range(values.shape[1])]


def mean(values: np.ndarray | None) -> float:
    columns = by_satellite(values)
    count = sum(map(len, columns))
    return total([total(own) for own in columns]) / count if count else math.nan


def settles(within: list[bool], step: float) -> float:
    outside = [k for k, own in enumerate(within) if not own]
    first = outside[-1] + 1 if outside else 0
    return first * step if first < len(within) else math.nan


def first(reached: list[bool], step: float) -> float:
    return reached.index(True) * step if True in reached else math.nan
