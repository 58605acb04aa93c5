# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellite formations: scenarios, dynamics, control, consensus, simulation, records and bags, without ROS.

The public API is what `__all__` lists; everything below in sub-packages may change between minor versions.
"""

from importlib import import_module
from typing import Any

__version__ = "0.2.0"

_MODULES = {
    "AdaptiveSpec": "satform.dynamics.specs",
    "AdaptiveTrackingSpec": "satform.control.adaptive_tracking",
    "ArcLengthConsensusSpec": "satform.consensus.arc_length",
    "ArtificialPotentialSpec": "satform.control.artificial_potential",
    "AttitudeSpec": "satform.attitude.guidance",
    "AttitudeTrackingSpec": "satform.attitude.mrp_tracking",
    "Bag": "satform.bag.reader",
    "BagError": "satform.bag.errors",
    "BodySpec": "satform.dynamics.specs",
    "BoundedNoiseSpec": "satform.dynamics.prescribed_disturbances",
    "BurnSpec": "satform.planning.impulsive_guidance",
    "ByzantineSpec": "satform.membership.faults",
    "Campaign": "satform.campaign.model",
    "ChiefOrbitSpec": "satform.orbits.chief",
    "CircleSpec": "satform.orbits.curve_specs",
    "ClockOffsetSpec": "satform.membership.faults",
    "CoastSpec": "satform.control.coast",
    "CollocationSpec": "satform.dynamics.specs",
    "CompleteSpec": "satform.consensus.graph",
    "ConstantSpec": "satform.dynamics.prescribed_disturbances",
    "CwDynamicsSpec": "satform.dynamics.truth_models",
    "CwPerturbedDynamicsSpec": "satform.dynamics.truth_models",
    "EarlyEnd": "satform.record.early_end",
    "EdgeSpec": "satform.communication.channel_model",
    "ElementControlSpec": "satform.control.relative_elements",
    "EllipseSpec": "satform.orbits.curve_specs",
    "Expectation": "satform.scenario.expectation",
    "FeedbackLinearisationSpec": "satform.control.feedback_linearisation",
    "FilterSpec": "satform.navigation.relative_state_filter",
    "FixedPointSpec": "satform.orbits.curve_specs",
    "FixedStepSpec": "satform.dynamics.specs",
    "FlightRecord": "satform.record.flight_record",
    "FrozenSensorSpec": "satform.membership.faults",
    "GraphChangeSpec": "satform.membership.formation",
    "FormulaConstantSpec": "satform.dynamics.formula_model",
    "FormulaDynamicsSpec": "satform.dynamics.formula_model",
    "GravitySpec": "satform.dynamics.specs",
    "GroundPointingSpec": "satform.attitude.ground_pointing",
    "HalfSpaceSpec": "satform.control.keep_out",
    "HarmonicSpec": "satform.dynamics.prescribed_disturbances",
    "HarrisPriesterSpec": "satform.dynamics.atmosphere_specs",
    "HostSpec": "satform.scenario.deployment",
    "ImpulsiveGuidanceSpec": "satform.planning.impulsive_guidance",
    "InertialDynamicsSpec": "satform.dynamics.truth_models",
    "InertialPointSpec": "satform.orbits.curve_specs",
    "IntegralSpec": "satform.control.integral_action",
    "LimitsSpec": "satform.scenario.limits",
    "LineSpec": "satform.consensus.graph",
    "LinearJ2DynamicsSpec": "satform.dynamics.truth_models",
    "LinkSpec": "satform.communication.channel_model",
    "LinksSpec": "satform.communication.channel_model",
    "LqiSpec": "satform.control.lqi",
    "LqrSpec": "satform.control.lqr",
    "MatrixSpec": "satform.consensus.graph",
    "MeanElementControlSpec": "satform.control.mean_element_control",
    "ModelPredictiveSpec": "satform.control.model_predictive",
    "MotionSharingSpec": "satform.consensus.motion_sharing",
    "NavigationSpec": "satform.equipment.sensors.relative_motion",
    "NominalMotion": "satform.scenario.parts",
    "NoneSpec": "satform.consensus.graph",
    "Nrlmsise00Spec": "satform.dynamics.atmosphere_specs",
    "ObserverSpec": "satform.control.observer",
    "Orbit": "satform.scenario.parts",
    "PeriodicLqrSpec": "satform.control.periodic_lqr",
    "Problem": "satform.scenario.errors",
    "RadialNormalSpec": "satform.control.keep_out",
    "RandomRegularSpec": "satform.consensus.random_graphs",
    "ResilientArcLengthConsensusSpec": "satform.consensus.resilient",
    "RingSpec": "satform.consensus.graph",
    "SatelliteFields": "satform.scenario.parts",
    "SatelliteLostSpec": "satform.membership.faults",
    "SatellitePointingSpec": "satform.attitude.satellite_pointing",
    "SatelliteRecord": "satform.record.flight_record",
    "SatelliteSpec": "satform.scenario.parts",
    "Scenario": "satform.scenario.model",
    "ScenarioError": "satform.scenario.errors",
    "SlidingModeSpec": "satform.control.sliding_mode",
    "Source": "satform.scenario.parts",
    "SphereSpec": "satform.control.keep_out",
    "StarSpec": "satform.consensus.graph",
    "StuckThrusterSpec": "satform.membership.faults",
    "ThrusterSpec": "satform.equipment.thruster",
    "TimedBurnsSpec": "satform.planning.impulsive_guidance",
    "Timing": "satform.scenario.parts",
    "VelocityDependentDynamicsSpec": "satform.dynamics.velocity_dependent",
    "Verdict": "satform.scenario.expectation",
    "WaypointSpec": "satform.planning.impulsive_guidance",
    "WeakThrusterSpec": "satform.membership.faults",
    "case_scenario": "satform.campaign.cases",
    "case_values": "satform.campaign.cases",
    "evaluate": "satform.evaluation.evaluate",
    "findings": "satform.evaluation.findings",
    "load_campaign": "satform.campaign.loader",
    "load_scenario": "satform.scenario.loader",
    "parse_scenario": "satform.scenario.loader",
    "read_bag": "satform.bag.reader",
    "save_scenario": "satform.scenario.loader",
    "simulate": "satform.flight.simulate",
    "with_chief": "satform.flight.scenario_record",
}
"""Module of each public name; imported when the name is used, so that `import satform` stays quick."""

__all__ = sorted([*_MODULES, "plot"])  # noqa: PLE0605 - type checkers read __init__.pyi


def __getattr__(name: str) -> Any:
    """A public name, imported when it is used for the first time."""
    if name == "plot":
        return import_module("satform.plot")
    if name not in _MODULES:
        raise AttributeError(f"module 'satform' has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return found


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
