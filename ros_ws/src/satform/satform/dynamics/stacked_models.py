# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Truth models of many runs as one: the rows of their states one after another.

A satellite's numbers do not depend on who else is moved, so that each run has the bits of a run alone. CW
models may differ in the chief's mean motion; models with a chief of their own have to share it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from satform.dynamics.coasting import CoastingState
from satform.dynamics.cw import DisturbedStep
from satform.dynamics.cw_model import CwDynamics, CwState, LvlhStateDynamics
from satform.dynamics.cw_perturbed import CwPerturbedDynamics, PropagatedChiefDynamics
from satform.dynamics.formula_model import FormulaDynamics
from satform.dynamics.inertial import InertialDynamics
from satform.dynamics.linear_j2 import LinearJ2Dynamics
from satform.dynamics.protocol import Dynamics
from satform.dynamics.stacked_perturbations import STACKED_PERTURBATIONS, StackedPerturbations
from satform.dynamics.velocity_dependent import VelocityDependentDynamics
from satform.numeric import stacking
from satform.numeric.elementwise import Array, Indices

_FORCE = ("linear", "wave", "wave_number", "quadratic")
"""Numbers of a force that depends on the velocity."""


class StackedCwDynamics(LvlhStateDynamics):
    """The CW equations of the satellites of many runs, the same operations as `CwDynamics` has."""

    def __init__(self, steps: Sequence[DisturbedStep], perturbations: StackedPerturbations | None) -> None:
        """Models of many runs.

        Args:
            steps: of each satellite; or a single one that all have.
            perturbations: of all satellites; None without.
        """
        self._offsets = tuple(steps[0].nodes.tolist())
        # What position and velocity have from position, velocity, command and each node's disturbance:
        # axes are result, cause, component, satellite.
        self._own = np.stack([_factors(step, "own") for step in steps], axis=-1)
        self._swapped = np.stack([_factors(step, "swapped") for step in steps], axis=-1)
        self._perturbations = perturbations

    def advance(self, state: CwState, acceleration_lvlh: Array, step: int) -> CwState:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        end = self._response((state.position.T, state.velocity.T, acceleration_lvlh.T), 0, None)
        if self._perturbations is not None:
            own = self._perturbations.own
            nodes = [self._perturbations.distinct(step, offset).T for offset in self._offsets]
            if own is None or self._own.shape[-1] == 1:
                disturbed = self._response(nodes, 3, None)
                disturbed = disturbed if own is None else disturbed.take(own, axis=2)
            else:
                disturbed = self._response([node.take(own, axis=1) for node in nodes], 3, None)
            end += disturbed
        return CwState(end[0].T, end[1].T)

    def keep(self, state: CwState, rows: Indices) -> tuple["StackedCwDynamics", CwState]:
        """Model and state of some of the satellites; this object is not to be used on."""
        kept = object.__new__(StackedCwDynamics)
        kept._offsets = self._offsets
        shared = self._own.shape[-1] == 1
        kept._own = self._own if shared else self._own.take(rows, axis=-1)
        kept._swapped = self._swapped if shared else self._swapped.take(rows, axis=-1)
        kept._perturbations = None if self._perturbations is None else self._perturbations.keep(rows)
        return kept, stacking.take(state, rows)

    def _response(self, causes: Sequence[Array], first: int, total: Array | None) -> Array:
        """What position and velocity have from some causes (3, M), added in order, shape (2, 3, M)."""
        part: Array | None = None
        crossed: Array | None = None
        for number, cause in enumerate(causes, start=first):
            part = np.multiply(self._own[:, number], cause, out=part)
            crossed = np.multiply(self._swapped[:, number], cause[1::-1], out=crossed)
            in_plane = part[:, :2]
            in_plane += crossed
            if total is None:
                # The first one is kept as it is.
                total, part = part, None
            else:
                total += part
        assert total is not None  # noqa: S101 - there is a cause
        return total


def _factors(step: DisturbedStep, name: str) -> Array:
    """Factors of the six causes, shape (2, 6, 3); of exchanged components (2, 6, 2)."""
    held, coast = step.held, step.held.coast
    rows = (
        (coast.position_from_position, coast.position_from_velocity, held.position_from_input),
        (coast.velocity_from_position, coast.velocity_from_velocity, held.velocity_from_input),
    )
    first = np.array([[getattr(part, name) for part in row] for row in rows])
    nodes = [
        getattr(part, name)[:, 0] for part in (step.position_from_disturbance, step.velocity_from_disturbance)
    ]
    return np.concatenate((first, np.array(nodes)), axis=1)


_SharedModel = (
    CwPerturbedDynamics
    | FormulaDynamics
    | InertialDynamics
    | LinearJ2Dynamics
    | PropagatedChiefDynamics
    | VelocityDependentDynamics
)


@dataclass(frozen=True)
class StackedDynamics(Dynamics):
    """A truth model that many runs share but for what acts on their satellites, with all of these.

    Attributes:
        model: with what belongs to the satellites of all runs.
    """

    model: Any

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> Any:
        """The state at time zero; arguments as in `Dynamics.start`."""
        return self.model.start(position_lvlh, velocity_lvlh)

    def lvlh(self, state: Any) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (M, 3) each."""
        position, velocity = self.model.lvlh(state)
        return position, velocity

    def advance(self, state: Any, acceleration_lvlh: Array, step: int) -> Any:
        """The state one control period later; arguments as in `Dynamics.advance`."""
        return self.model.advance(state, acceleration_lvlh, step)

    def earth_distance(self, state: Any) -> Array | None:
        """Distance of each satellite from the Earth's centre; as in `Dynamics.earth_distance`."""
        distance: Array | None = self.model.earth_distance(state)
        return distance

    def keep(self, state: Any, rows: Indices) -> tuple["StackedDynamics", Any]:
        """Model and state of some of the satellites; this object is not to be used on."""
        model = self.model
        changes: dict[str, Any] = {
            "perturbations": tuple(part.keep(rows) for part in model.perturbations),
        }
        if isinstance(model, InertialDynamics):
            changes["bodies"] = (model.bodies[0], *(model.bodies[1 + row] for row in rows.tolist()))
        if isinstance(model, VelocityDependentDynamics):
            changes |= {name: getattr(model, name)[rows] for name in _FORCE}
        kept = StackedDynamics(replace(model, **changes))
        if isinstance(state, CoastingState):
            return kept, state.keep(np.concatenate(([0], 1 + rows)))
        if isinstance(model, InertialDynamics | PropagatedChiefDynamics):
            with_chief = np.concatenate(([0], 1 + rows))
            motion, remainder = (values[:, with_chief] for values in (state.motion, state.remainder))
            return kept, replace(state, motion=motion, remainder=remainder)
        return kept, stacking.take(state, rows)


def stacked_kind(model: Dynamics) -> tuple[Any, ...] | None:
    """What has to be the same in two models for their satellites to be moved as one.

    What a model with a chief of its own was built from has to be the same, too; that is for the caller to see
    to.

    Returns:
        A hashable value; None where the model moves or disturbs the satellites of one run only.
    """
    perturbations = getattr(model, "perturbations", ())
    if not isinstance(model, CwDynamics | _SharedModel):
        return None
    if not all(isinstance(part, STACKED_PERTURBATIONS) for part in perturbations):
        return None
    kinds = tuple(type(part) for part in perturbations)
    if isinstance(model, CwDynamics):
        return (CwDynamics, kinds, model.step.nodes.tobytes())
    return (type(model), kinds)


def stack_dynamics(models: Sequence[Dynamics], satellites: int) -> StackedCwDynamics | StackedDynamics:
    """The truth models of many runs as one.

    Args:
        models: of each run, all of the same `stacked_kind`.
        satellites: in each run.
    """
    own = [getattr(model, "perturbations", ()) for model in models]
    perturbations = StackedPerturbations(own) if own[0] else None
    steps = [model.step for model in models if isinstance(model, CwDynamics)]
    if steps:
        alike = len({_factors(step, "own").tobytes() for step in steps}) == 1
        return StackedCwDynamics(
            steps[:1] if alike else [step for step in steps for _ in range(satellites)], perturbations
        )
    first: Any = models[0]
    changes: dict[str, Any] = {"perturbations": () if perturbations is None else (perturbations,)}
    if isinstance(first, InertialDynamics):
        of_satellites = [model.bodies[1:] for model in models if isinstance(model, InertialDynamics)]
        changes["bodies"] = (first.bodies[0], *(body for bodies in of_satellites for body in bodies))
    if isinstance(first, VelocityDependentDynamics):
        changes |= {
            name: np.repeat([[getattr(model, name)] for model in models], satellites, axis=0)
            for name in _FORCE
        }
    return StackedDynamics(replace(first, **changes))
