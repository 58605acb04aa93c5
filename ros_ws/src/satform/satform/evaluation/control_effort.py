# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of control effort: commanded acceleration and delta-v."""

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np

from satform.control.coast import CoastSpec
from satform.control.protocol import FlightSetting
from satform.evaluation.reducers import ExtremeOf, LargestSum, MeanOf
from satform.numeric.elementwise import Array
from satform.record.flight_block import FlightBlock, StepEnds
from satform.record.reducer import FlightShape, Reducer
from satform.record.stretch import TIME_SLACK, Stretch
from satform.scenario.parts import SatelliteSpec, Timing
from satform.scenario.windowed_expectation import OverWindow


class _OfCommands(OverWindow):
    """An expectation of what satellites command: nothing is judged where all that are meant coast."""

    def complaints_about_satellites(
        self, satellites: Mapping[str, SatelliteSpec], announces: str
    ) -> list[str]:
        found = super().complaints_about_satellites(satellites, announces)
        meant = [satellites[name] for name in self.satellites or satellites]
        if all(isinstance(own.controller, CoastSpec) and own.thruster is None for own in meant):
            names = ", ".join(own.name for own in meant)
            coast = "coasts" if len(meant) == 1 else "coast"
            found.append(f"{names} {coast} and cannot command anything else")
        return found


class Control(_OfCommands):
    """Mean, smallest or largest magnitude of the commanded acceleration, in m/s^2."""

    unit = "m/s²"
    figure_name = "{0.statistic} control"
    kind: Literal["control"] = "control"
    statistic: Literal["mean", "minimum", "maximum"] = "mean"
    """Mean over the stretch, or its smallest or largest value."""

    def holds_in_part(self) -> bool:
        return self.statistic != "mean" and self.extreme_holds_in_part(self.statistic)

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.steps, held=True)
        if self.statistic == "mean":
            return MeanOf(stretch, _commanded, ("control", "absent"))
        return ExtremeOf(stretch, _commanded, ("control", "absent"), which=self.statistic)


class DeltaV(_OfCommands):
    """Delta-v as the thrusters count it, or integral of an ideal command; the largest, in m/s."""

    unit = "m/s"
    figure_name = "delta-v"
    kind: Literal["delta_v"] = "delta_v"

    def holds_in_part(self) -> bool:
        # A part of a flight costs less: it is judged where nothing at all may be spent.
        return self.largest_allowed <= 0.0

    def reducer(self, flight: FlightShape) -> Reducer:
        return _SumOfEffort(self.stretch(flight, flight.steps, held=True), "effort")


class DeltaVPerOrbit(_OfCommands):
    """Delta-v per revolution of the chief, the mean of the stretch; the largest of the satellites, in m/s."""

    unit = "m/s"
    figure_name = "delta-v per orbit"
    kind: Literal["delta_v_per_orbit"] = "delta_v_per_orbit"

    def holds_in_part(self) -> bool:
        return self.largest_allowed <= 0.0

    def orbit_complaints(self, setting: FlightSetting, timing: Timing) -> list[str]:
        end, period = timing.duration if self.before is None else self.before, math.tau / setting.mean_motion
        if end - self.after >= period * (1 - TIME_SLACK):
            return []
        return [
            f"the stretch lasts {end - self.after:g} s, less than one revolution of {period:g} s; "
            "kind delta_v is for parts of a revolution"
        ]

    def reducer(self, flight: FlightShape) -> Reducer:
        stretch = self.stretch(flight, flight.steps, held=True)
        return _EffortPerOrbit(stretch, flight.step * flight.mean_motions / math.tau)


class _SumOfEffort(LargestSum):
    """The largest of the satellites' delta-v; a step of a block may end in the next one."""

    def __init__(self, stretch: Stretch, series: str) -> None:
        super().__init__(stretch, series)
        self._ends = StepEnds(self.needs)

    def update(self, block: FlightBlock) -> None:
        for ended in self._ends.take(block):
            super().update(ended)


class _EffortPerOrbit(_SumOfEffort):
    """The largest of the satellites' delta-v, over the orbits of the stretch."""

    def __init__(self, stretch: Stretch, orbits_per_step: Array) -> None:
        super().__init__(stretch, "effort")
        self._orbits_per_step = orbits_per_step

    def found(self) -> Array:
        return super().found() / (self._reader.rows * self._orbits_per_step)


def _commanded(block: FlightBlock) -> Array:
    # Who does not fly commands nothing, which is not the same as a command of zero.
    return np.where(block.absent, np.nan, block.control) if block.any_absent else block.control
