# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Record of a flight: plain arrays, the same from an in-process run and from a bag."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from satform.common.name_list import listed
from satform.numeric.elementwise import Array
from satform.orbits.inertial_motion import ChiefMotion
from satform.record.derived import COLUMNS, DerivedQuantities
from satform.record.early_end import EarlyEnd
from satform.record.link_history import LinkHistory
from satform.record.navigation_history import NavigationHistory
from satform.record.quantities import OPTIONAL, ORBITAL, QUANTITIES
from satform.record.tables import dataset, frame


@dataclass(frozen=True)
class SatelliteRecord:
    """The flight of one satellite: `record["sat1"].position` and so on, without the satellites' axis.

    Every quantity of `FlightRecord` with a column for each satellite is an attribute, derived ones such as
    `tracking_error` too; shapes (K,) or (K, 3), with K + 1 for states.

    Attributes:
        name: of the satellite.
        record: of the whole flight.
        column: index of the satellite in the record's arrays.
    """

    name: str
    record: "FlightRecord"
    column: int

    def __getattr__(self, quantity: str) -> Array:
        """The satellite's column of a quantity of the record."""
        if quantity not in COLUMNS and quantity not in ORBITAL:
            known = ", ".join((*COLUMNS, *ORBITAL))
            raise AttributeError(f"a satellite's record has no {quantity}; it has time, {known}")
        values: Array = getattr(self.record, quantity)[:, self.column]
        return values

    def __dir__(self) -> list[str]:
        return ["name", "record", "column", "time", *COLUMNS, *ORBITAL]

    def __repr__(self) -> str:
        return f"<SatelliteRecord {self.name}: {self.record.steps} steps of {self.record.step:g} s>"

    @property
    def time(self) -> Array:
        """Simulated time of every state, s, shape (K + 1,)."""
        return self.record.time


@dataclass(frozen=True, repr=False)
class FlightRecord(DerivedQuantities):
    """A whole flight of N satellites over K control steps.

    Quantities known at the start of a step have K + 1 rows (the last is the state after the last
    step); quantities decided in a step have K rows. Vectors are in the chief's LVLH frame.

    Attributes:
        satellites: names, in the order of the columns.
        step: control period, s.
        position: true, m, shape (K + 1, N, 3).
        velocity: true, in the rotating frame, m/s, shape (K + 1, N, 3).
        measured_position: of the satellite at the step, m, shape (K + 1, N, 3); the truth
            where there is no sensor.
        measured_velocity: the same of the velocity, m/s, shape (K + 1, N, 3).
        acceleration: commanded, m/s^2, shape (K, N, 3).
        applied_acceleration: what the thrusters made of it, m/s^2, shape (K, N, 3); the command where
            there is no thruster.
        arc_length: generalised, less the satellite's phase offset, as announced to the neighbours, m,
            shape (K + 1, N); zero where satellites send each other their motion instead.
        rate: of the generalised arc length, m/s, shape (K + 1, N); zero likewise.
        reference_position: m, shape (K, N, 3).
        reference_velocity: m/s, shape (K, N, 3).
        reference_acceleration: feed-forward used in the step, m/s^2, shape (K, N, 3).
        sliding_variable: m/s, shape (K, N, 3).
        estimated_position_error: estimated position less reference, after the filter if the
            satellite has one, m, shape (K, N, 3).
        estimated_velocity_error: the same of the velocity, m/s, shape (K, N, 3).
        propellant: left, kg, shape (K + 1, N); NaN where there is no thruster.
        delta_v: applied by the thrusters so far, m/s, shape (K + 1, N); NaN where there is no thruster.
        saturated_steps: steps so far in which the command was above the thrust limit, shape (K + 1, N).
        below_minimum_impulse_steps: steps so far in which it was below the smallest impulse, shape
            (K + 1, N).
        propellant_depleted_steps: steps so far in which the tank could not give it, shape (K + 1, N).
        mrp: true attitude, inertial to body, shape (K + 1, N, 3); this and what follows is not a number
            for satellites without attitude, and has no rows when no satellite has one.
        angular_velocity: true, of the body, body components, rad/s, shape (K + 1, N, 3).
        wheel_momentum: of each wheel, N m s, shape (K + 1, N, 3).
        wheel_torque: commanded, N m, shape (K, N, 3).
        torque_saturated_steps: steps so far in which a wheel's torque limit was met, shape (K + 1, N).
        momentum_saturated_steps: steps so far in which a wheel's momentum limit was met, shape (K + 1, N).
        pointing_error: between boresight and target, as both truly were, rad, shape (K, N).
        panel_to_sun: cosine of the angle between panel axis and sun, its magnitude, shape (K, N).
        attitude_error: length of the modified Rodrigues parameters to the desired attitude, (K, N).
        attitude_rate_error: length of the angular velocity relative to the desired one, rad/s, (K, N).
        estimate_covariance: of the error of the filter's (position, velocity) in m and m/s, shape
            (K, N, 6, 6); this and what follows is not a number for satellites without a filter, and has no
            rows when no satellite has one.
        innovation: normalised innovation squared of the newest measurement, shape (K, N); 0 at first.
        rejected_measurements: so far, by the innovation gate, shape (K, N).
        unsolved_plans: of the step, that the control law's solver did not finish, shape (K, N); not a number
            for satellites whose law makes no plans, and without rows when no satellite has one.
        estimated_mrp: attitude by the satellite's filter, as `mrp`, shape (K, N, 3); this and the following
            are not a number for satellites without such a filter, and without rows when no satellite has one.
        estimated_angular_velocity: likewise, rad/s, shape (K, N, 3).
        estimated_gyro_bias: rad/s, body axes, shape (K, N, 3).
        attitude_covariance: of (small rotation from estimated to true body axes, error of the gyro bias), rad
            and rad/s, shape (K, N, 6, 6).
        attitude_innovation: normalised innovation squared of the star tracker's newest reading, shape (K, N).
        rejected_attitudes: readings of star trackers so far that the gate rejected, shape (K, N).
        early_end: why the flight ended before its last step; None when it did not. The record then ends
            with the last state within the limits, and holds no number beyond them.
        clocked: whether the flight went by the wall clock, so that satellites may have skipped steps. Of
            such a step the command before is held, and all else that the satellite computes is NaN.
        navigation: readings of sensors and estimates of the whole formation; None where no satellite has
            sensors.
        chief_source: computes the chief's motion up to a number of steps, or gives None where it is not
            known; None where the record has no scenario. It is used when an inertial quantity is asked for.
        link_source: computes what the links of the flight did; likewise.
        central_source: computes what a filter with the readings of all satellites estimates; likewise.
    """

    satellites: tuple[str, ...]
    step: float
    position: Array
    velocity: Array
    measured_position: Array
    measured_velocity: Array
    acceleration: Array
    applied_acceleration: Array
    arc_length: Array
    rate: Array
    reference_position: Array
    reference_velocity: Array
    reference_acceleration: Array
    sliding_variable: Array
    estimated_position_error: Array
    estimated_velocity_error: Array
    propellant: Array
    delta_v: Array
    saturated_steps: Array
    below_minimum_impulse_steps: Array
    propellant_depleted_steps: Array
    mrp: Array
    angular_velocity: Array
    wheel_momentum: Array
    wheel_torque: Array
    torque_saturated_steps: Array
    momentum_saturated_steps: Array
    pointing_error: Array
    panel_to_sun: Array
    attitude_error: Array
    attitude_rate_error: Array
    estimate_covariance: Array
    innovation: Array
    rejected_measurements: Array
    unsolved_plans: Array
    estimated_mrp: Array
    estimated_angular_velocity: Array
    estimated_gyro_bias: Array
    attitude_covariance: Array
    attitude_innovation: Array
    rejected_attitudes: Array
    early_end: EarlyEnd | None = None
    clocked: bool = False
    navigation: NavigationHistory | None = None
    chief_source: Callable[[int], ChiefMotion | None] | None = None
    link_source: Callable[["FlightRecord"], LinkHistory] | None = None
    central_source: Callable[["FlightRecord"], Array | None] | None = None

    def __getitem__(self, satellite: str) -> SatelliteRecord:
        """The flight of one satellite.

        Args:
            satellite: its name.

        Raises:
            KeyError: the flight has no satellite of this name.
        """
        if satellite not in self.satellites:
            raise KeyError(f"no satellite {satellite!r} in this flight; there are {listed(self.satellites)}")
        return SatelliteRecord(satellite, self, self.satellites.index(satellite))

    def __repr__(self) -> str:
        end = "" if self.early_end is None else f", ended early: {self.early_end.sentence}"
        flown = f"{self.steps} steps of {self.step:g} s, {self.steps * self.step:g} s in all"
        return f"<FlightRecord of {listed(self.satellites)}: {flown}{end}>"

    def quantities(self) -> dict[str, Array]:
        """All arrays by name."""
        return {name: getattr(self, name) for name in QUANTITIES}

    @cached_property
    def chief(self) -> ChiefMotion | None:
        """The chief in inertial space at every state; None where the record does not give it."""
        return None if self.chief_source is None else self.chief_source(self.steps)

    @cached_property
    def links(self) -> LinkHistory | None:
        """What the links between satellites did; None where the record has no scenario."""
        return None if self.link_source is None else self.link_source(self)

    @cached_property
    def central_estimate(self) -> Array | None:
        """Position (m) and velocity (m/s) of all satellites by a filter that has the readings of all, LVLH.

        Shape (K, N, 6). None where the record has no scenario, or no satellite estimates the whole formation.
        """
        return None if self.central_source is None else self.central_source(self)

    @property
    def inertial_position(self) -> Array:
        """True, GCRF, m, shape (K + 1, N, 3).

        Raises:
            ValueError: the chief's motion is not known.
        """
        return self._inertial[0]

    @property
    def inertial_velocity(self) -> Array:
        """True, GCRF, m/s, shape (K + 1, N, 3); fails as `inertial_position` does."""
        return self._inertial[1]

    @property
    def chief_position(self) -> Array:
        """Of the chief, for every satellite the same, GCRF, m, shape (K + 1, N, 3)."""
        return np.broadcast_to(self._known_chief().position[:, None], self.position.shape)

    @property
    def chief_velocity(self) -> Array:
        """Of the chief, for every satellite the same, GCRF, m/s, shape (K + 1, N, 3)."""
        return np.broadcast_to(self._known_chief().velocity[:, None], self.position.shape)

    @cached_property
    def relative_elements(self) -> Array:
        """Osculating a da, a dlambda, a dex, a dey, a dix, a diy, m, shape (K + 1, N, 6).

        Quasi-nonsingular relative orbital elements times the chief's semi-major axis; NaN where the chief's
        orbit lies in the equator.

        Raises:
            ValueError: the chief's motion is not known.

        Source: D'Amico 2010.
        """
        return self._known_chief().relative_elements(*self._inertial)

    def orbital_quantities(self) -> dict[str, Array]:
        """Inertial states and relative elements by name; empty where the chief's motion is not known."""
        return {} if self.chief is None else {name: getattr(self, name) for name in ORBITAL}

    @cached_property
    def _inertial(self) -> tuple[Array, Array]:
        return self._known_chief().of_satellites(self.position, self.velocity)

    def _known_chief(self) -> ChiefMotion:
        if self.chief is not None:
            return self.chief
        if self.chief_source is None:
            raise ValueError(
                "inertial quantities need the flight's scenario, which this record does not have: see "
                "satform.with_chief"
            )
        raise ValueError(
            "this flight has no inertial quantities: its truth model has no date or no plane of the chief's "
            "orbit; give orbit.chief, or fly cw_perturbed or inertial, which have both"
        )

    def to_xarray(self, *, orbital: bool = False) -> Any:
        """The flight as an `xarray.Dataset` over `time`, `satellite` and `axis`; units in `attrs`.

        Quantities decided in a step are NaN at the last time.

        Args:
            orbital: whether to add `orbital_quantities`.

        Raises:
            ImportError: xarray is not installed.
        """
        return dataset(self.satellites, self.time, self._tabulated(orbital=orbital))

    def to_pandas(self, *, orbital: bool = False) -> Any:
        """The flight as a `pandas.DataFrame` with a row for each time and satellite; units in `attrs`.

        Quantities decided in a step are NaN at the last time.

        Args:
            orbital: whether to add `orbital_quantities`.

        Raises:
            ImportError: pandas is not installed.
        """
        return frame(self.satellites, self.time, self._tabulated(orbital=orbital))

    def _tabulated(self, *, orbital: bool) -> dict[str, Array]:
        return {**self.quantities(), **(self.orbital_quantities() if orbital else {})}

    @property
    def steps(self) -> int:
        """Number of control steps flown."""
        return len(self.acceleration)

    @property
    def time(self) -> Array:
        """Simulated time of every state, s, shape (K + 1,)."""
        time: Array = np.arange(self.steps + 1, dtype=np.float64) * self.step
        return time

    def first(self, steps: int) -> "FlightRecord":
        """The first steps of this flight, and the state after them.

        Args:
            steps: how many, no more than there are.
        """
        rows = {self.steps: steps, self.steps + 1: steps + 1}
        shortened = {
            name: array[: rows.get(len(array), 0)]
            for name, array in ((name, getattr(self, name)) for name in QUANTITIES)
        }
        navigation = None if self.navigation is None else self.navigation.first(steps)
        return replace(self, navigation=navigation, **shortened)

    def digest(self) -> str:
        """State hash: SHA-256 over names, shapes and bits of all arrays; equal for equal flights only."""
        found = hashlib.sha256(repr((self.satellites, self.step)).encode())
        for name, quantity in QUANTITIES.items():
            array = getattr(self, name)
            if name in OPTIONAL and not array.size:
                # A flight without filters or plans has nothing of this kind, not even a name.
                continue
            found.update(f"{quantity.hashed_as or name}{array.shape}".encode())
            # All that is not a number is hashed alike: its bits depend on who made it.
            found.update(np.where(np.isnan(array), np.nan, array).tobytes())
        for name, array in self.navigation_arrays().items():
            found.update(f"{name}{array.shape}".encode())
            found.update(np.where(np.isnan(array), np.nan, array).tobytes())
        return found.hexdigest()

    def navigation_arrays(self) -> dict[str, Array]:
        """Readings of sensors and estimates of the formation by name; none where no satellite has sensors."""
        return {} if self.navigation is None else self.navigation.arrays()

    def _compared(self) -> dict[str, Array]:
        """All arrays by name."""
        return {**self.quantities(), **self.navigation_arrays()}

    def differences(self, other: "FlightRecord") -> list[str]:
        """Where two records of the same flight are not the same to the last bit.

        Args:
            other: the record to compare with.

        Returns:
            A sentence for each quantity that differs, naming the first step at which it does;
            empty when every number of both records has the same bits.
        """
        found = []
        if self.satellites != other.satellites:
            found.append(f"satellites: {self.satellites} and {other.satellites}")
        if self.step != other.step:
            found.append(f"step: {self.step!r} s and {other.step!r} s")
        both = (self._compared(), other._compared())
        for name in both[0] | both[1]:
            mine, theirs = (arrays.get(name, np.empty(0)) for arrays in both)
            if mine.shape != theirs.shape:
                found.append(f"{name}: shapes {mine.shape} and {theirs.shape}")
                continue
            unequal = mine.view(np.uint64) != theirs.view(np.uint64)
            if unequal.any():
                first = int(np.argwhere(unequal)[0][0])
                found.append(f"{name}: {int(unequal.sum())} numbers differ, the first at step {first}")
        ends = ["its last step" if end is None else end.sentence for end in (self.early_end, other.early_end)]
        if ends[0] != ends[1]:
            found.append(f"end of the flight: {ends[0]}; and {ends[1]}")
        return found
