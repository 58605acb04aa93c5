# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the linear truth models against inertial propagation: the table of docs/models.md."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from satform.dynamics.protocol import DynamicsSetting, DynamicsSpec
from satform.dynamics.truth_models import (
    CwDynamicsSpec,
    CwPerturbedDynamicsSpec,
    InertialDynamicsSpec,
    LinearJ2DynamicsSpec,
)
from satform.numeric.elementwise import Array
from satform.orbits.earth import GRAVITATIONAL_PARAMETER_EGM2008

ORBITS: Mapping[str, float] = {
    "low orbit, 700 km": 7.078137e6,
    "medium orbit, 20 200 km": 26.578137e6,
    "geostationary radius": 42.164e6,
}
"""Semi-major axes, m."""
INCLINATIONS = (0.1, 0.9, 1.57)
"""rad."""
MODELS = ("cw", "linear_j2", "cw_perturbed")
"""Compared with `inertial`; the last is the one that the page recommends."""
DEGREE, TRUE_DEGREE = 10, 20
"""Of the gravity fields of `cw_perturbed` and of `inertial`."""


@dataclass(frozen=True)
class ModelError:
    """One satellite left alone beside one chief.

    Attributes:
        orbit: of the chief.
        inclination: of the chief, rad.
        motion: of the satellite.
        errors: largest distance from the inertial model by kind of model, m.
    """

    orbit: str
    inclination: float
    motion: str
    errors: dict[str, float]


def starts(mean_motion: float, separation: float) -> dict[str, tuple[Array, Array]]:
    """Relative position in m and velocity in m/s, LVLH, shape (3,), of each kind of motion."""
    still = np.zeros(3)
    ellipse = 0.5 * separation
    return {
        "follower": (np.array([0.0, -separation, 0.0]), still),
        "ellipse": (np.array([ellipse, 0.0, 0.0]), np.array([0.0, -2.0 * mean_motion * ellipse, 0.0])),
        "cross-track": (np.array([0.0, 0.0, separation]), still),
    }


def rows(
    *,
    orbits: Mapping[str, float] = ORBITS,
    inclinations: tuple[float, ...] = INCLINATIONS,
    separation: float = 1000.0,
    revolutions: float = 2.0,
    steps: int = 240,
) -> list[ModelError]:
    """Largest distance of each model from `inertial`, without control.

    The chief starts on an osculating circular orbit at its ascending node.

    Args:
        orbits: semi-major axes by name, m.
        inclinations: of the chief, rad.
        separation: distance of follower and cross-track start; half the long axis of the ellipse, m.
        revolutions: of the chief.
        steps: at which the models are compared.
    """
    found = []
    for orbit, semi_major_axis in orbits.items():
        rate = math.sqrt(GRAVITATIONAL_PARAMETER_EGM2008 / semi_major_axis**3)
        motions = starts(rate, separation)
        setting = DynamicsSetting(rate, revolutions * math.tau / rate / steps, len(motions))
        position, velocity = (np.array(part) for part in zip(*motions.values(), strict=True))
        for inclination in inclinations:
            flown = {
                kind: _fly(spec, setting, position, velocity, steps)
                for kind, spec in _specs(inclination).items()
            }
            apart = {
                kind: np.linalg.norm(flown[kind] - flown["inertial"], axis=-1).max(axis=0) for kind in MODELS
            }
            found += [
                ModelError(orbit, inclination, motion, {kind: float(apart[kind][index]) for kind in MODELS})
                for index, motion in enumerate(motions)
            ]
    return found


def _specs(inclination: float) -> dict[str, DynamicsSpec]:
    chief = {"inclination": inclination}
    return {
        "inertial": InertialDynamicsSpec.model_validate({"chief": chief, "gravity": {"degree": TRUE_DEGREE}}),
        "cw": CwDynamicsSpec(),
        "linear_j2": LinearJ2DynamicsSpec.model_validate({"chief": chief}),
        "cw_perturbed": CwPerturbedDynamicsSpec.model_validate(
            {"chief": chief, "gravity": {"degree": DEGREE}}
        ),
    }


def _fly(spec: DynamicsSpec, setting: DynamicsSetting, position: Array, velocity: Array, steps: int) -> Array:
    """Positions at the end of each step, m, shape (steps, N, 3)."""
    dynamics = spec.build(setting)
    state = dynamics.start(position, velocity)
    nothing = np.zeros_like(position)
    flown = np.empty((steps, *position.shape))
    for step in range(steps):
        state = dynamics.advance(state, nothing, step)
        flown[step] = dynamics.lvlh(state)[0]
    return flown


def markdown(found: list[ModelError]) -> str:
    """The table as it stands in docs/models.md, the smallest error of each row in bold."""
    lines = [
        "| chief | inclination | satellite | " + " | ".join(f"`{kind}`" for kind in MODELS) + " |",
        "|---|---|---|" + "---|" * len(MODELS),
    ]
    for row in found:
        least = min(row.errors.values())
        cells = [
            f"**{_metres(error)}**" if error == least else _metres(error)
            for error in (row.errors[kind] for kind in MODELS)
        ]
        lines.append(f"| {row.orbit} | {row.inclination:g} rad | {row.motion} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _metres(error: float) -> str:
    """An error in m; below a micrometre it is rounding, which differs between machines."""
    return f"{error:.2g} m" if error >= 1e-6 else "below 1e-6 m"
