# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""An estimate with its uncertainty."""

from dataclasses import dataclass

from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class GaussianEstimate:
    """A state that is taken to be normally distributed.

    Attributes:
        mean: shape (D,).
        covariance: of the error, shape (D, D).
    """

    mean: Array
    covariance: Array
