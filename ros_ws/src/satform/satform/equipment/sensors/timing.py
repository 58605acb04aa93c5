# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""When a sensor measures, and how late its readings arrive."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SensorTiming:
    """Schedule of a sensor in steps of the flight.

    Attributes:
        period: steps between two readings, at least 1; the first one is at step 0.
        latency: steps from a reading to its arrival, at least 0.
        outages: first step of each, and the first step after it.
    """

    period: int = 1
    latency: int = 0
    outages: tuple[tuple[int, int], ...] = ()

    def is_due(self, step: int) -> bool:
        """Whether a reading is taken at a step."""
        return step % self.period == 0 and not any(begin <= step < end for begin, end in self.outages)


def whole_steps(name: str, duration: float, step: float) -> int:
    """A duration in control periods.

    Args:
        name: of the field, for the error.
        duration: s.
        step: control period, s.

    Raises:
        ValueError: the duration is not a whole number of control periods.
    """
    ratio = duration / step
    if abs(ratio - round(ratio)) > 1e-6 * max(1.0, ratio):
        nearest = max(1, round(ratio)) * step
        raise ValueError(
            f"{name} {duration:g} s is {ratio:g} control periods of {step:g} s; it has to be a whole number, "
            f"for example {nearest:g} s"
        )
    return round(ratio)
