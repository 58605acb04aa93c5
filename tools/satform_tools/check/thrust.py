# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about thrust limits: commands and burns beyond them, integrator wind-up, parameter drift."""

from collections.abc import Sequence

import numpy as np

from satform.control.artificial_potential import ArtificialPotentialSpec
from satform.control.integral_action import IntegralSpec
from satform.control.observer import ObserverSpec
from satform.control.protocol import ControllerSpec
from satform.equipment.thruster import ThrusterSpec
from satform.flight.compile_satellite import flight_setting
from satform.flight.simulate import simulate
from satform.numeric.elementwise import Array
from satform.planning.impulsive_guidance import TimedBurnsSpec
from satform.scenario import Scenario
from satform.scenario.parts import Timing

_IMPULSIVE = frozenset({"impulsive_guidance", "timed_burns"})
"""Laws whose commands are burns, which must not saturate."""


def thrust_warnings(scenario: Scenario) -> list[str]:
    """Sentences about thrusters that cannot apply what will be commanded."""
    return [
        *_winding_up(scenario),
        *_beyond_at_start(scenario),
        *_large_burns(scenario),
        *_drifting(scenario),
    ]


def _winding_up(scenario: Scenario) -> list[str]:
    names = []
    for index, satellite in enumerate(scenario.satellites):
        spec = scenario.satellite(index)
        limited = spec.thruster is not None and spec.thruster.maximum_thrust is not None
        if limited and any(getattr(law, "anti_windup", "") == "none" for law in _laws(spec.controller)):
            names.append(satellite.name)
    if not names:
        return []
    return [
        f"controller of {', '.join(names)}: its integral grows while the thrusters are at their limit "
        "(anti_windup: none), so that it overshoots; use the default"
    ]


def _laws(controller: ControllerSpec | None) -> Sequence[ControllerSpec]:
    """A law with those within it."""
    inner = controller.law if isinstance(controller, IntegralSpec | ObserverSpec) else None
    own = () if controller is None else (controller,)
    return (*own, *(_laws(inner) if inner is not None else ()))


def _beyond_at_start(scenario: Scenario) -> list[str]:
    thrusters = [scenario.satellite(index).thruster for index in range(len(scenario.satellites))]
    limited = [
        index for index, own in enumerate(thrusters) if own is not None and own.maximum_thrust is not None
    ]
    if not limited:
        return []
    step = scenario.timing.step
    first = simulate(scenario.model_copy(update={"timing": Timing(step=step, duration=step)}))
    found = []
    for index in limited if first.steps else ():
        thruster = thrusters[index]
        assert thruster is not None  # noqa: S101 - chosen so
        assert thruster.maximum_thrust is not None  # noqa: S101 - likewise
        most = thruster.maximum_thrust / (thruster.dry_mass + thruster.propellant)
        asked = _strength(thruster, first.acceleration[0, index])
        if asked > most * (1.0 + 1e-9):
            found.append(
                f"satellite {scenario.satellites[index].name}: its first command is {asked:.3g} m/s^2, "
                f"{asked / most:.3g} times what its thrusters can apply, {most:.3g} m/s^2; "
                f"{_outcome(scenario, index)}"
            )
    return found


def _large_burns(scenario: Scenario) -> list[str]:
    """A sentence for each satellite with a burn after the first step that its thrusters cannot give."""
    found = []
    for index, satellite in enumerate(scenario.satellites):
        spec = scenario.satellite(index)
        thruster = spec.thruster
        if thruster is None or thruster.maximum_thrust is None:
            continue
        if not isinstance(spec.controller, TimedBurnsSpec):
            continue
        law = spec.controller.build(flight_setting(scenario, index))
        most = thruster.maximum_thrust / (thruster.dry_mass + thruster.propellant)
        for step in sorted({int(step) for step in law.steps if 0 < step < scenario.timing.steps}):
            asked = _strength(thruster, law.accelerations[law.steps == step].sum(axis=0))
            if asked > most * (1.0 + 1e-9):
                found.append(
                    f"satellite {satellite.name}: its burn at {step * scenario.timing.step:g} s is "
                    f"{asked:.3g} m/s^2 over a step, {asked / most:.3g} times what its thrusters can apply "
                    f"with a full tank, {most:.3g} m/s^2; the burn will be too small, and the satellite will "
                    "miss the positions planned after it"
                )
                break
    return found


def _outcome(scenario: Scenario, index: int) -> str:
    kind = getattr(scenario.satellite(index).controller, "kind", "")
    if kind in _IMPULSIVE:
        return "the burn will be too small, and the satellite will miss the positions planned after it"
    return "its thrusters are saturated at first"


def _strength(thruster: ThrusterSpec, command: Array) -> float:
    per_axis = thruster.arrangement == "per_axis"
    return float(np.max(np.abs(command)) if per_axis else np.linalg.norm(command))


def _drifting(scenario: Scenario) -> list[str]:
    names = []
    for index, satellite in enumerate(scenario.satellites):
        spec = scenario.satellite(index)
        law, sensor = spec.controller, spec.sensor
        noisy = sensor is not None and any((*sensor.position_noise, *sensor.velocity_noise))
        drifts = (
            isinstance(law, ArtificialPotentialSpec) and law.leakage == "none" and law.disturbance_rate > 0.0
        )
        if noisy and drifts:
            names.append(satellite.name)
    if not names:
        return []
    return [
        f"controller of {', '.join(names)}: adapts without leakage under sensor noise, so that its "
        "estimate of the disturbance only grows; choose leakage: sigma_modification or e_modification"
    ]
