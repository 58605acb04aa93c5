# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""CCSDS orbit messages of chief and satellites: ephemerides (OEM) and SGP4 mean elements (OMM), by brahe.

Mean elements are fitted with the package sgp4 and the constants of WGS 72, as others make and use them:
brahe's SGP4 takes those of WGS 84, and the same elements are some 40 m apart between the two.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import brahe
import numpy as np
from brahe.ccsds import OEM, OMM
from numpy.typing import NDArray
from scipy.optimize import least_squares

from satform.numeric.elementwise import Array, norm
from satform.orbits.chief import as_utc
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.orbits.earth_orientation import without_file
from satform.orbits.time_scales import brahe_epoch
from satform.record.flight_record import FlightRecord

CHIEF = "chief"
"""Name of the chief's messages."""

CHIEF_BESIDE_A_NAMESAKE = "chief-orbit"
"""Name of the chief's messages where a satellite is called `CHIEF`; names of satellites have no hyphen."""

_ORIGINATOR = "SATFORM"
_UNKNOWN = "UNKNOWN"
"""Designator of an object that has none, as the standard has it."""

_CATALOGUE_NUMBER = 99999
"""Of the elements of a satellite that is in no catalogue."""

_DAY = 86400.0

_SGP4_EPOCH = datetime(1949, 12, 31, tzinfo=UTC)
"""From which SGP4 counts its days."""

_FITTED_STATES = 60
"""Most states, evenly over the flight, that mean elements are fitted to."""


@dataclass(frozen=True)
class Ephemeris:
    """Inertial motion of one object.

    Attributes:
        name: of the satellite, or `CHIEF` or `CHIEF_BESIDE_A_NAMESAKE`.
        epoch: of time zero.
        times: since time zero, s, shape (K,), at least one.
        position: GCRF, m, shape (K, 3).
        velocity: GCRF, m/s, shape (K, 3).
    """

    name: str
    epoch: datetime
    times: Array
    position: Array
    velocity: Array


@dataclass(frozen=True)
class MeanElements:
    """SGP4 mean elements at time zero, of TEME, and how well they fit.

    Attributes:
        mean_motion: revolutions per day, as SGP4 takes it (Kozai).
        eccentricity: below 1.
        inclination: degrees.
        right_ascension: of the ascending node, degrees.
        argument_of_perigee: degrees.
        mean_anomaly: degrees.
        residual: root mean square distance between SGP4 and the fitted states, m.
    """

    mean_motion: float
    eccentricity: float
    inclination: float
    right_ascension: float
    argument_of_perigee: float
    mean_anomaly: float
    residual: float


def ephemerides(record: FlightRecord) -> list[Ephemeris]:
    """The motion of chief and satellites in a flight; states that are not known are left out.

    Each has a name of its own.

    Args:
        record: of the flight.

    Raises:
        ValueError: the chief's motion is not known.
    """
    positions, velocities = record.inertial_position, record.inertial_velocity
    assert record.chief is not None  # noqa: S101 - there would be no inertial positions
    chief = CHIEF_BESIDE_A_NAMESAKE if CHIEF in record.satellites else CHIEF
    found = [(chief, record.chief.position, record.chief.velocity)]
    found += [
        (name, positions[:, column], velocities[:, column]) for column, name in enumerate(record.satellites)
    ]
    made = []
    for name, position, velocity in found:
        known = np.isfinite(position).all(axis=-1) & np.isfinite(velocity).all(axis=-1)
        if known.any():
            states = (record.time[known], position[known], velocity[known])
            made.append(Ephemeris(name, record.chief.epoch, *states))
    return made


def oem_text(ephemeris: Ephemeris, comment: str) -> str:
    """An Orbit Ephemeris Message in KVN.

    Args:
        ephemeris: of one object.
        comment: one line about where it comes from.

    Source: CCSDS 502.0-B-3, as brahe writes it: positions to 1 mm, velocities to 1 um/s.
    """
    zero = brahe_epoch(ephemeris.epoch)
    times = ephemeris.times.tolist()
    message = OEM(originator=_ORIGINATOR)
    # Position and velocity of two neighbours decide what is between them: thrust changes from step to step.
    interpolation: dict[str, Any] = (
        {"interpolation": "HERMITE", "interpolation_degree": 3} if len(times) > 1 else {}
    )
    message.add_segment(
        object_name=ephemeris.name,
        object_id=_UNKNOWN,
        center_name="EARTH",
        ref_frame="GCRF",
        time_system="UTC",
        start_time=zero + times[0],
        stop_time=zero + times[-1],
        **interpolation,
    )
    segments: Any = message.segments
    segment = segments[0]
    segment.comments = [comment]
    for time, position, velocity in zip(
        times, ephemeris.position.tolist(), ephemeris.velocity.tolist(), strict=True
    ):
        segment.add_state(epoch=zero + time, position=position, velocity=velocity)
    return str(message.to_string("KVN"))


def omm_text(ephemeris: Ephemeris, elements: MeanElements) -> str:
    """An Orbit Mean-elements Message in KVN, of SGP4's elements.

    Args:
        ephemeris: that the elements were fitted to.
        elements: as from `fitted_elements`.

    Source: CCSDS 502.0-B-3, as brahe writes it.
    """
    fields = {
        "ORIGINATOR": _ORIGINATOR,
        "OBJECT_NAME": ephemeris.name,
        "OBJECT_ID": _UNKNOWN,
        "CENTER_NAME": "EARTH",
        "REF_FRAME": "TEME",
        "TIME_SYSTEM": "UTC",
        "MEAN_ELEMENT_THEORY": "SGP4",
        "EPOCH": as_utc(ephemeris.epoch).strftime("%Y-%m-%dT%H:%M:%S.%f"),
        "MEAN_MOTION": elements.mean_motion,
        "ECCENTRICITY": elements.eccentricity,
        "INCLINATION": elements.inclination,
        "RA_OF_ASC_NODE": elements.right_ascension,
        "ARG_OF_PERICENTER": elements.argument_of_perigee,
        "MEAN_ANOMALY": elements.mean_anomaly,
        "EPHEMERIS_TYPE": 0,
        "CLASSIFICATION_TYPE": "U",
        "NORAD_CAT_ID": _CATALOGUE_NUMBER,
        "ELEMENT_SET_NO": 1,
        "REV_AT_EPOCH": 0,
        "BSTAR": 0.0,
        "MEAN_MOTION_DOT": 0.0,
        "MEAN_MOTION_DDOT": 0.0,
    }
    message = OMM.from_gp_record(brahe.GPRecord.from_json(json.dumps(fields)))
    return str(message.to_string("KVN"))


def fitted_elements(ephemeris: Ephemeris) -> MeanElements:
    """SGP4 mean elements whose motion is nearest to an ephemeris, without a drag term.

    They are fitted to positions and velocities by least squares, in equinoctial elements, which are defined
    on circular and equatorial orbits.

    Args:
        ephemeris: of one object; at most 60 of its states, evenly spaced, are used.

    Raises:
        ValueError: SGP4 does not propagate this orbit, as where it is not an ellipse or goes through the
            atmosphere.
        ImportError: sgp4 is not installed.

    Source: Vallado, Fundamentals of Astrodynamics and Applications, ch. 10 (differential correction).
    """
    chosen = np.unique(np.linspace(0, len(ephemeris.times) - 1, _FITTED_STATES).round().astype(np.intp))
    times = ephemeris.times[chosen].tolist()
    try:
        measured = _in_teme(ephemeris, chosen)
        first = _first_guess(measured, times[0])
        scale = np.concatenate((np.ones(3), np.full(3, _DAY / (math.tau * first[0]))))

        def residuals(elements: Array) -> Array:
            off: Array = (_sgp4(elements, ephemeris.epoch, times) - measured) * scale
            return off.ravel()

        found = least_squares(residuals, first, x_scale="jac", method="lm", xtol=1e-15, ftol=1e-15)
    except ValueError as error:
        raise ValueError(f"{ephemeris.name}: SGP4 does not propagate this orbit: {error}") from None
    distance = norm(found.fun.reshape(-1, 6)[:, :3])
    return MeanElements(*_keplerian(found.x), residual=float(np.sqrt(np.mean(distance**2))))


def _in_teme(ephemeris: Ephemeris, chosen: NDArray[np.intp]) -> Array:
    """States of an ephemeris in the true equator and mean equinox of their dates, m and m/s, (K, 6)."""
    zero = brahe_epoch(ephemeris.epoch)
    # TEME does not depend on the Earth's rotation, but brahe asks for parameters of it.
    with without_file().in_use(zero):
        turned = np.array(
            [brahe.rotation_gcrf_to_teme(zero + time) for time in ephemeris.times[chosen].tolist()]
        )
    states = np.stack((ephemeris.position[chosen], ephemeris.velocity[chosen]), axis=1)
    seen: Array = np.einsum("kij,knj->kni", turned, states).reshape(-1, 6)
    return seen


def _first_guess(states: Array, begin: float) -> Array:
    """Equinoctial elements of an ephemeris as if its osculating ones were SGP4's.

    Args:
        states: TEME, m and m/s, shape (K, 6).
        begin: time of the first since time zero, s.

    Returns:
        Mean motion in revolutions per day; e sin and e cos of the longitude of perigee; tan(i/2) sin and
        cos of the node; mean longitude at time zero, rad; shape (6,).
    """
    radians: Any = brahe.AngleFormat.RADIANS
    elements = brahe.state_eci_to_koe(np.ascontiguousarray(states), radians)
    _, e, i, node, perigee, mean_anomaly = elements[0].tolist()
    axis = float(np.mean(elements[:, 0]))
    if not (axis > 0.0 and e < 1.0):
        raise ValueError("it is not an ellipse")
    rate = math.sqrt(GRAVITATIONAL_PARAMETER / axis**3)
    longitude, tilt = node + perigee, math.tan(0.5 * i)
    return np.array(
        [
            rate * _DAY / math.tau,
            e * math.sin(longitude),
            e * math.cos(longitude),
            tilt * math.sin(node),
            tilt * math.cos(node),
            longitude + mean_anomaly - rate * begin,
        ]
    )


def _keplerian(equinoctial: Array) -> tuple[float, float, float, float, float, float]:
    """Mean motion, eccentricity, and inclination, node, perigee and mean anomaly in degrees within a turn."""
    rate, h, k, p, q, mean_longitude = equinoctial.tolist()
    longitude, node = math.atan2(h, k), math.atan2(p, q)
    angles = (2.0 * math.atan(math.hypot(p, q)), node, longitude - node, mean_longitude - longitude)
    inclination, *others = (math.degrees(angle) for angle in angles)
    turned = (angle % 360.0 for angle in others)
    return rate, math.hypot(h, k), inclination, *turned


def _sgp4(equinoctial: Array, epoch: datetime, times: Sequence[float]) -> Array:
    """States by SGP4, TEME, m and m/s, shape (K, 6); with WGS 72, with which elements are made and used.

    Raises:
        ImportError: sgp4 is not installed.
        ValueError: it does not propagate these elements.
    """
    try:
        from sgp4.api import SGP4_ERRORS, WGS72, Satrec  # noqa: PLC0415 - an optional dependency
    except ImportError:
        raise ImportError("mean elements need sgp4: pip install 'satform[omm]'") from None
    rate, eccentricity, *degrees = _keplerian(equinoctial)
    inclination, node, perigee, anomaly = (math.radians(angle) for angle in degrees)
    satellite = Satrec()
    days = (as_utc(epoch) - _SGP4_EPOCH).total_seconds() / _DAY
    angles = (perigee, inclination, anomaly, rate * math.tau / 1440.0, node)
    satellite.sgp4init(WGS72, "i", 0, days, 0.0, 0.0, 0.0, eccentricity, *angles)
    found = np.empty((len(times), 6))
    for row, time in enumerate(times):
        failure, position, velocity = satellite.sgp4_tsince(time / 60.0)
        if failure:
            raise ValueError(SGP4_ERRORS[failure])
        found[row] = *position, *velocity
    return 1e3 * found
