# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A truth model beside a recorded step: it goes over arrays, and the satellites by a program on floats.

Forces of the Earth, Sun and Moon are no element-wise arithmetic, and a model may keep more than numbers, such
as the arcs of a coast. The program therefore knows of its state only what others ask for.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from satform.dynamics.protocol import Dynamics
from satform.numeric.array_trees import arrays_of, filled, numbers_of_arrays
from satform.numeric.elementwise import Array


@dataclass(frozen=True)
class HeldState:
    """What others ask of a model's state.

    Attributes:
        position: LVLH, m, shape (N, 3).
        velocity: likewise, m/s.
        distance: of each satellite from the Earth's centre, m, shape (N,); None for a model without it.
    """

    position: Array
    velocity: Array
    distance: Array | None


class HeldDynamics(Dynamics):
    """A model whose states are held by the number of their step."""

    def __init__(self, dynamics: Dynamics) -> None:
        """No state is held yet.

        Args:
            dynamics: the model.
        """
        self._dynamics = dynamics
        self._states: dict[int, Any] = {}

    def hold(self, state: Any, step: int) -> HeldState:
        """Take in the state at a step; what was held is dropped."""
        self._states = {step: state}
        return self._of(state)

    def state(self, step: int) -> Any:
        """The model's own state at the last step."""
        return self._states[step]

    def start(self, position_lvlh: Array, velocity_lvlh: Array) -> Any:
        """The model's own state at time zero; as in `Dynamics.start`."""
        return self._dynamics.start(position_lvlh, velocity_lvlh)

    def advance(self, state: HeldState, acceleration_lvlh: Any, step: Any) -> HeldState:
        """The state one control period later, of recorded arguments; as in `Dynamics.advance`."""
        found = step.called_with(self._advanced, acceleration_lvlh)
        return filled(state, found)

    def lvlh(self, state: HeldState) -> tuple[Array, Array]:
        """Relative position in m and velocity in m/s, shape (N, 3) each."""
        return state.position, state.velocity

    def earth_distance(self, state: HeldState) -> Array | None:
        """Distance of each satellite from the Earth's centre, m, shape (N,)."""
        return state.distance

    def _advanced(self, step: int, acceleration: Sequence[float]) -> list[float]:
        state = self._dynamics.advance(self._states[step], np.array(acceleration).reshape(-1, 3), step)
        # That of this step is asked for again where the program stops in it.
        self._states = {step: self._states[step], step + 1: state}
        return numbers_of_arrays(arrays_of(self._of(state)))

    def _of(self, state: Any) -> HeldState:
        return HeldState(*self._dynamics.lvlh(state), self._dynamics.earth_distance(state))
