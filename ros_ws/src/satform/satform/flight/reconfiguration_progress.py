# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How far satellites are from their new targets, and what they have spent on the way."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from satform.flight.compile import FormationPlan
from satform.flight.online_parameters import target_path
from satform.membership.reconfiguration import TargetSpec
from satform.numeric.elementwise import Array, norm
from satform.orbits.path_reference import Path


@dataclass(frozen=True)
class Arrival:
    """When a reconfiguration counts as done.

    Attributes:
        tolerance: distance from the target within which a satellite has reached it, m.
        hold: steps for which all satellites have to stay within the tolerance.
        timeout: steps after the change until then; None for any number.
    """

    tolerance: float
    hold: int
    timeout: int | None


class ReconfigurationProgress:
    """Distances and delta-v of the satellites of one reconfiguration, step by step.

    Attributes:
        satellites: their indices.
        since: the first step with the new targets.
        distance: of each from its target, m, shape (M,); NaN before the change and while it is lost.
        delta_v: of each since the change, m/s, shape (M,).
        fraction: part of the way, 0 to 1, of the satellite that lacks most; within the tolerance it is 1.
    """

    def __init__(
        self, plan: FormationPlan, targets: Mapping[int, TargetSpec], since: int, arrival: Arrival
    ) -> None:
        """Nothing has been flown yet.

        Args:
            plan: of the flight's parts.
            targets: new ones, each with what it leaves out from the target before, by the satellites'
                indices.
            since: the first step with them.
            arrival: when they count as reached.
        """
        self.satellites = list(targets)
        self.since = since
        self.distance: Array = np.full(len(self.satellites), np.nan)
        self.delta_v: Array = np.zeros(len(self.satellites))
        self.fraction = 0.0
        self._arrival = arrival
        self._first = self.distance.copy()
        self._within = 0
        self._last_step = since
        self._duration = plan.timing.step
        self._paths: list[Path] = []
        self._offsets: list[float] = []
        for index, spec in targets.items():
            own = plan.parameters(index)
            self._paths.append(target_path(own, spec, plan.satellite(index).path))
            self._offsets.append(own.phase_offset if spec.phase_offset is None else spec.phase_offset)

    def update(
        self,
        step: int,
        position: Array,
        applied: Array,
        phases: Sequence[float | None],
        alive: NDArray[np.bool_],
    ) -> None:
        """Take in the states of a step.

        Args:
            step: its number.
            position: true ones of all satellites at this step, LVLH, m, shape (N, 3).
            applied: acceleration of all satellites in the step before, m/s^2, shape (N, 3).
            phases: of the satellites of the reconfiguration at this step, m; None for one not known.
            alive: whether each satellite of the formation takes part, shape (N,).
        """
        if step < self.since:
            return
        self._last_step = step
        if step > self.since:
            self.delta_v = self.delta_v + norm(applied[self.satellites]) * self._duration
        for row, (index, phase) in enumerate(zip(self.satellites, phases, strict=True)):
            known = bool(alive[index]) and phase is not None
            self.distance[row] = self._distance(row, position[index], phase) if known else np.nan
        self._first = np.where(np.isnan(self._first), self.distance, self._first)
        near = self.distance <= self._arrival.tolerance
        flying = ~np.isnan(self.distance)
        self._within = self._within + 1 if flying.any() and near[flying].all() else 0
        ratio = self.distance / np.maximum(self._first, np.finfo(float).tiny)
        ratio = np.where(near, 0.0, ratio)[flying]
        self.fraction = float(np.clip(1.0 - ratio.max(), 0.0, 1.0)) if flying.any() else 0.0

    @property
    def reached(self) -> bool:
        """Whether all satellites that fly are within the tolerance, and have been for long enough."""
        return self._within > max(0, self._arrival.hold)

    @property
    def timed_out(self) -> bool:
        """Whether the targets should have been reached by now."""
        timeout = self._arrival.timeout
        return timeout is not None and self._last_step - self.since >= timeout

    def _distance(self, row: int, position: Array, phase: float | None) -> float:
        path = self._paths[row]
        arc_length = np.asarray((phase or 0.0) + self._offsets[row])
        still = np.zeros_like(arc_length)
        return float(norm(position - path.reference(arc_length, still, still).position))
