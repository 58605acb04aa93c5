# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The chief's orbit: inertial state from elements, and the ideal circular motion."""

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from satform.common.angle_text import OR_DEGREES
from satform.common.spec import Complaint, Spec
from satform.numeric.elementwise import Array
from satform.orbits.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from satform.orbits.frames import LvlhFrame, earth_rotation_angle
from satform.orbits.kepler import eccentric_anomaly, mean_from_eccentric

Angle = Annotated[float, Field(ge=-2.0 * math.pi, le=2.0 * math.pi), OR_DEGREES]
J2000 = datetime(2000, 1, 1, 12, tzinfo=UTC)


class ChiefOrbitSpec(Spec):
    """Osculating orbit of the chief at time zero; its size follows from the scenario's mean motion."""

    inclination: Annotated[float, Field(ge=0.0, le=math.pi), OR_DEGREES] = 0.9
    """Inclination to the inertial x-y plane [rad]."""
    right_ascension: Angle = 0.0
    """Right ascension of the ascending node [rad]."""
    argument_of_latitude: Angle = 0.0
    """Angle from the ascending node to the chief at time zero [rad]."""
    eccentricity: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Eccentricity; 0 for an osculating circular start."""
    argument_of_perigee: Angle = 0.0
    """Angle from the ascending node to the perigee [rad]; without meaning on a circular orbit."""

    def state(self, mean_motion: float, gravitational_parameter: float) -> tuple[Array, Array]:
        """Inertial position in m and velocity in m/s at time zero, shape (3,) each.

        Args:
            mean_motion: rad/s.
            gravitational_parameter: m^3/s^2.

        Source: Schaub & Junkins, ch. 9 (orbit elements to Cartesian coordinates).
        """
        radial, transverse, _ = self.axes(self.argument_of_latitude)
        radius, radial_speed, transverse_speed = _polar_state(
            semi_major_axis_of(mean_motion, gravitational_parameter),
            self.eccentricity,
            self.argument_of_latitude - self.argument_of_perigee,
            gravitational_parameter,
        )
        return radius * radial, radial_speed * radial + transverse_speed * transverse

    def axes(self, argument_of_latitude: float) -> tuple[Array, Array, Array]:
        """Radial, transverse and normal unit vectors, inertial, at an angle from the node in rad."""
        cn, sn = math.cos(self.right_ascension), math.sin(self.right_ascension)
        ci, si = math.cos(self.inclination), math.sin(self.inclination)
        cu, su = math.cos(argument_of_latitude), math.sin(argument_of_latitude)
        radial = np.array([cn * cu - sn * su * ci, sn * cu + cn * su * ci, su * si])
        transverse = np.array([-cn * su - sn * cu * ci, -sn * su + cn * cu * ci, cu * si])
        return radial, transverse, np.array([sn * si, -cn * si, ci])

    def keplerian(self, mean_motion: float) -> "KeplerianChief":
        """The same orbit by its elements, with the mean anomaly at time zero, for a mean motion in rad/s."""
        anomaly = mean_anomaly(self.argument_of_latitude - self.argument_of_perigee, self.eccentricity)
        return KeplerianChief(
            semi_major_axis=semi_major_axis_of(mean_motion, GRAVITATIONAL_PARAMETER),
            eccentricity=self.eccentricity,
            inclination=self.inclination,
            right_ascension=self.right_ascension,
            argument_of_perigee=self.argument_of_perigee,
            mean_anomaly=anomaly,
        )

    def complaints(self, mean_motion: float) -> list[Complaint]:
        """Why no satellite can fly this orbit of a mean motion in rad/s: field and sentence of each."""
        perigee = semi_major_axis_of(mean_motion, GRAVITATIONAL_PARAMETER) * (1.0 - self.eccentricity)
        if perigee >= EQUATORIAL_RADIUS:
            return []
        return [
            (
                ("chief", "eccentricity") if self.eccentricity > 0.0 else ("chief",),
                f"the chief's perigee of {perigee / 1e3:.1f} km (period {math.tau / mean_motion:.6g} s, "
                f"eccentricity {self.eccentricity:g}) lies inside the Earth, whose radius is "
                f"{EQUATORIAL_RADIUS / 1e3:.1f} km; this model has gravity outside it alone",
            )
        ]


def semi_major_axis_of(mean_motion: float, gravitational_parameter: float) -> float:
    """Semi-major axis in m from the mean motion in rad/s, by Kepler's third law."""
    return math.cbrt(gravitational_parameter / (mean_motion * mean_motion))


def _polar_state(
    semi_major_axis: float, eccentricity: float, true_anomaly: float, gravitational_parameter: float
) -> tuple[float, float, float]:
    """Radius (m), radial and transverse speed (m/s) from a in m, e, true anomaly in rad, GM in m^3/s^2."""
    parameter = semi_major_axis * (1.0 - eccentricity**2)
    along = 1.0 + eccentricity * math.cos(true_anomaly)
    speed = math.sqrt(gravitational_parameter / parameter)
    return parameter / along, speed * eccentricity * math.sin(true_anomaly), speed * along


def true_anomaly(mean_anomaly: float, eccentricity: float) -> float:
    """True anomaly from the mean one, rad, of the same revolution.

    Args:
        mean_anomaly: rad, of any size.
        eccentricity: below 1.

    Raises:
        ValueError: the eccentricity is of no ellipse, or the mean anomaly is not finite.

    Source: Kepler's equation.
    """
    eccentric = eccentric_anomaly(mean_anomaly, eccentricity)
    return eccentric + _true_minus_eccentric(eccentric, eccentricity)


def mean_anomaly(true_anomaly: float, eccentricity: float) -> float:
    """Mean anomaly from the true one, rad, of the same revolution.

    Args:
        true_anomaly: rad, of any size.
        eccentricity: below 1.

    Source: Kepler's equation.
    """
    eccentric = true_anomaly + _true_minus_eccentric(true_anomaly, -eccentricity)
    return mean_from_eccentric(eccentric, eccentricity)


def _true_minus_eccentric(anomaly: float, eccentricity: float) -> float:
    """True minus eccentric anomaly, rad, from the eccentric one; eccentric minus true from the true one.

    Args:
        anomaly: eccentric anomaly, or true anomaly, rad.
        eccentricity: with the sign changed for the second.

    Source: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, ch. 4.
    """
    ratio = eccentricity / (1.0 + math.sqrt(1.0 - eccentricity * eccentricity))
    return 2.0 * math.atan2(ratio * math.sin(anomaly), 1.0 - ratio * math.cos(anomaly))


@dataclass(frozen=True)
class KeplerianChief:
    """A chief on a Keplerian orbit, by its elements at time zero: what control laws may know of it.

    Attributes:
        semi_major_axis: m.
        eccentricity: below 1.
        inclination: rad.
        right_ascension: of the ascending node, rad.
        argument_of_perigee: rad.
        mean_anomaly: at time zero, rad.
    """

    semi_major_axis: float
    eccentricity: float
    inclination: float
    right_ascension: float
    argument_of_perigee: float
    mean_anomaly: float

    @classmethod
    def from_mean_motion(
        cls, mean_motion: float, eccentricity: float = 0.0, true_anomaly: float = 0.0
    ) -> "KeplerianChief":
        """A chief in the inertial x-y plane with its perigee on the x axis.

        Args:
            mean_motion: rad/s.
            eccentricity: below 1.
            true_anomaly: at time zero, rad.
        """
        axis = semi_major_axis_of(mean_motion, GRAVITATIONAL_PARAMETER)
        return cls(axis, eccentricity, 0.0, 0.0, 0.0, mean_anomaly(true_anomaly, eccentricity))

    @property
    def mean_motion(self) -> float:
        """Angular rate of the mean anomaly, rad/s."""
        return math.sqrt(GRAVITATIONAL_PARAMETER / self.semi_major_axis**3)

    @property
    def period(self) -> float:
        """Time of one revolution, s."""
        return math.tau / self.mean_motion

    def mean_anomaly_at(self, time: float) -> float:
        """Mean anomaly `time` s after the start, rad, growing without end."""
        return self.mean_anomaly + self.mean_motion * time

    def true_anomaly(self, time: float) -> float:
        """True anomaly `time` s after the start, rad, growing without end; raises as `true_anomaly` does."""
        return true_anomaly(self.mean_anomaly_at(time), self.eccentricity)

    def radius(self, time: float) -> float:
        """Distance from the Earth's centre `time` s after the start, m."""
        parameter = self.semi_major_axis * (1.0 - self.eccentricity**2)
        return parameter / (1.0 + self.eccentricity * math.cos(self.true_anomaly(time)))

    def angular_rate(self, time: float) -> float:
        """Rate of the true anomaly, at which the LVLH frame turns, `time` s after the start, rad/s."""
        ratio = self.semi_major_axis / self.radius(time)
        return self.mean_motion * ratio * ratio * math.sqrt(1.0 - self.eccentricity**2)

    def state_in_own_axes(self) -> tuple[Array, Array]:
        """Position in m and velocity in m/s at time zero, in radial, transverse and normal axes."""
        shape = (self.semi_major_axis, self.eccentricity, self.true_anomaly(0.0))
        radius, radial_speed, transverse_speed = _polar_state(*shape, GRAVITATIONAL_PARAMETER)
        return np.array([radius, 0.0, 0.0]), np.array([radial_speed, transverse_speed, 0.0])


@dataclass(frozen=True)
class CircularChief:
    """A chief that keeps to a circular Keplerian orbit for ever.

    Attributes:
        orbit: its plane and its place at time zero.
        radius: m.
        mean_motion: rad/s.
    """

    orbit: ChiefOrbitSpec
    radius: float
    mean_motion: float

    def frame(self, time: float) -> LvlhFrame:
        """The LVLH frame, turning at (0, 0, n), at `time` s after the start."""
        angle = self.orbit.argument_of_latitude + self.mean_motion * time
        radial, transverse, normal = self.orbit.axes(angle)
        speed = self.radius * self.mean_motion
        rate = np.array([0.0, 0.0, self.mean_motion])
        return LvlhFrame(self.radius * radial, speed * transverse, radial, transverse, normal, rate)


def earth_angle_at(epoch: datetime) -> float:
    """Earth rotation angle in rad at an epoch, with UT1 = UTC.

    Args:
        epoch: with or without a time zone; without one it is UTC.

    Returns:
        rad within [0, 2 pi).
    """
    since = as_utc(epoch) - J2000
    return earth_rotation_angle(since.days, since.seconds + 1e-6 * since.microseconds)


def as_utc(epoch: datetime) -> datetime:
    """The same instant in UTC; an epoch without a time zone is taken to be in UTC.

    Raises:
        ValueError: it lies in UTC before the year 1 or after the year 9999.
    """
    try:
        return epoch.replace(tzinfo=UTC) if epoch.tzinfo is None else epoch.astimezone(UTC)
    except OverflowError:
        raise ValueError(f"the epoch {epoch.isoformat()} lies beyond the years 1 to 9999 in UTC") from None


def _with_utc(epoch: datetime) -> datetime:
    """The epoch as it is given, of which it is known that it can be said in UTC."""
    as_utc(epoch)
    return epoch


Epoch = Annotated[datetime, AfterValidator(_with_utc)]
"""Date and time of a specification, with or without a time zone."""
