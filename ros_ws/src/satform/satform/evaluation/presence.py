# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of satellites that are lost and come back."""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.spec import Positive
from satform.evaluation.tracking import arc_length_spread, settled
from satform.record.flight_record import FlightRecord
from satform.scenario.expectation import Expectation, OverWindow, largest
from satform.scenario.parts import Timing


class StepsAbsent(OverWindow):
    """Steps in which a satellite does not fly, the most of the satellites."""

    kind: Literal["steps_absent"] = "steps_absent"

    def measure(self, record: FlightRecord) -> float:
        absent = self.window(record.absent.astype(np.float64), record, held=True, of_bodies=True)
        return largest(absent.sum(axis=0)) if absent.size else math.nan

    def describe(self) -> str:
        return self.label or f"steps absent{self.when()}{self.whose()}"


class RejoinTime(Expectation):
    """Time from a satellite's last return until the spread of all arc lengths is small for good, in s."""

    unit = "s"
    kind: Literal["rejoin_time"] = "rejoin_time"
    satellite: Annotated[str, Field(min_length=1)]
    """Name of the satellite that comes back."""
    within: Positive
    """Spread of the generalised arc lengths that counts as being together, m."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = []
        if self.satellite not in satellites:
            own.append(f"there is no satellite {self.satellite}; there are {', '.join(sorted(satellites))}")
        return super().complaints(satellites, timing) + own

    def measure(self, record: FlightRecord) -> float:
        absent = np.flatnonzero(record.absent[:, record.satellites.index(self.satellite)])
        back = int(absent[-1]) + 1 if absent.size else record.steps
        # A satellite that was never lost, or is not back, does not join again.
        return settled(arc_length_spread(record)[back:-1], self.within, record.step)

    def describe(self) -> str:
        return self.label or f"{self.satellite} is back among the others to {self.within:g} m"
