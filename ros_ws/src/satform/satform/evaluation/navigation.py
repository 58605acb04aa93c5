# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of navigation: errors of what satellites estimate of each other, and against a central filter."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.evaluation.pairs import OfPairs
from satform.numeric.elementwise import Array, norm
from satform.record.flight_record import FlightRecord
from satform.record.reducer import FlightShape
from satform.scenario.parts import SatelliteSpec, Timing
from satform.scenario.windowed_expectation import OverWindow


class _OfFormationEstimates(OverWindow):
    """A figure of the estimates of satellites that estimate the motion of all."""

    of_steps = True

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        own = super().complaints_about_satellites(satellites, announces)
        meant = self.satellites or tuple(satellites)
        bare = sorted(name for name in meant if not _estimates_formation(satellites[name]))
        have = "has" if len(bare) == 1 else "have"
        return [*own, f"{', '.join(bare)} {have} no navigation that estimates the formation"] if bare else own


class RelativeRangeError(_OfFormationEstimates):
    """Error of the estimated relative position of other satellites, in percent of their true distance.

    A satellite estimates it as the difference of two positions of its estimate of the whole formation.
    """

    unit = "%"
    figure_name = "{0.statistic} relative position error over range"
    kind: Literal["relative_range_error"] = "relative_range_error"
    statistic: Literal["maximum", "rms"] = "rms"
    """Largest over the stretch, or root of the mean square, over all targets."""
    targets: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    """The other satellites that are meant; all when left out."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        own = super().complaints(satellites, timing)
        unknown = sorted(set(self.targets or ()) - satellites)
        own += [
            f"there is no satellite {name}; there are {', '.join(sorted(satellites))}" for name in unknown
        ]
        only = set(self.targets or ()) & set(self.satellites or satellites)
        if self.targets is not None and len(self.targets) == 1 and only:
            own.append(f"{self.targets[0]} is its own only target; name satellites without it")
        return own

    def measure(self, record: FlightRecord) -> float:
        if record.navigation is None:
            return math.nan
        chosen = self.targets or record.satellites
        columns = [index for index, name in enumerate(record.satellites) if name in chosen]
        others = np.arange(len(record.satellites))[:, None] != np.array(columns)
        estimated, true = _relative(_estimated(record)), _relative(record.position[: record.steps, None])
        error = np.linalg.norm((estimated - true)[:, :, columns], axis=-1)
        distance = np.where(others, np.linalg.norm(true[:, :, columns], axis=-1), 1.0)
        # The own position relative to itself is no figure.
        squares = np.where(others, np.square(100.0 * error / distance), 0.0)
        if self.statistic == "maximum":
            return math.sqrt(_largest_of_known(self.window(squares.max(axis=-1), record)))
        # A satellite that is its own only target is none of those that are meant.
        number = np.maximum(1, others.sum(axis=-1))
        return math.sqrt(_mean_of_known(self.window(squares.sum(axis=-1) / number, record)))

    def of_what(self) -> str:
        to = "" if self.targets is None else f" to {', '.join(self.targets)}"
        return to + super().of_what()


class CentralErrorRatio(_OfFormationEstimates):
    """Rms error of estimated positions, divided by that of a filter with the readings of all satellites.

    Counted are the positions of all satellites relative to the chief, as each satellite estimates them. The
    central filter runs over the recorded readings. It is of the same kind, and knows all accelerations. Its
    errors are counted in the same steps, once for each satellite that has an estimate.
    """

    figure_name = "ratio of the rms position error to that of a central filter"
    kind: Literal["central_error_ratio"] = "central_error_ratio"

    def measure(self, record: FlightRecord) -> float:
        central = record.central_estimate
        if record.navigation is None or central is None:
            return math.nan
        true = record.position[: record.steps]
        own = _mean_square(_estimated(record) - true[:, None])
        # A satellite that is lost has no estimate: such a step counts for neither of the two.
        central_too = np.where(np.isfinite(own), _mean_square(central[..., :3] - true)[:, None], np.nan)
        of_own, of_central = self.window(own, record), self.window(central_too, record)
        return math.sqrt(_mean_of_known(of_own) / _mean_of_known(of_central))


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
        knowing = [name for name in named if name in satellites and _estimates_formation(satellites[name])]
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


def _estimates_formation(satellite: SatelliteSpec) -> bool:
    """Whether a satellite's filter estimates the motion of all satellites."""
    return satellite.navigation is not None and satellite.navigation.estimates == "formation"


def _estimated(record: FlightRecord) -> Array:
    """Positions of all satellites as each satellite estimates them, m, shape (K, N, N, 3)."""
    assert record.navigation is not None  # noqa: S101 - the callers have seen to it
    count = len(record.satellites)
    return record.navigation.mean.reshape(record.steps, count, count, 6)[..., :3]


def _relative(position: Array) -> Array:
    """Positions of all satellites relative to each one, m, shape (K, N or 1, N, 3) to (K, N, N, 3)."""
    count = position.shape[2]
    whole = np.broadcast_to(position, (len(position), count, count, 3))
    own = np.arange(count)
    return np.asarray(whole - whole[:, own, own][:, :, None])


def _mean_square(error: Array) -> Array:
    """Mean over satellites of the squared length of an error, shape (..., N, 3) to (...)."""
    return np.asarray((error * error).sum(axis=-1).mean(axis=-1))


def _mean_of_known(values: Array) -> float:
    """Mean of the numbers; NaN where there is none."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else math.nan


def _largest_of_known(values: Array) -> float:
    """The largest of the numbers; NaN where there is none."""
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else math.nan
