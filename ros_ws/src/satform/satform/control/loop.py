"""The closed loop of any control law close to its reference, found by trying the law."""

import dataclasses
from typing import Any

import numpy as np

from satform.control.protocol import Controller, ControlStep, FlightSetting, Motion
from satform.dynamics import cw
from satform.elementwise import Array
from satform.reference import Reference

_PROBE = 1e-9
"""Size of a trial in SI units: within any boundary layer, and above what doubles resolve."""

_SAME = 1e-6
"""Relative difference between two slopes that are the same but for rounding."""


def closed_loop(law: Controller, setting: FlightSetting) -> Array | None:
    """How position, velocity and the law's memory go from one step to the next, close to the reference.

    Args:
        law: of one satellite.
        setting: in which it was built.

    Returns:
        Transition matrix of (position, velocity, numbers of the memory, last command) over one step with the
        command held and applied as it is, SI units, shape (9 + m, 9 + m); None for a law that is not linear
        there. The last command is there for laws that are fed by what was applied, such as observers.
    """
    slope, twice = _slopes(law, setting, _PROBE), _slopes(law, setting, 2.0 * _PROBE)
    scale = np.max(np.abs(slope), axis=0)
    return slope if np.all(np.abs(twice - slope) <= _SAME * scale) else None


def _slopes(law: Controller, setting: FlightSetting, size: float) -> Array:
    """Differences that a trial of each number makes after a step, for each unit of the trial."""
    rest = law.start(Motion(np.zeros(3), np.zeros(3)))
    count = 9 + len(_numbers(rest))
    nowhere = Reference(np.zeros(3), np.zeros(3), np.zeros(3))
    plant = cw.HeldInputStep.over(setting.mean_motion, setting.step)

    def after(state: Array) -> Array:
        motion = Motion(state[:3], state[3:6])
        # Nothing limits the command here: what was commanded was applied.
        step = ControlStep(1, setting.step, state[-3:], state[-3:])
        action = law.act(motion, nowhere, _filled(rest, list(state[6:-3])), step)
        moved = plant.advance(motion.position, motion.velocity, action.acceleration)
        return np.concatenate((*moved, _numbers(action.memory), action.acceleration))

    middle = after(np.zeros(count))
    columns = [(after(size * unit) - middle) / size for unit in np.eye(count)]
    return np.stack(columns, axis=-1)


def _numbers(memory: Any) -> Array:
    """All numbers of a memory made of dataclasses of arrays, in order."""
    if memory is None:
        return np.zeros(0)
    if dataclasses.is_dataclass(memory):
        parts = [_numbers(getattr(memory, field.name)) for field in dataclasses.fields(memory)]
        return np.concatenate(parts) if parts else np.zeros(0)
    return np.ravel(np.asarray(memory, dtype=np.float64))


def _filled(memory: Any, numbers: list[Any]) -> Any:
    """The same memory with other numbers, which are taken off the front of the list."""
    if memory is None:
        return None
    if dataclasses.is_dataclass(memory) and not isinstance(memory, type):
        parts = {
            field.name: _filled(getattr(memory, field.name), numbers) for field in dataclasses.fields(memory)
        }
        return dataclasses.replace(memory, **parts)
    shape = np.shape(memory)
    taken = [numbers.pop(0) for _ in range(int(np.prod(shape)))]
    return np.asarray(taken, dtype=np.float64).reshape(shape)
