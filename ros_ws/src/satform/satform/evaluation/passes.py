# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of how one satellite passes another: how near, when, and how well lit."""

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import Number
from satform.numeric.elementwise import Array
from satform.orbits.chief import as_utc
from satform.orbits.sun import days_at, sun_in_lvlh
from satform.record.flight_record import FlightRecord
from satform.scenario.environment import SAME_DIRECTION, Environment
from satform.scenario.expectation import OverWindow
from satform.scenario.parts import Timing


@dataclass(frozen=True)
class Pass:
    """The closest pass of two satellites.

    Attributes:
        time: s.
        separation: position of the first less that of the second, LVLH, m, shape (3,).
    """

    time: float
    separation: Array


class _OfPair(OverWindow):
    """An expectation of the closest pass of two satellites, which move evenly between two steps."""

    satellites: Annotated[tuple[str, ...], Field(min_length=2, max_length=2)]
    """The satellite that looks and the one that it looks at."""

    def complaints(self, satellites: set[str], timing: Timing) -> list[str]:
        first, second = self.satellites
        same = f"a pass is of two different satellites; found {first} twice"
        return super().complaints(satellites, timing) + ([same] if first == second else [])

    def closest(self, record: FlightRecord) -> Pass | None:
        """The closest pass within the stretch; None when the record ends before."""
        place = self.window(record.position, record, of_bodies=True)
        motion = self.window(record.velocity, record, of_bodies=True)
        if not place.size:
            return None
        times = np.repeat(record.time[:, None], len(record.satellites), axis=1)
        time = self.window(times, record, of_bodies=True)[:, 0]
        apart, closing = place[:, 0] - place[:, 1], motion[:, 0] - motion[:, 1]
        speed_squared = np.sum(closing**2, axis=1)
        ahead = -np.sum(apart * closing, axis=1) / np.where(speed_squared > 0.0, speed_squared, 1.0)
        ahead = np.clip(ahead, -0.5 * record.step, 0.5 * record.step)
        ahead = np.clip(time + ahead, time[0], time[-1]) - time
        nearest = apart + ahead[:, None] * closing
        best = int(np.argmin(np.sum(nearest**2, axis=1)))
        return Pass(float(time[best] + ahead[best]), nearest[best])


class PassDistance(_OfPair):
    """Distance of the closest pass of one satellite by another, in m."""

    unit = "m"
    kind: Literal["pass_distance"] = "pass_distance"

    def measure(self, record: FlightRecord) -> float:
        found = self.closest(record)
        return math.nan if found is None else float(np.linalg.norm(found.separation))

    def describe(self) -> str:
        return self.label or f"closest pass{self.when()}{self.whose()}"


class PassTime(_OfPair):
    """Time of the closest pass of one satellite by another, in s."""

    unit = "s"
    kind: Literal["pass_time"] = "pass_time"

    def measure(self, record: FlightRecord) -> float:
        found = self.closest(record)
        return math.nan if found is None else found.time

    def describe(self) -> str:
        return self.label or f"time of the closest pass{self.when()}{self.whose()}"


class PassLightAngle(_OfPair):
    """Angle at the satellite that is looked at, between the sun and the one that looks, in rad.

    Taken at the closest pass; small when the sun is behind the one that looks. The chief has to be
    geostationary.
    """

    unit = "rad"
    kind: Literal["pass_light_angle"] = "pass_light_angle"
    epoch: datetime
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

    def measure(self, record: FlightRecord) -> float:
        found = self.closest(record)
        if found is None:
            return math.nan
        sun = sun_in_lvlh(days_at(self.epoch) + found.time / 86400.0, self.chief_longitude)
        apart = float(np.linalg.norm(found.separation))
        if apart == 0.0:
            # At one place there is no direction from one to the other.
            return math.nan
        cosine = float(found.separation @ sun) / apart
        return math.acos(max(-1.0, min(1.0, cosine)))

    def describe(self) -> str:
        return self.label or f"light angle at the closest pass{self.when()}{self.whose()}"
