# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of how one satellite passes another: how near, when, and how well lit."""

import math
from collections.abc import Callable
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import Number
from satform.evaluation.pairs import ClosestApproaches
from satform.numeric.elementwise import Array, dot, norm
from satform.orbits.chief import Epoch, as_utc
from satform.orbits.sun import days_at, sun_in_lvlh
from satform.record.reducer import FlightShape, Reducer
from satform.scenario.environment import SAME_DIRECTION, Environment
from satform.scenario.parts import Timing
from satform.scenario.windowed_expectation import OverWindow

PassFigure: TypeAlias = Callable[[Array, Array], Array]
"""Makes the figure of each run from time, s, shape (R,), and separation at the closest pass, m, (R, 3)."""


class _OfPair(OverWindow):
    """An expectation of the closest pass of two satellites, which move evenly between two steps."""

    satellites: Annotated[tuple[str, ...], Field(min_length=2, max_length=2)]
    """The satellite that looks and the one that it looks at."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        first, second = self.satellites
        same = f"a pass is of two different satellites; found {first} twice"
        return super().complaints(satellites, timing) + ([same] if first == second else [])

    def pass_reducer(self, flight: FlightShape, figure: PassFigure) -> Reducer:
        """What makes a figure of the closest pass within the stretch."""
        stretch = self.stretch(flight, flight.states, of_bodies=True)
        return ClosestApproaches(
            stretch, flight.step, lambda found: figure(found.time[:, 0], found.separation[:, 0])
        )


class PassDistance(_OfPair):
    """Distance of the closest pass of one satellite by another, in m."""

    unit = "m"
    figure_name = "closest pass"
    kind: Literal["pass_distance"] = "pass_distance"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.pass_reducer(flight, lambda time, separation: norm(separation))


class PassTime(_OfPair):
    """Time of the closest pass of one satellite by another, in s."""

    unit = "s"
    figure_name = "time of the closest pass"
    kind: Literal["pass_time"] = "pass_time"

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.pass_reducer(flight, lambda time, separation: time)


class PassLightAngle(_OfPair):
    """Angle at the satellite that is looked at, between the sun and the one that looks, in rad.

    Taken at the closest pass; small when the sun is behind the one that looks. The chief has to be
    geostationary.
    """

    unit = "rad"
    figure_name = "light angle at the closest pass"
    kind: Literal["pass_light_angle"] = "pass_light_angle"
    epoch: Epoch
    """Date and time of time zero; without a time zone it is UTC."""
    chief_longitude: Annotated[Number, OR_DEGREES]
    """Of the geostationary chief, east of Greenwich, rad."""

    def environment_complaints(self, environment: Environment) -> list[tuple[str, str]]:
        found = []
        if as_utc(self.epoch) != as_utc(environment.epoch):
            found.append(
                (
                    "epoch",
                    f"found {as_utc(self.epoch).isoformat()}; the truth model's epoch is "
                    f"{as_utc(environment.epoch).isoformat()}, and a scenario has one",
                )
            )
        radial = environment.chief_axes[0].tolist()
        longitude = math.atan2(radial[1], radial[0]) - environment.earth_angle
        apart = abs(math.remainder(longitude - self.chief_longitude, math.tau))
        if apart > SAME_DIRECTION:
            found.append(
                (
                    "chief_longitude",
                    f"found {self.chief_longitude:.6g}; the truth model's chief is over "
                    f"{math.remainder(longitude, math.tau):.6g} rad, by the Earth's angle at its epoch",
                )
            )
        return found

    def reducer(self, flight: FlightShape) -> Reducer:
        return self.pass_reducer(flight, self._light_angles)

    def _light_angles(self, times: Array, separations: Array) -> Array:
        pairs = zip(times.tolist(), separations, strict=True)
        return np.array([self._light_angle(time, separation) for time, separation in pairs])

    def _light_angle(self, time: float, separation: Array) -> float:
        apart = float(norm(separation))
        if apart == 0.0 or math.isnan(apart):
            # At one place there is no direction from one to the other.
            return math.nan
        sun = sun_in_lvlh(days_at(self.epoch) + time / 86400.0, self.chief_longitude)
        cosine = float(dot(separation, sun)) / apart
        return math.acos(max(-1.0, min(1.0, cosine)))
