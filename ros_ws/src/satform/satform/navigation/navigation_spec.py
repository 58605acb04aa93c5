# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Specifications of navigation filters on the readings of sensors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from satform.common.spec import DensityPerAxis, DeviationPerAxis, Spec
from satform.dynamics.relative_motion_models import ModelName
from satform.equipment.random_streams import PRIOR_STREAM
from satform.equipment.sensors.protocol import SensorChannel
from satform.navigation.estimate import GaussianEstimate
from satform.navigation.information_fusion import FusionRule
from satform.navigation.joint_state import SIZE, JointModel
from satform.navigation.kalman_filter import process_model
from satform.navigation.protocol import Filter
from satform.navigation.satellite_navigation import SatelliteNavigation
from satform.numeric.elementwise import Array
from satform.numeric.seeded_numbers import SeededNormals
from satform.orbits.chief import KeplerianChief

MOST_ESTIMATED = 10
"""Satellites whose motion one filter estimates at most; work grows with the third power of their number."""

REFERENCE_POSITION_ERROR, REFERENCE_VELOCITY_ERROR = 1e-3, 1e-6
"""Standard deviations of the motion of a reference satellite at the start, m and m/s."""


@dataclass(frozen=True)
class NavigationSetting:
    """What a satellite's navigation follows from beside its specification.

    Attributes:
        names: of all satellites.
        satellite: index of the satellite.
        start: position (m) and velocity (m/s) of a satellite at step 0 by its index, LVLH, shape (6,).
        mean_motion: of the chief, rad/s.
        step: control period, s.
        chief: its orbit; None for a circular one in an unknown plane.
        seed: of the run.
    """

    names: tuple[str, ...]
    satellite: int
    start: Callable[[int], Array]
    mean_motion: float
    step: float
    chief: KeplerianChief | None
    seed: int


class NavigationFilterSpec(Spec):
    """A filter of the motion of satellites on the readings of sensors."""

    estimates: Literal["own", "formation"] = "formation"
    """Whose motion is estimated: that of the satellite itself, or that of all satellites together."""
    model: ModelName = "cw"
    """Relative motion between readings: cw about a circular chief, yamanaka_ankersen about an eccentric one,
    j2_elements also under the Earth's oblateness."""
    acceleration_density: DensityPerAxis
    """Power spectral density of the unknown acceleration of a satellite whose command is known: the satellite
    itself, and with `exchange` those whose messages arrive; taken to be white, LVLH [m^2/s^3]."""
    neighbour_acceleration_density: DensityPerAxis | None = None
    """The same of satellites whose command is not known [m^2/s^3]; as `acceleration_density` when left
    out."""
    initial_position_error: DeviationPerAxis
    """Standard deviation of each satellite's position as it is known at the start, LVLH [m]."""
    initial_velocity_error: DeviationPerAxis
    """Standard deviation of each satellite's velocity as it is known at the start, LVLH [m/s]."""
    references: tuple[str, ...] = ()
    """Satellites whose motion at the start is known to a millimetre and a micrometre per second."""
    exchange: Literal["none"] | FusionRule = "none"
    """What is made of the estimates of in-neighbours, which then send theirs with their phases:
    covariance_intersection, or information_consensus with weights by the degrees of the graph."""

    def kernel(self) -> Filter[Any]:
        """The filter itself."""
        raise NotImplementedError

    def build(self, setting: NavigationSetting, channels: Sequence[SensorChannel]) -> SatelliteNavigation:
        """The navigation of a satellite.

        Args:
            setting: of the satellite.
            channels: of its sensors, in order.

        Raises:
            ValueError: it cannot be; the sentence begins with the name of the field.
        """
        members = tuple(range(len(setting.names))) if self.estimates == "formation" else (setting.satellite,)
        for sentence in self._complaints(setting, members, channels):
            raise ValueError(sentence)
        return SatelliteNavigation(
            satellite=setting.satellite,
            members=members,
            channels=tuple(channels),
            filter=self.kernel(),
            model=self._model(setting, len(members)),
            prior=self._prior(setting, members),
            exchange=None if self.exchange == "none" else self.exchange,
            seed=setting.seed,
        )

    def _complaints(
        self, setting: NavigationSetting, members: Sequence[int], channels: Sequence[SensorChannel]
    ) -> list[str]:
        found: list[str] = []
        if len(members) > MOST_ESTIMATED:
            found.append(
                f"estimates: a filter estimates {MOST_ESTIMATED} satellites at most, and there are "
                f"{len(members)}; own estimates one"
            )
        models = [channel.model for channel in channels if channel.model is not None]
        if not models:
            found.append("no sensor of the satellite measures motion; give it one in sensors")
        for model in models:
            if model.target is not None and model.target not in members:
                found.append(
                    f"estimates: {model.name} measures the motion relative to {setting.names[model.target]}, "
                    "which estimates: own leaves unknown; formation estimates it too"
                )
        late = [channel.name for channel in channels if channel.timing.latency]
        if self.exchange != "none" and late:
            found.append(f"exchange: {late[0]} has a latency, and estimates are exchanged without one only")
        if self.exchange != "none" and self.estimates == "own":
            found.append("exchange: own estimates have nothing in common; formation has")
        found += [
            f"references: there is no satellite {name}; there are {', '.join(setting.names)}"
            for name in self.references
            if name not in setting.names
        ]
        found += [
            f"references: {name} is named twice"
            for number, name in enumerate(self.references)
            if name in self.references[:number]
        ]
        return found

    def _model(self, setting: NavigationSetting, count: int) -> JointModel:
        densities = (self.acceleration_density, self.neighbour_acceleration_density)
        known, unknown = (
            process_model(
                self.model,
                setting.mean_motion,
                setting.step,
                np.array(density or self.acceleration_density),
                setting.chief,
            )
            for density in densities
        )
        return JointModel(known, unknown, count)

    def _prior(self, setting: NavigationSetting, members: Sequence[int]) -> GaussianEstimate:
        """The true start with a drawn error, and the covariance that a filter starts with."""
        normals = SeededNormals(setting.seed, PRIOR_STREAM, [setting.satellite], SIZE * len(setting.names))
        drawn = normals.at(0)[0].reshape(-1, SIZE)
        mean, variance = np.zeros((len(members), SIZE)), np.zeros((len(members), SIZE))
        for row, member in enumerate(members):
            spread = np.array([*self.initial_position_error, *self.initial_velocity_error])
            if setting.names[member] in self.references:
                spread = np.repeat([REFERENCE_POSITION_ERROR, REFERENCE_VELOCITY_ERROR], 3)
            mean[row] = setting.start(member) + spread * drawn[member]
            variance[row] = spread * spread
        return GaussianEstimate(mean.reshape(-1), np.diag(variance.reshape(-1)))
