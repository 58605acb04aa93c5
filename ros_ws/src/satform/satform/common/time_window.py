# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Stretches of simulated time, such as outages of links and sensors."""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from satform.common.spec import NonNegative, Spec

_SLACK = 1e-9
"""Part by which times of steps may be rounded down."""


class Window(Spec):
    """A stretch of simulated time."""

    begin: NonNegative
    """First moment of it, s."""
    end: NonNegative
    """First moment after it, s."""

    @model_validator(mode="after")
    def _forward(self) -> "Window":
        if self.end <= self.begin:
            raise ValueError(f"end {self.end:g} s is not later than begin {self.begin:g} s")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """First time in it and first time after it, s, earlier by a rounding of times of steps."""
        return self.begin * (1.0 - _SLACK), self.end * (1.0 - _SLACK)

    def covers(self, time: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether times, s, lie in it, but for a rounding."""
        begin, end = self.bounds
        return np.asarray((begin <= time) & (time < end))

    def steps(self, step: float) -> tuple[int, int]:
        """First step in it and first step after it, of a control period in s."""
        begin, end = self.bounds
        return math.ceil(begin / step), math.ceil(end / step)
