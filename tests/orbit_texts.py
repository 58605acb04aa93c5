# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Orbit files for tests: a published SGP4 case as TLE and OMM, and an ephemeris of two-body motion."""

import brahe
import numpy as np

TLE = (
    "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753",
    "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
)
"""The example of TEME in Vallado, Crawford, Hujsak and Kelso 2006, appendix C."""

OMM = """\
CCSDS_OMM_VERS = 2.0
CREATION_DATE = 2000-06-28T00:00:00
ORIGINATOR = TEST
OBJECT_NAME = VANGUARD 1
OBJECT_ID = 1958-002B
CENTER_NAME = EARTH
REF_FRAME = TEME
TIME_SYSTEM = UTC
MEAN_ELEMENT_THEORY = SGP4
EPOCH = 2000-06-27T18:50:19.733568
MEAN_MOTION = 10.82419157
ECCENTRICITY = 0.1859667
INCLINATION = 34.2682
RA_OF_ASC_NODE = 348.7242
ARG_OF_PERICENTER = 331.7664
MEAN_ANOMALY = 19.3264
EPHEMERIS_TYPE = 0
CLASSIFICATION_TYPE = U
NORAD_CAT_ID = 5
ELEMENT_SET_NO = 475
REV_AT_EPOCH = 41366
BSTAR = 0.000028098
MEAN_MOTION_DOT = 0.00000023
MEAN_MOTION_DDOT = 0.0
"""

ELEMENTS = np.array([7.0e6, 0.01, 1.0, 0.5, 0.3, 0.1])
"""Of the ephemeris at its first state."""


def kepler(time, elements=ELEMENTS):
    """State of two-body motion `time` s after the elements, by brahe."""
    moved = elements.copy()
    moved[5] += np.sqrt(brahe.GM_EARTH / elements[0] ** 3) * time
    return brahe.state_koe_to_eci(moved, brahe.AngleFormat.RADIANS)


def oem(frame="GCRF", scale="UTC", hour=0, interpolation="LAGRANGE", count=20):
    """An ephemeris of a state a minute from 2024-01-01, in the axes of a frame."""
    lines = [
        "CCSDS_OEM_VERS = 2.0",
        "CREATION_DATE = 2024-01-01T00:00:00",
        "ORIGINATOR = TEST",
        "META_START",
        "OBJECT_NAME = SAT1",
        "OBJECT_ID = 2024-001A",
        "CENTER_NAME = EARTH",
        f"REF_FRAME = {frame}",
        f"TIME_SYSTEM = {scale}",
        f"START_TIME = 2024-01-01T{hour:02d}:00:00",
        f"STOP_TIME = 2024-01-01T{hour:02d}:{count - 1:02d}:00",
        f"INTERPOLATION = {interpolation}",
        "INTERPOLATION_DEGREE = 9",
        "META_STOP",
    ]
    for minute in range(count):
        state = kepler(60.0 * minute)
        if frame == "EME2000":
            state = brahe.state_gcrf_to_eme2000(state)
        numbers = " ".join(f"{part:.12f}" for part in state / 1e3)
        lines.append(f"2024-01-01T{hour:02d}:{minute:02d}:00.000 {numbers}")
    return "\n".join(lines) + "\n"
