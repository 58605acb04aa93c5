# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a campaign stores of each case beside its figures: series over time, flight records and bags."""

from typing import Literal

from pydantic import model_validator

from satform.common.spec import Positive, Spec
from satform.record.derived import COLUMNS
from satform.record.series import DecimatedSeries
from satform.scenario.field_errors import nearest
from satform.scenario.parts import Timing

When = Literal["never", "on_failure", "always"]


class RetainedSeries(Spec):
    """A quantity of the flight that is stored over time."""

    quantity: str
    """Name of the quantity, as in a flight record."""
    every: Positive | None = None
    """Time between two stored values, s; every step when left out."""

    @model_validator(mode="after")
    def _is_known(self) -> "RetainedSeries":
        if self.quantity not in COLUMNS:
            raise ValueError(
                f"there is no quantity {self.quantity!r}{nearest(self.quantity, sorted(COLUMNS))}"
            )
        return self

    def stride(self, step: float) -> int:
        """Rows of the flight record from one that is stored to the next.

        Args:
            step: control period of the flight, s.
        """
        return 1 if self.every is None else max(1, round(self.every / step))


class Keep(Spec):
    """What is stored of each case beside its figures."""

    series: tuple[RetainedSeries, ...] = ()
    """Quantities over time, of all satellites."""
    record: When = "never"
    """Of which cases the whole flight record is stored."""
    bag: When = "never"
    """Of which cases a bag is stored."""

    def decimated(self, step: float) -> dict[str, DecimatedSeries]:
        """What takes the series from the blocks of flights, by name of the quantity.

        Args:
            step: control period of the flights, s.
        """
        return {
            series.quantity: DecimatedSeries(series.quantity, series.stride(step)) for series in self.series
        }

    def series_bytes(self, timing: Timing, satellites: int) -> int:
        """Size of the stored series of a case that flies to its end, at most.

        Args:
            timing: of the flight.
            satellites: how many fly.
        """
        return sum(
            8
            * (timing.steps // series.stride(timing.step) + 1)
            * satellites
            * COLUMNS[series.quantity].components
            for series in self.series
        )
