# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
# %% Build a scenario
from pathlib import Path

import satform as sf

period = 6000.0
scenario = sf.Scenario(
    orbit=sf.Orbit(period=period),
    timing=sf.Timing(step=4.0, duration=period),
    dynamics=sf.CwDynamicsSpec(),
    graph=sf.CompleteSpec(),
    consensus=sf.ArcLengthConsensusSpec(coupling_gain=1e-6, rate_gain=2e-3, tracking_gain=1e-3),
    nominal_motion=sf.NominalMotion(period=period),
    satellite_defaults=sf.SatelliteFields(
        curve=sf.CircleSpec(radius=1000.0, normal=(3**0.5, 0.0, -1.0), direction=(0.0, 1.0, 0.0)),
        controller=sf.SlidingModeSpec(switching_gain=1e-3, boundary_layer=1e-2),
    ),
    satellites=[sf.SatelliteSpec(name=f"sat{i}", arc_length=2000.0 * i) for i in range(1, 4)],
)
print(scenario)

# %% Fly it
record = sf.simulate(scenario)
print(record)

# %% Use the arrays
satellite = record["sat1"]
print(f"largest tracking error of sat1: {satellite.tracking_error.max():.3g} m")
print(f"position of sat1 in the end: {satellite.position[-1].round(1)} m")

# %% Vary it
for gain in (1e-6, 4e-6):
    varied = scenario.with_({"consensus.coupling_gain": gain})
    phase = sf.simulate(varied).arc_length[-1]
    print(f"coupling gain {gain:g} 1/s^2: phases differ by {phase.max() - phase.min():.1f} m in the end")

# %% Evaluate expectations
bound = {"kind": "tracking_error", "below": 10.0, "after": 3000.0, "source": "requirement of the mission"}
for verdict in sf.evaluate(scenario.with_(expect=[bound]), record):
    print(f"{verdict.label}: {verdict.figure:.3g} {verdict.unit}, {'met' if verdict.met else 'missed'}")

# %% Handle errors
try:
    scenario.with_({"satellites[*].controller.boundary_layr": 1e-3})
except sf.ScenarioError as error:
    print(error.problems[0])

# %% Draw figures
axes = sf.plot.tracking_error(record)
axes.figure.savefig("tracking_error.png")
sf.plot.orbits_3d(record, scenario).figure.savefig("orbits.png")

# %% Read the bag of a flight over DDS
for path in Path("runs").glob("*/bag"):
    bag = sf.read_bag(path)
    print(bag.scenario, bag.record, f"complete: {bag.complete}")
