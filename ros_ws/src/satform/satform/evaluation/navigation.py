# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of navigation: errors of what satellites estimate of each other, and against a central filter."""

import math
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.evaluation.formation_navigation import estimates_formation
from satform.numeric.elementwise import Array
from satform.record.flight_record import FlightRecord
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
        bare = sorted(name for name in meant if not estimates_formation(satellites[name]))
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
