# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Orientation of the Earth at one date after another, for one flight.

The package brahe keeps Earth orientation parameters for the whole process. What one flight sets there
would be seen by the next, and by one that is flown in between; so a flight has its own parameters and
hands them to brahe anew for every rotation that it wants.
"""

import functools
import os
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import brahe

from satform.files.named_file import NamedFile
from satform.numeric.elementwise import Array

_IN_USE = threading.Lock()
"""Between handing parameters to brahe and computing with them nobody else may hand it others."""


@dataclass(frozen=True)
class EarthOrientation:
    """Earth orientation parameters, by one of brahe's providers.

    Attributes:
        provider: of UT1 - UTC, polar motion and the offsets of the celestial pole.
    """

    provider: Any

    def inertial_to_fixed(self, epoch: Any) -> Array:
        """Rotation of GCRF into ITRF components at brahe's epoch, (3, 3)."""
        with _IN_USE:
            self._hand_over(epoch)
            rotation: Array = brahe.rotation_gcrf_to_itrf(epoch)
        return rotation

    def inertial_to_equator_of_date(self, epoch: Any) -> Array:
        """Rotation of GCRF components into the true equator and equinox of brahe's epoch, (3, 3)."""
        with _IN_USE:
            self._hand_over(epoch)
            rotation: Array = brahe.rotation_gcrf_to_tod(epoch)
        return rotation

    def density(self, epoch: Any, position_fixed: Array, weather: Any) -> float:
        """Density by NRLMSISE-00, for which brahe keeps its indices for the whole process, too.

        Args:
            epoch: brahe's.
            position_fixed: Earth-fixed, m, shape (3,).
            weather: brahe's provider of solar and geomagnetic activity.

        Returns:
            kg/m^3.
        """
        with _IN_USE:
            self._hand_over(epoch)
            brahe.set_global_space_weather_provider(weather)
            return float(brahe.density_nrlmsise00(epoch, position_fixed))

    @contextmanager
    def in_use(self, epoch: Any) -> Iterator[None]:
        """While it is open brahe computes with the parameters of its epoch."""
        with _IN_USE:
            self._hand_over(epoch)
            yield

    def covers(self, epoch: Any) -> bool:
        """Whether the parameters are given for an epoch; beyond their first and last they are held."""
        date = _modified_julian_date(epoch)
        return bool(self.provider.mjd_min() <= date <= self.provider.mjd_max())

    def _hand_over(self, epoch: Any) -> None:
        date = _modified_julian_date(epoch)
        pole_x, pole_y = self.provider.get_pm(date)
        offset_x, offset_y = self.provider.get_dxdy(date)
        values = (self.provider.get_ut1_utc(date), pole_x, pole_y, offset_x, offset_y)
        brahe.set_global_eop_provider_from_static_provider(_static(*values))


@functools.cache
def without_file() -> EarthOrientation:
    """UT1 = UTC, no polar motion, no offsets of the celestial pole."""
    return EarthOrientation(brahe.StaticEOPProvider.from_zero())


def from_file(file: NamedFile) -> EarthOrientation:
    """The parameters in a file of the IERS.

    Args:
        file: of the form finals2000A or C04.

    Raises:
        ValueError: it is of neither form.
    """
    return _from_content(file.content, file.name)


@functools.lru_cache(maxsize=4)
def _from_content(content: bytes, name: str) -> EarthOrientation:
    # brahe reads files, and the one that the scenario names may have changed since.
    handle, path = tempfile.mkstemp(suffix=Path(name).suffix)
    try:
        with os.fdopen(handle, "wb") as copy:
            copy.write(content)
        provider = brahe.FileEOPProvider.from_file(path, True, "Hold")
    except Exception as error:
        reason = str(error).replace(path, "").rstrip(": ")
        raise ValueError(
            f"{name} is not a file of Earth orientation parameters (IERS finals2000A or C04): {reason}"
        ) from error
    finally:
        Path(path).unlink()
    if provider.len() == 0:
        raise ValueError(f"{name} holds no Earth orientation parameters")
    return EarthOrientation(provider)


def _modified_julian_date(epoch: Any) -> float:
    """In UTC, by which the parameters are tabulated."""
    utc: Any = brahe.TimeSystem.UTC
    return float(epoch.mjd_as_time_system(utc))


def _static(difference: float, pole_x: float, pole_y: float, offset_x: float, offset_y: float) -> Any:
    """A provider of constant values: UT1 - UTC in s, the others in rad.

    brahe 1.8 takes the first three in another order than its documentation names them.
    """
    if _difference_is_third():
        return brahe.StaticEOPProvider.from_values(pole_x, pole_y, difference, offset_x, offset_y, 0.0)
    return brahe.StaticEOPProvider.from_values(difference, pole_x, pole_y, offset_x, offset_y, 0.0)


@functools.cache
def _difference_is_third() -> bool:
    return bool(brahe.StaticEOPProvider.from_values(1.0, 2.0, 3.0, 0.0, 0.0, 0.0).get_ut1_utc(0.0) == 3.0)
