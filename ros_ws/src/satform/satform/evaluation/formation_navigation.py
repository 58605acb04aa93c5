# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of filters that estimate the motion of a whole formation."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Literal

import numpy as np

from satform.evaluation.pairs import OfPairs
from satform.numeric.elementwise import Array, norm
from satform.record.flight_record import FlightRecord
from satform.record.reducer import FlightShape
from satform.scenario.parts import SatelliteSpec


class RelativeNavigationError(OfPairs):
    """Error of the motion of two satellites relative to each other, as their filters estimate it, in m.

    The filters are those of the two satellites; one that estimates its own motion alone does not count. Of
    several pairs and filters, the largest figure is meant.
    """

    unit = "m"
    of_steps = True
    figure_name = "{0.statistic} error of the estimated {0.component}"
    kind: Literal["relative_navigation_error"] = "relative_navigation_error"
    component: Literal["range", "position"] = "range"
    """range: the estimated distance less the true one; position: the distance between the estimated and the
    true relative position."""
    statistic: Literal["maximum", "rms"] = "maximum"
    """Largest magnitude over the stretch, or root of the mean square."""

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        own = super().complaints_about_satellites(satellites, announces)
        named = self.satellites or tuple(satellites)
        knowing = [name for name in named if name in satellites and estimates_formation(satellites[name])]
        return own if knowing else [*own, f"no filter of {', '.join(named)} estimates the formation"]

    def measure(self, record: FlightRecord) -> float:
        if record.navigation is None:
            return math.nan
        shape = FlightShape.of(record)
        stretch = self.stretch(shape, shape.steps)
        errors = [
            self._errors(record, filter_of, pair)[stretch.first : stretch.end]
            for pair in combinations(stretch.columns, 2)
            for filter_of in pair
        ]
        figures = [self._figure(own[np.isfinite(own)]) for own in errors]
        return max((figure for figure in figures if figure is not None), default=math.nan)

    def _errors(self, record: FlightRecord, filter_of: int, pair: tuple[int, int]) -> Array:
        """Errors of one pair by the filter of one satellite at each step, m, shape (K,)."""
        assert record.navigation is not None  # noqa: S101 - measure has seen to it
        steps = len(record.navigation.mean)
        estimated = record.navigation.mean[:, filter_of].reshape(steps, -1, 6)[..., :3]
        first, second = pair
        found = estimated[:, second] - estimated[:, first]
        true = record.position[:steps, second] - record.position[:steps, first]
        return norm(found - true) if self.component == "position" else np.abs(norm(found) - norm(true))

    def _figure(self, errors: Array) -> float | None:
        """Of the finite errors of one pair; None where there are none."""
        if not errors.size:
            return None
        return float(errors.max()) if self.statistic == "maximum" else math.sqrt(float((errors**2).mean()))


def estimates_formation(satellite: SatelliteSpec) -> bool:
    """Whether a satellite's filter estimates the motion of all satellites."""
    return satellite.navigation is not None and satellite.navigation.estimates == "formation"
