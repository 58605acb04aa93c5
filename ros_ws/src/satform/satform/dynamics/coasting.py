# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Inertial truth whose coasting satellites are moved over many control periods at once.

A satellite without a command is integrated ahead to the end of the present long step, at once with all
satellites that begin to coast at the same time, and its states at the control periods in between are kept. A
command ends that: the satellite goes through the control period with the fixed-step integrator, together with
the chief, whose axes the command turns with, and coasts anew afterwards. Long steps begin at whole multiples
of their length from time zero, so that a satellite's numbers depend on its own commands alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from satform.dynamics.collocation import (
    Collocation,
    Flags,
    FullAcceleration,
    accelerations,
    change,
    nodes,
)
from satform.dynamics.force_paths import along
from satform.dynamics.inertial import InertialDynamics, InertialState
from satform.dynamics.integrators import add_compensated
from satform.dynamics.orbital_forces import central_gravity, gravitational_parameter
from satform.numeric.elementwise import Array, Indices


@dataclass(frozen=True)
class Arc:
    """Motion that has been computed ahead.

    Attributes:
        first: number of the step from whose start it leads.
        rows: of chief (0) and satellites (from 1), ascending, shape (M,).
        motion: at the end of each step, as in `InertialState`, shape (n, 2, M, 3).
        remainder: likewise.
    """

    first: int
    rows: Indices
    motion: Array
    remainder: Array

    def covers(self, step: int) -> bool:
        """Whether it goes on through a step."""
        return self.first <= step < self.first + len(self.motion)

    def only(self, mask: Flags) -> "Arc":
        """Some of its rows, by a mask of shape (M,)."""
        return Arc(self.first, self.rows[mask], self.motion[:, :, mask], self.remainder[:, :, mask])


@dataclass(frozen=True)
class CoastingState(InertialState):
    """Where everything is, and where it will be unless a command comes.

    Attributes:
        arcs: no row is in two of them.
    """

    arcs: tuple[Arc, ...] = ()

    def keep(self, rows: Indices) -> "CoastingState":
        """The state of some rows, ascending, the chief's 0 among them."""
        arcs = []
        for arc in self.arcs:
            kept = np.isin(arc.rows, rows)
            arcs.append(replace(arc.only(kept), rows=np.searchsorted(rows, arc.rows[kept])))
        return CoastingState(self.time, self.motion[:, rows], self.remainder[:, rows], tuple(arcs))


@dataclass(frozen=True)
class CoastingDynamics(InertialDynamics):
    """Cowell propagation with long steps wherever no command acts.

    Attributes:
        collocation: integrator of these; the other one serves control periods with a command.
    """

    collocation: Collocation | None = None

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> CoastingState:
        """The state at time zero; arguments as in `Dynamics.start`."""
        begin = super().start(position_lvlh, velocity_lvlh)
        return CoastingState(begin.time, begin.motion, begin.remainder)

    def advance(self, state: InertialState, acceleration_lvlh: Array, step: int) -> CoastingState:
        """The state one control period later; arguments as in `Dynamics.advance`.

        Chief and satellites whose iteration does not converge go by the fixed-step integrator.
        """
        coasts = np.ones(state.motion.shape[1], bool)
        coasts[1:] = False if self.perturbations else ~acceleration_lvlh.any(axis=1)
        arcs = self._arcs(state, coasts, step)
        end = (step + 1) * self.period
        if len(arcs) == 1 and len(arcs[0].rows) == len(coasts):
            index = step - arcs[0].first
            return CoastingState(end, arcs[0].motion[index], arcs[0].remainder[index], arcs)
        motion, remainder = np.empty_like(state.motion), np.empty_like(state.remainder)
        thrusting = np.ones(len(coasts), bool)
        for arc in arcs:
            index = step - arc.first
            motion[:, arc.rows], remainder[:, arc.rows] = arc.motion[index], arc.remainder[index]
            thrusting[arc.rows] = False
        rows = np.flatnonzero(thrusting)
        if rows.size:
            moved = self._by_fixed_step(state, acceleration_lvlh, step, rows[rows > 0])
            begin = 0 if rows[0] == 0 else 1
            motion[:, rows], remainder[:, rows] = moved.motion[:, begin:], moved.remainder[:, begin:]
        return CoastingState(end, motion, remainder, arcs)

    def _arcs(self, state: InertialState, coasts: Flags, step: int) -> tuple[Arc, ...]:
        """What has been computed ahead, and is still to be flown, for this step."""
        arcs = []
        begins = coasts.copy()
        for arc in state.arcs if isinstance(state, CoastingState) else ():
            kept = coasts[arc.rows]
            if not arc.covers(step) or not kept.any():
                continue
            arcs.append(arc if kept.all() else arc.only(kept))
            begins[arcs[-1].rows] = False
        rows = np.flatnonzero(begins)
        ahead = self._ahead(state, rows, step) if rows.size else None
        return tuple(arcs) if ahead is None else (*arcs, ahead)

    def _ahead(self, state: InertialState, rows: Indices, step: int) -> Arc | None:
        """Motion of some rows to the end of the present long step, of those whose iteration converges.

        Returns:
            None if there is no such row.
        """
        assert self.collocation is not None  # noqa: S101 - `InertialDynamicsSpec` gives one
        periods, parts = self.collocation.division(self.period)
        steps = (step // periods + 1) * periods - step
        length = steps * self.period / parts
        fractions = tuple((index + 1) / steps for index in range(steps))
        motion, remainder = state.motion[:, rows], state.remainder[:, rows]
        for part in range(parts):
            full = self._at_nodes(step * self.period + part * length, length, rows)
            rates, converged = accelerations(motion, length, full)
            if not converged.all():
                rows, motion, remainder = rows[converged], motion[:, converged], remainder[:, converged]
                rates = rates[:, converged]
            if not rows.size:
                return None
            moved = change(fractions, length, motion[1], rates)
            reached, lost = add_compensated(motion, remainder, moved)
            motion, remainder = reached[-1], lost[-1]
        return Arc(step, rows, reached, lost)

    def _at_nodes(self, begin: float, length: float, rows: Indices) -> FullAcceleration:
        """All forces at the nodes of a long step, on some rows."""
        forces = along(self.forces, [begin + node * length for node in nodes()])
        parameter = gravitational_parameter()

        def acceleration(
            instants: Sequence[int], position: Array, velocity: Array, members: Indices
        ) -> Array:
            chosen = rows[members]
            bodies = [self.bodies[row] for row in chosen] if self.bodies else ()
            total = forces(instants, position, velocity, bodies)
            if self.keplerian_chief and chosen[0] == 0:
                total[:, 0] = central_gravity(position[:, 0], parameter)
            return total

        return acceleration

    def _by_fixed_step(self, state: InertialState, command: Array, step: int, rows: Indices) -> InertialState:
        """The chief, and beside it some satellites, by rows from 1, one control period later."""
        if len(rows) == state.motion.shape[1] - 1:
            return super().advance(state, command, step)
        both = np.concatenate(([0], rows))
        some = replace(self, bodies=tuple(self.bodies[row] for row in both) if self.bodies else ())
        part = InertialState(state.time, state.motion[:, both], state.remainder[:, both])
        return InertialDynamics.advance(some, part, command[rows - 1], step)
