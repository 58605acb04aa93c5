# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Blocks of steps of many runs: the quantities that are asked for, taken down while they are flown."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from satform.attitude.guidance import Orientation
from satform.attitude.pointing_accuracy import attitude_figures
from satform.flight.compile import FormationPlan
from satform.flight.plant import Plant
from satform.numeric.elementwise import Array, Indices
from satform.record.flight_block import FlightBlock
from satform.record.quantities import (
    ATTITUDE_VECTORS,
    POINTING,
    PROPULSION,
    QUANTITIES,
    WHEEL_COUNTERS,
    Equipment,
)

_FOR_POINTING = (
    *("position", "velocity", "mrp", "angular_velocity"),
    *("reference_position", "reference_velocity", "reference_acceleration"),
)
"""What the figures of pointing are made of."""


class Announced(Protocol):
    """What all satellites have decided and sent."""

    sent: Array

    def values(self, name: str) -> Array | None:
        """What was decided, by name."""


class BlockRecorder:
    """Takes down the quantities of a block of steps."""

    def __init__(
        self,
        formation: FormationPlan,
        orientations: Sequence[Sequence[Orientation | None]],
        quantities: frozenset[str],
    ) -> None:
        """A recorder before the first step.

        Args:
            formation: plan of one of the runs.
            orientations: where the satellites of each run point.
            quantities: that are asked for, by the names of a flight record.

        Raises:
            KeyError: there is no quantity of a name.
        """
        unknown = sorted(quantities - set(QUANTITIES))
        if unknown:
            raise KeyError(f"a flight record has no {', '.join(unknown)}")
        satellites = formation.topics.satellites
        self._formation = formation
        self._orientations = list(orientations)
        self._asked = quantities
        self._turns = any(satellite.attitude for satellite in satellites)
        self._filters = any(satellite.filter for satellite in satellites)
        self._points = self._turns and bool(quantities & set(POINTING))
        taken = quantities | (set(_FOR_POINTING) if self._points else set())
        lacking: set[Equipment] = set() if self._turns else {"attitude", "pointing"}
        lacking |= set() if self._filters else {"filter"}
        lacking |= set() if any(satellite.plans for satellite in satellites) else {"plans"}
        # Satellites with filters of their attitudes are not flown here.
        lacking.add("attitude_filter")
        self._empty = {name for name in quantities if QUANTITIES[name].equipment in lacking}
        self._taken = sorted(taken - self._empty - set(POINTING))
        self._first = self._steps = self._row = 0
        self._last = False
        self._values: dict[str, Array] = {}

    def begin(self, first_step: int, steps: int, runs: int, *, last: bool) -> None:
        """Begin a block.

        Args:
            first_step: number of its first step.
            steps: in it.
            runs: that fly.
            last: whether the state after the last step belongs to it.
        """
        self._first, self._steps, self._row, self._last = first_step, steps, 0, last
        rows = runs * len(self._formation.names)
        self._values = {}
        for name in self._taken:
            quantity = QUANTITIES[name]
            memory = np.empty((steps + 1, *quantity.shape, rows))
            if quantity.equipment:
                # What a satellite does not have stands as in a flight record.
                memory.fill(quantity.without)
            self._values[name] = np.moveaxis(memory, -1, 1)

    def known(self, plant: Plant, whole: Announced) -> None:
        """Take down what is known at the start of a step."""
        row, values = self._row, self._values
        motion, measured = plant.motion(), plant.measured()
        whole_motion = {
            "position": motion.position,
            "velocity": motion.velocity,
            "measured_position": measured.position,
            "measured_velocity": measured.velocity,
        }
        for name, numbers in whole_motion.items():
            if name in values:
                values[name][row] = numbers
        phases = self._formation.announces == "arc_length"
        for index, name in enumerate(("arc_length", "rate")):
            if name in values:
                values[name][row] = whole.sent[index] if phases else 0.0
        if plant.thrusters is not None:
            for name in PROPULSION:
                if name in values:
                    values[name][row][plant.thrusters.members] = getattr(plant.thrusters.propulsion, name)
        if self._turns:
            self._turned(plant)

    def _turned(self, plant: Plant) -> None:
        row, values = self._row, self._values
        for group in plant.turning:
            measured = group.measured()
            for name in ATTITUDE_VECTORS:
                if name in values:
                    values[name][row][group.members] = getattr(measured, name)
            for name in WHEEL_COUNTERS:
                if name in values:
                    values[name][row][group.members] = getattr(group.state, name)

    def decided(self, whole: Announced) -> None:
        """Take down what was decided in the step."""
        row, values = self._row, self._values
        for name in self._taken:
            if QUANTITIES[name].of_states or name == "applied_acceleration":
                continue
            if name in ("estimated_position_error", "estimated_velocity_error"):
                part = name.removeprefix("estimated_").removesuffix("_error")
                reference, estimated = whole.values(f"reference_{part}"), whole.values(f"estimated_{part}")
                assert reference is not None and estimated is not None  # noqa: S101, PT018 - always decided
                np.subtract(estimated, reference, out=values[name][row])
                continue
            numbers = whole.values(name)
            if numbers is not None:
                values[name][row] = numbers

    def applied(self, plant: Plant) -> None:
        """Take down what was applied in the step, the last thing in it."""
        if "applied_acceleration" in self._values:
            self._values["applied_acceleration"][self._row] = plant.applied
        self._row += 1

    def keep(self, runs: Indices) -> None:
        """Go on with some of the runs that fly."""
        self._orientations = [self._orientations[run] for run in runs.tolist()]

    def block(self, runs: int, flying: Indices) -> FlightBlock:
        """The block.

        Args:
            runs: in all.
            flying: indices of those that were flown; the numbers of the others are zero.
        """
        count, steps = len(self._formation.names), self._steps
        found: dict[str, Array] = {}
        for name, values in self._values.items():
            rows = steps + 1 if self._last and QUANTITIES[name].of_states else steps
            found[name] = self._of_all(values[:rows], runs, flying)
        if self._points:
            found.update(self._pointing(runs, flying))
        for name in self._empty:
            found[name] = np.empty((0, runs, count, *QUANTITIES[name].shape))
        return FlightBlock(
            satellites=self._formation.names,
            step=self._formation.timing.step,
            first_step=self._first,
            steps=steps,
            runs=runs,
            last=self._last,
            quantities={name: found[name] for name in found if name in self._asked},
        )

    def _of_all(self, values: Array, runs: int, flying: Indices) -> Array:
        """Shape (rows, M, ...) to (rows, R, N, ...)."""
        count = len(self._formation.names)
        memory = np.moveaxis(values, 1, -1)
        if len(flying) < runs:
            every = np.zeros((*memory.shape[:-1], runs, count))
            every[..., flying, :] = memory.reshape(*memory.shape[:-1], len(flying), count)
        else:
            every = memory.reshape(*memory.shape[:-1], runs, count)
        return np.moveaxis(every, (-2, -1), (1, 2))

    def _pointing(self, runs: int, flying: Indices) -> dict[str, Array]:
        count, steps = len(self._formation.names), self._steps
        figures = {name: np.full((steps, runs, count), np.nan) for name in POINTING}
        for index, run in enumerate(flying.tolist()):
            own = slice(index * count, (index + 1) * count)
            measured: dict[str, Any] = {}
            for name in _FOR_POINTING:
                measured[name] = self._values[name][: steps + QUANTITIES[name].of_states, own]
            step = self._formation.timing.step
            of_run = attitude_figures(self._orientations[index], step, measured, self._first)
            for name, numbers in of_run.items():
                figures[name][:, run] = numbers
        return figures
