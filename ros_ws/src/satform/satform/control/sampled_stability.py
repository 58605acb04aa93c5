# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Stability of control loops that are closed once a step: transition over a step, and its spectral radius.

A loop is stable when the spectral radius of its transition over one step is below one. Commands are held
over the step, so that a loop that is stable in continuous time can be unstable. The consensus is in
`satform.consensus.stability`.

Equations: docs/stability.md and the pages of the laws.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from satform.control.protocol import (
    Controller,
    ControlStep,
    FlightSetting,
    Motion,
    NeighbourController,
    RelativeNeighbour,
)
from satform.dynamics import cw
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import Reference

_PROBE = 1e-9
"""Size of a trial in SI units: within any boundary layer, and above what doubles resolve."""

_SAME = 1e-6
"""Relative difference between two slopes that are the same but for rounding."""

_APART_PROBE = 1e-4
"""Size of a trial of a law on a neighbour, whose distance leaves fewer digits."""

_NEUTRAL = 1e-6
"""Distance from one of an eigenvalue that belongs to something that nothing depends on."""

_MOST_WAITING = 200
"""Measurements on their way up to which a loop with latency is worked out."""

_BISECTIONS = 40

_NOWHERE = Reference(np.zeros(3), np.zeros(3), np.zeros(3))


LoopKind = Literal["tracking", "consensus", "attitude", "estimation"]


@dataclass(frozen=True)
class SampledLoop:
    """A loop that is closed once a step.

    Attributes:
        kind: of the loop.
        satellites: whose loop it is, all with the same numbers.
        radius: spectral radius of its transition over a step; None where it is not analysed.
        words: what the loop is, or why it is not analysed.
    """

    kind: LoopKind
    satellites: tuple[str, ...]
    radius: float | None
    words: str


def spectral_radius(transition: Array, steps: int = 1) -> float:
    """Factor by which the slowest-decaying or fastest-growing error changes in a step.

    Args:
        transition: of the errors, shape (m, m).
        steps: over which it goes.

    Returns:
        Largest magnitude of an eigenvalue, for one step; below 1 for a loop that is stable.
    """
    if not np.all(np.isfinite(transition)):
        return float("inf")
    return float(np.max(np.abs(np.linalg.eigvals(transition)), initial=0.0) ** (1.0 / steps))


def border_between(stable: Callable[[float], bool], low: float, high: float) -> tuple[float, float]:
    """Values that enclose the one at which a loop becomes unstable, or stable, by bisection.

    Args:
        stable: whether the loop is, as a function of a parameter.
        low: a value of it.
        high: a larger one, at which `stable` is other than at `low`.

    Returns:
        The largest value found that is as `low`, and the smallest that is as `high`.
    """
    at_low = stable(low)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if stable(middle) == at_low:
            low = middle
        else:
            high = middle
    return low, high


def require_stable_hold(closed_loop: Array, name: str, step: float) -> None:
    """Refuse gains whose closed loop, sampled once a step, does not decay.

    Args:
        closed_loop: state transition over one step with the command held, shape (m, m).
        name: of the control law, for the message.
        step: control period, s.

    Raises:
        ValueError: an eigenvalue lies on or outside the unit circle.
    """
    radius = spectral_radius(closed_loop)
    if not radius < 1.0:
        raise ValueError(
            f"{name}: with the command held for {step:g} s the closed loop does not decay "
            f"(spectral radius {radius:.6g}, has to be below 1); shorten the step or lower the gains"
        )


def closed_loop(law: Controller, setting: FlightSetting, update: int = 1, latency: int = 0) -> Array | None:
    """How position, velocity and the law's memory go on close to the reference, by trying the law.

    Args:
        law: of one satellite.
        setting: in which it was built.
        update: steps between two measurements, at least 1.
        latency: steps from a measurement to its arrival.

    Returns:
        Transition of (position, velocity, numbers of the memory, last command, measured motions that are
        still needed) over `update` steps with the command held and applied as it is, SI units; None for a
        law that is not linear there, or for too many measurements on their way. The last command is there
        for laws that are fed by what was applied, such as observers.
    """
    waiting = math.ceil(latency / update)
    if waiting > _MOST_WAITING:
        return None
    rest = law.start(Motion(np.zeros(3), np.zeros(3)))
    own = 9 + len(_numbers(rest))
    plant = cw.HeldInputStep.over(setting.mean_motion, setting.step)

    def after(state: Array) -> Array:
        now, measured = state[:own], state[own:].reshape(waiting, 6)
        taken = np.vstack((now[:6], measured))
        for number in range(update):
            # Of those that have arrived the newest counts.
            measured = taken[max(0, math.ceil((latency - number) / update))]
            motion = Motion(measured[:3], measured[3:])
            # Nothing limits the command here: what was commanded was applied.
            step = ControlStep(1, setting.step, now[-3:], now[-3:])
            action = law.act(motion, _NOWHERE, _filled(rest, list(now[6:-3])), step)
            moved = plant.advance(now[:3], now[3:6], action.acceleration)
            now = np.concatenate((*moved, _numbers(action.memory), action.acceleration))
        return np.concatenate((now, taken[:waiting].ravel()))

    count = own + 6 * waiting
    slope, twice = _slopes(after, count, _PROBE), _slopes(after, count, 2.0 * _PROBE)
    scale = np.max(np.abs(slope), axis=0)
    return slope if np.all(np.abs(twice - slope) <= _SAME * scale) else None


def _slopes(after: Callable[[Array], Array], count: int, size: float) -> Array:
    """Differences that a trial of each number makes after a step, for each unit of the trial."""
    middle = after(np.zeros(count))
    columns = [(after(size * unit) - middle) / size for unit in np.eye(count)]
    return np.stack(columns, axis=-1)


def neighbour_loop(
    law: NeighbourController, distance: float, common_velocity: Array, setting: FlightSetting
) -> Array:
    """How a satellite goes on that is about at its distance from a neighbour, which moves on evenly.

    The satellite moves freely but for its command, which is held. Where around the neighbour it is does not
    matter to a law on the distance, so that only the distance and the velocity are tried.

    Args:
        law: of one satellite.
        distance: at which it is at rest beside the neighbour, m.
        common_velocity: of both, LVLH, m/s, shape (3,).
        setting: in which it was built.

    Returns:
        Transition over one step of what decays or grows in (distance, velocity, numbers of the memory, last
        command), shape (m, m); what nothing depends on is left out.
    """
    rest = law.start(Motion(np.zeros(3), np.zeros(3)))
    count, along = 7 + len(_numbers(rest)), np.array([1.0, 0.0, 0.0])

    def after(state: Array) -> Array:
        velocity = state[1:4]
        motion = Motion((distance + state[0]) * along, common_velocity + velocity)
        step = ControlStep(1, setting.step, state[-3:], state[-3:])
        neighbour = RelativeNeighbour(motion.position, velocity)
        action = law.act(motion, neighbour, _filled(rest, list(state[4:-3])), step)
        moved = state[:1] + setting.step * (velocity[:1] + 0.5 * setting.step * action.acceleration[:1])
        faster = velocity + setting.step * action.acceleration
        return np.concatenate((moved, faster, _numbers(action.memory), action.acceleration))

    size = _APART_PROBE
    columns = [(after(size * unit) - after(-size * unit)) / (2.0 * size) for unit in np.eye(count)]
    return without_neutral(np.stack(columns, axis=-1))


def without_neutral(transition: Array) -> Array:
    """The part of a transition in which errors decay or grow: its other eigenvalues are one.

    Args:
        transition: shape (m, m).

    Returns:
        Upper triangular in blocks, with the eigenvalues that are not one, shape (k, k).
    """
    from scipy.linalg import schur  # noqa: PLC0415  slow to import, and not needed in flight

    form, _, count = schur(transition, sort=lambda real, imaginary: _moves(complex(real, imaginary)))
    return np.asarray(form[:count, :count], dtype=np.float64)


def _moves(eigenvalue: complex) -> bool:
    return abs(eigenvalue - 1.0) > _NEUTRAL


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
