# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Check of the covariance in a received estimate: no estimate has an error of negative variance."""

from typing import Any

import numpy as np

from satform.numeric.positive_definite import NotPositiveDefiniteError, cholesky

NOT_A_COVARIANCE = "a covariance that is not positive semidefinite"
"""Reason for the rejection of an estimate."""

_ROUND_OFF = 1e-9
"""Largest negative eigenvalue of correlations that counts as round-off."""


def covariance_complaint(numbers: tuple[Any, ...]) -> str:
    """Why the covariance in a message `NavigationEstimate` is none; empty if it is one.

    One that is zero says that there is no estimate. The test is a Cholesky factorisation of the correlations,
    so that it does not depend on units.

    Args:
        numbers: all fields of the message: stamp, step, length and numbers of the mean, length and upper
            triangle of the covariance row by row, acceleration.
    """
    size = int(numbers[3])
    upper = np.array(numbers[5 + size : 5 + size + size * (size + 1) // 2], dtype=np.float64)
    matrix = np.zeros((size, size))
    matrix[np.triu_indices(size)] = upper
    variance = np.diagonal(matrix)
    if (variance < 0.0).any():
        return NOT_A_COVARIANCE
    # What has no variance is correlated with nothing; such a row is not scaled.
    scale = np.sqrt(np.where(variance > 0.0, variance, 1.0))
    correlation = matrix.T / scale[:, None] / scale
    try:
        cholesky(correlation + _ROUND_OFF * np.eye(size))
    except NotPositiveDefiniteError:
        return NOT_A_COVARIANCE
    return ""
