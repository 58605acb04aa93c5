# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Relative-motion feedback of Basilisk beside the in-process run, where Basilisk is installed.

Run alone with a Python that has `bsk`: `python tools/satform_tools/bench/basilisk.py 10 100`.
It is no dependency: with Basilisk absent it says so.
"""

import sys
import time
from importlib.metadata import PackageNotFoundError, version
from typing import Any

MU = 3.986004415e14
RADIUS = 7e6
STEP = 1.0
_NANOSECONDS = 1_000_000_000


def steps_per_second(count: int, steps: int = 200) -> float:
    """Fly deputies about a chief, each with a Hill-frame state and feedback on it, for some steps of 1 s.

    Each deputy is a spacecraft with point-mass gravity and fourth-order Runge-Kutta (Basilisk's default), a
    Hill-frame state converter, a Hill-frame feedback and a force that it commands.

    Args:
        count: deputies.
        steps: that are timed, after one that is not.

    Returns:
        Steps of the whole formation in a second of processor time.

    Raises:
        ImportError: there is no Basilisk.
    """
    from Basilisk.utilities import SimulationBaseClass  # noqa: PLC0415 - optional

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("flight")
    process.addTask(simulation.CreateNewTask("step", int(STEP * _NANOSECONDS)))
    parts = _formation(simulation, count)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(int(STEP * _NANOSECONDS))
    simulation.ExecuteSimulation()
    simulation.ConfigureStopTime(int((1 + steps) * STEP * _NANOSECONDS))
    begin = time.process_time()
    simulation.ExecuteSimulation()
    seconds = time.process_time() - begin
    del parts
    return steps / seconds


def _formation(simulation: Any, count: int) -> list[Any]:
    """Chief and deputies with their modules in the task; what has to stay alive."""
    from Basilisk.architecture import messaging  # noqa: PLC0415 - optional
    from Basilisk.fswAlgorithms import hillFrameRelativeControl, hillStateConverter  # noqa: PLC0415
    from Basilisk.simulation import extForceTorque, simpleNav  # noqa: PLC0415

    earth = _earth()
    speed = (MU / RADIUS) ** 0.5
    mass = messaging.VehicleConfigMsg().write(messaging.VehicleConfigMsgPayload(massSC=100.0))
    parts = [earth, mass]

    def spacecraft_at(offset: float, name: str) -> tuple[Any, Any]:
        body = _spacecraft(earth, [RADIUS + offset, 0.0, 0.0], [0.0, speed, 0.0], name)
        navigation = simpleNav.SimpleNav()
        navigation.ModelTag = f"{name}_navigation"
        navigation.scStateInMsg.subscribeTo(body.scStateOutMsg)
        simulation.AddModelToTask("step", body, 30)
        simulation.AddModelToTask("step", navigation, 20)
        parts.extend([body, navigation])
        return body, navigation

    _, chief = spacecraft_at(0.0, "chief")
    for index in range(count):
        body, navigation = spacecraft_at(100.0 + index, f"deputy{index}")
        hill = hillStateConverter.hillStateConverter()
        hill.chiefStateInMsg.subscribeTo(chief.transOutMsg)
        hill.depStateInMsg.subscribeTo(navigation.transOutMsg)
        law = hillFrameRelativeControl.HillFrameRelativeControl()
        law.setMu(MU)
        law.setK(_diagonal(1e-6))
        law.setP(_diagonal(2e-3))
        law.chiefTransInMsg.subscribeTo(chief.transOutMsg)
        law.hillStateInMsg.subscribeTo(hill.hillStateOutMsg)
        law.deputyVehicleConfigInMsg.subscribeTo(mass)
        force = extForceTorque.ExtForceTorque()
        force.cmdForceInertialInMsg.subscribeTo(law.forceOutMsg)
        body.addDynamicEffector(force)
        for module, priority in ((hill, 10), (law, 9), (force, 8)):
            module.ModelTag = f"{type(module).__name__}{index}"
            simulation.AddModelToTask("step", module, priority)
            parts.append(module)
    return parts


def _diagonal(gain: float) -> list[float]:
    """A matrix of three equal gains, row by row."""
    return [gain, 0.0, 0.0, 0.0, gain, 0.0, 0.0, 0.0, gain]


def _earth() -> Any:
    from Basilisk.utilities import simIncludeGravBody  # noqa: PLC0415

    factory = simIncludeGravBody.gravBodyFactory()
    earth = factory.createEarth()
    earth.isCentralBody = True
    return factory


def _spacecraft(earth: Any, position: list[float], velocity: list[float], name: str) -> Any:
    from Basilisk.simulation import spacecraft  # noqa: PLC0415

    body = spacecraft.Spacecraft()
    body.ModelTag = name
    body.hub.mHub = 100.0
    body.hub.IHubPntBc_B = [[10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]]
    body.hub.r_CN_NInit = [[part] for part in position]
    body.hub.v_CN_NInit = [[part] for part in velocity]
    earth.addBodiesTo(body)
    return body


def main() -> int:
    """Print a line for each number of deputies on the command line."""
    try:
        print(f"Basilisk {version('bsk')}")
    except PackageNotFoundError:
        print(
            "Basilisk is not installed here; `pip install bsk` into an environment of its own",
            file=sys.stderr,
        )
        return 2
    for count in sys.argv[1:] or ["10", "100", "1000"]:
        print(f"{count} deputies: {steps_per_second(int(count)):.4g} steps/s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
