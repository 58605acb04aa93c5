# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Motion by two-line elements, OMM and OEM files: read, propagated and turned into GCRF by brahe.

Two-line elements and OMM go through SGP4, whose frame TEME is turned into GCRF with UT1 = UTC and the pole
where the precession and nutation model has it. brahe's SGP4 has the constants of WGS 84; the verification
cases of Vallado et al. 2006 have those of WGS 72 and lie some 15 m away. What brahe reads without complaint,
though no such orbit or date is, is refused here.
"""

import itertools
import math
import re
from calendar import isleap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, Protocol

import numpy as np

from satform.files.named_file import NamedFile
from satform.numeric.elementwise import Array
from satform.orbits.chief import J2000
from satform.orbits.osculating import OrbitalState
from satform.orbits.time_scales import brahe_epoch, utc_datetime

LONGEST_SGP4 = 30.0
"""Days from its epoch over which an element set is propagated; beyond them SGP4 is off by tens of km."""

_FRAMES = {"GCRF", "ICRF", "EME2000", "J2000", "TEME"}
_SCALES = {"UTC", "TAI", "TT", "GPS"}
_DATE = re.compile(r"\b(\d{4})-(?:(\d{2})-(\d{2})|(\d{3}))T(?:(\d{2}):(\d{2})(?::(\d{2}))?)?")
_LINE_LENGTH = 69
_ANY_OBJECT = 10_000
"""Catalogue number of no meaning here, of the five digits that brahe wants."""
_DEFAULT_DEGREE = 7
"""Of the interpolating polynomial, where a file names none."""
_HIGHEST_DEGREE = 15


class OrbitMotion(Protocol):
    """Motion of one object over some time."""

    @property
    def epoch(self) -> datetime:
        """First instant at which the motion is known best, UTC."""

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state at a date in UTC.

        Raises:
            ValueError: the motion is not known then.
        """


@dataclass(frozen=True)
class Sgp4Motion(OrbitMotion):
    """An element set of SGP4.

    Attributes:
        propagator: of brahe.
        what: it comes from, for sentences.
    """

    propagator: Any
    what: str

    @property
    def epoch(self) -> datetime:
        """Epoch of the elements, UTC, to a microsecond."""
        return utc_datetime(self.propagator.epoch)

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state at a date; as in `OrbitMotion.state_at`."""
        days = (date - self.epoch).total_seconds() / 86400.0
        if abs(days) > LONGEST_SGP4:
            raise ValueError(
                f"the elements of {self.what} are of {_text(self.epoch)}, {abs(days):.1f} days "
                f"{'before' if days > 0.0 else 'after'} time zero at {_text(date)}; SGP4 is taken over at "
                f"most {LONGEST_SGP4:g} days"
            )
        return _state(self.propagator.state_gcrf, date, self.what)


@dataclass(frozen=True)
class TabulatedMotion(OrbitMotion):
    """Tabulated states.

    Attributes:
        compute: the GCRF state, m and m/s, shape (6,), at an epoch of brahe.
        begin: first state, UTC.
        end: last one, UTC.
        what: it comes from, for sentences.
    """

    compute: Callable[[Any], Array]
    begin: datetime
    end: datetime
    what: str

    @property
    def epoch(self) -> datetime:
        """Of the first state, UTC, to a microsecond."""
        return self.begin

    def state_at(self, date: datetime) -> OrbitalState:
        """The inertial state at a date; as in `OrbitMotion.state_at`."""
        if not self.begin <= date <= self.end:
            raise ValueError(
                f"{self.what} has states from {_text(self.begin)} to {_text(self.end)}, and none at time "
                f"zero, {_text(date)}"
            )
        return _state(self.compute, date, self.what)


def from_lines(lines: Sequence[str], what: str) -> Sgp4Motion:
    """Motion by two-line elements.

    Args:
        lines: two, or three of which the first is a name.
        what: they come from, for sentences.

    Raises:
        ValueError: they are no such elements.
    """
    given = [line.rstrip() for line in lines if line.strip()]
    if len(given) not in (2, 3):
        raise ValueError(f"{what} has {len(given)} lines; two-line elements have two, or three with a name")
    first, second = given[-2:]
    for number, line in ((1, first), (2, second)):
        if len(line) != _LINE_LENGTH or not line.isascii() or not line.startswith(f"{number} "):
            raise ValueError(
                f"{what}: line {number} of two-line elements has {_LINE_LENGTH} characters and begins with "
                f'"{number} "; found {len(line)} characters, "{line[:20]}..."'
            )
        checksum = str(_brahe().calculate_tle_line_checksum(line))
        if line[-1] != checksum:
            raise ValueError(
                f"{what}: line {number} ends with the checksum {line[-1]}, and its sum is {checksum}"
            )
    if first[2:7] != second[2:7]:
        raise ValueError(f"{what}: line 1 is of object {first[2:7]}, line 2 of {second[2:7]}")
    if not (first[18:20] + first[20:32].replace(".", "")).replace(" ", "0").isdigit():
        raise ValueError(f"{what}: found {first[18:32]!r} for the epoch in line 1")
    return _propagator(lambda: _brahe().SGPPropagator.from_tle(first, second), what)


def from_tle(file: NamedFile) -> Sgp4Motion:
    """Motion by a file of two-line elements.

    Raises:
        ValueError: it is no such file.
    """
    return from_lines(_content(file).splitlines(), file.name)


def from_omm(file: NamedFile) -> Sgp4Motion:
    """Motion by the mean elements of an OMM file in key-value notation, XML or JSON.

    Raises:
        ValueError: it is no such file.
    """
    from brahe.ccsds import OMM  # noqa: PLC0415  slow to import

    message: Any = _read(lambda: OMM.from_str(_content(file)), file, "an OMM file")
    _only("CENTER_NAME", message.center_name, {"EARTH"}, file)
    _only("REF_FRAME", message.ref_frame, {"TEME"}, file)
    _only("TIME_SYSTEM", message.time_system, {"UTC"}, file)
    _only("MEAN_ELEMENT_THEORY", message.mean_element_theory, {"SGP4", "SGP/SGP4"}, file)
    motion, e = message.mean_motion, message.eccentricity
    angles = (message.inclination, message.ra_of_asc_node, message.arg_of_pericenter, message.mean_anomaly)
    rates = tuple(
        value or 0.0 for value in (message.bstar, message.mean_motion_dot, message.mean_motion_ddot)
    )
    if motion is None or not (0.0 < motion < 20.0):
        raise ValueError(
            f"{file.name}: found MEAN_MOTION {motion}; it should be above 0 and below 20 rev/day"
        )
    if not (0.0 <= e < 1.0 and all(math.isfinite(value) for value in (*angles, *rates))):
        raise ValueError(f"{file.name}: found ECCENTRICITY {e} and angles {angles}, which no orbit has")
    bstar, dot, second = rates
    return _propagator(
        lambda: _brahe().SGPPropagator.from_omm_elements(
            message.epoch,
            motion,
            e,
            *angles,
            _ANY_OBJECT,
            bstar=bstar,
            mean_motion_dot=dot,
            mean_motion_ddot=second,
        ),
        file.name,
    )


def from_oem(file: NamedFile) -> TabulatedMotion:
    """Motion by the ephemeris of an OEM file of one segment in key-value notation, XML or JSON.

    Between two states position and velocity are each interpolated by Lagrange's polynomial of the degree that
    the file names, 7 where it names none. Where it asks for Hermite's, one polynomial takes on positions and
    velocities of half of (degree + 1) states around the date, and its derivative is the velocity.

    Raises:
        ValueError: it is no such file.
    """
    from brahe.ccsds import OEM  # noqa: PLC0415  slow to import

    message: Any = _read(lambda: OEM.from_str(_content(file)), file, "an OEM file")
    if len(message.segments) != 1:
        raise ValueError(f"{file.name} has {len(message.segments)} segments; an OEM file here has one")
    segment = message.segments[0]
    _only("CENTER_NAME", segment.center_name, {"EARTH"}, file)
    _only("REF_FRAME", segment.ref_frame, _FRAMES, file)
    _only("TIME_SYSTEM", segment.time_system, _SCALES, file)
    count = segment.num_states
    if count < 2:
        raise ValueError(f"{file.name} has {count} states; an OEM file here has two at least")
    trajectory: Any = _read(lambda: message.segment_to_trajectory(0), file, "an OEM file")
    epochs = list(trajectory.epochs())
    dates: list[datetime] = _read(lambda: [utc_datetime(epoch) for epoch in epochs], file, "an OEM file")
    if any(later <= earlier for earlier, later in itertools.pairwise(dates)):
        raise ValueError(
            f"{file.name}: the states of an OEM file follow each other in time, and these do not"
        )
    degree = min(segment.interpolation_degree or _DEFAULT_DEGREE, _HIGHEST_DEGREE)
    method = _brahe().InterpolationMethod
    if (segment.interpolation or "").strip().upper() == "HERMITE":
        # At its states this method gives the states themselves.
        trajectory.set_interpolation_method(method.LINEAR)
        compute = _by_hermite(trajectory, epochs, min(max(2, (degree + 1) // 2), count))
    else:
        trajectory.set_interpolation_method(method.lagrange(max(1, min(degree, count - 1))))
        compute = trajectory.state_gcrf
    return TabulatedMotion(compute, dates[0], dates[-1], file.name)


def _by_hermite(trajectory: Any, epochs: Sequence[Any], points: int) -> Callable[[Any], Array]:
    """Interpolation by Hermite's polynomial through the states about an epoch.

    Args:
        trajectory: of brahe.
        epochs: of its states, in order of time.
        points: states that the polynomial goes through, at most as many as there are.

    Returns:
        The GCRF state, m and m/s, shape (6,), at an epoch within the trajectory.
    """
    from scipy.interpolate import KroghInterpolator  # noqa: PLC0415  slow to import

    seconds = np.array([epoch - epochs[0] for epoch in epochs])

    def compute(epoch: Any) -> Array:
        time = float(epoch - epochs[0])
        after = int(np.searchsorted(seconds, time, side="right"))
        begin = min(max(after - points // 2, 0), len(epochs) - points)
        chosen = slice(begin, begin + points)
        states = np.array([trajectory.state_gcrf(node) for node in epochs[chosen]])
        span = float(seconds[chosen][-1] - seconds[chosen][0])
        # A time that occurs twice has a value and a derivative.
        given = np.stack((states[:, :3], span * states[:, 3:]), axis=1).reshape(-1, 3)
        polynomial = KroghInterpolator(np.repeat((seconds[chosen] - time) / span, 2), given)
        return np.concatenate((polynomial(0.0), polynomial.derivative(0.0) / span))

    return compute


def _brahe() -> Any:
    """The package, whose type stubs have less than its documentation."""
    import brahe  # noqa: PLC0415  slow to import

    return brahe


def _failures() -> tuple[type[BaseException], ...]:
    """What brahe raises where its input is not to be computed with."""
    return (ValueError, RuntimeError, OverflowError, _brahe().BraheError, _brahe().PanicException)


def _content(file: NamedFile) -> str:
    try:
        text = file.content.decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError(f"{file.name} is not UTF-8 text") from None
    for found in _DATE.finditer(text):
        if not _exists(*found.groups(default="")):
            raise ValueError(f"{file.name} has the date {found[0]}, which does not exist")
    return text


def _exists(year: str, month: str, day: str, day_of_year: str, hour: str, minute: str, second: str) -> bool:
    """Whether a date of these digits exists; parts that are left out are empty, and seconds go up to 60."""
    try:
        first = date(int(year), int(month or 1), int(day or 1))
    except ValueError:
        return False
    if day_of_year and not 1 <= int(day_of_year) <= (366 if isleap(first.year) else 365):
        return False
    return int(hour or 0) < 24 and int(minute or 0) < 60 and int(second or 0) <= 60


def _read(read: Any, file: NamedFile, kind: str) -> Any:
    try:
        return read()
    except _failures() as error:
        if str(error).startswith(file.name):
            raise ValueError(str(error)) from None
        raise ValueError(f"{file.name} is not {kind} that can be read: {error}") from None


def _only(field: str, found: str | None, allowed: set[str], file: NamedFile) -> None:
    if (found or "").strip().upper() not in allowed:
        raise ValueError(f"{file.name}: found {field} {found}; it should be {' or '.join(sorted(allowed))}")


def _propagator(make: Any, what: str) -> Sgp4Motion:
    try:
        # The propagator turns its first state into GCRF.
        return Sgp4Motion(_with_earth(J2000, lambda _: make()), what)
    except _failures() as error:
        raise ValueError(f"{what} has no elements that SGP4 takes: {error}") from None


def _with_earth(date: datetime, compute: Any) -> Any:
    """What a function of brahe's epoch gives with UT1 = UTC and no offsets of the pole."""
    from satform.orbits.earth_orientation import without_file  # noqa: PLC0415  imports brahe

    epoch = brahe_epoch(date)
    with without_file().in_use(epoch):
        return compute(epoch)


def _state(compute: Any, date: datetime, what: str) -> OrbitalState:
    try:
        state = np.asarray(_with_earth(date, compute), dtype=np.float64)
    except _failures() as error:
        raise ValueError(f"{what} gives no state at {_text(date)}: {error}") from None
    if not np.all(np.isfinite(state)):
        raise ValueError(f"{what} gives no finite state at {_text(date)}")
    return OrbitalState.from_array(state)


def _text(date: datetime) -> str:
    return date.strftime("%Y-%m-%dT%H:%M:%S") + " UTC"
