# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What tests ask of every control law: the same bits alone and in a stack, and decay with held commands."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from satform.control.protocol import Controller, ControlStep, Motion
from satform.dynamics import cw
from satform.numeric.stacking import item, stack
from satform.orbits.path_reference import Reference

STEP = ControlStep(0, 1.0)
"""A step of which a law takes that its own command was applied before it."""

NOWHERE = Reference(np.zeros(3), np.zeros(3), np.zeros(3))


def assert_a_stack_has_the_bits_of_each(laws: Sequence[Controller], steps: int = 1) -> None:
    """Commands and memories of laws alone and of all in a stack, at random motions and references."""
    random = np.random.default_rng(5)
    motion = Motion(*random.standard_normal((2, len(laws), 3)) * 100.0)
    reference = Reference(
        *random.standard_normal((3, len(laws), 3)) * np.array([100.0, 30.0, 1e-4])[:, None, None]
    )
    fleet = stack(laws)
    together = fleet.start(motion)
    alone = [law.start(item(motion, row)) for row, law in enumerate(laws)]
    for _ in range(steps):
        action = fleet.act(motion, reference, together, STEP)
        together = action.memory
        for row, law in enumerate(laws):
            single = law.act(item(motion, row), item(reference, row), alone[row], STEP)
            alone[row] = single.memory
            np.testing.assert_array_equal(single.acceleration, action.acceleration[row])
            np.testing.assert_array_equal(single.sliding_variable, action.sliding_variable[row])
            if together is not None:
                np.testing.assert_equal(asdict(single.memory), asdict(item(together, row)))


def held_spectral_radius(law: Any, mean_motion: float, step: float) -> float:
    """Of the loop of a linear law with the command held over each step, on the exact plant of free motion."""
    plant = cw.HeldInputStep.over(mean_motion, step)
    columns = []
    for unit in np.eye(6):
        push = law.act(Motion(unit[:3], unit[3:]), NOWHERE, None, STEP).acceleration
        columns.append(np.concatenate(plant.advance(unit[:3], unit[3:], push)))
    return float(np.abs(np.linalg.eigvals(np.array(columns).T)).max())
