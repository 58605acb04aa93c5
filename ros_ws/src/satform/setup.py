# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Package description of `satform`, with the entry points of what a scenario chooses by its kind."""

from pathlib import Path

from setuptools import find_packages, setup

_FIGURES = ["matplotlib>=3.8,<4"]
_BAGS = ["lz4>=4.3,<5", "mcap>=1.2,<2", "rosbags>=0.10,<0.12", "zstandard>=0.22,<1"]
_CAMPAIGNS = ["arro3-core>=0.5,<1", "arro3-io>=0.5,<1"]
_DASK = [*_CAMPAIGNS, "distributed>=2024.8"]
_PANDAS = ["pandas>=2.2,<4"]
_XARRAY = ["xarray>=2024.7"]

setup(
    name="satform",
    version="0.2.0",
    description="Satellite formations without ROS: dynamics, control, consensus, scenarios, simulation.",
    long_description=(Path(__file__).parent / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    author="satform contributors",
    keywords=["satellite", "formation flying", "relative motion", "consensus", "sliding mode", "simulation"],
    classifiers=[
        "Development Status :: 4 - Beta",
        "Intended Audience :: Science/Research",
        "Programming Language :: Python :: 3",
        "Programming Language :: Python :: 3.11",
        "Programming Language :: Python :: 3.12",
        "Programming Language :: Python :: 3.13",
        "Topic :: Scientific/Engineering :: Astronomy",
        "Topic :: Scientific/Engineering :: Physics",
        "Typing :: Typed",
    ],
    python_requires=">=3.11",
    packages=find_packages(include=["satform", "satform.*"]),
    package_data={"satform": ["py.typed", "__init__.pyi"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/satform"]),
        ("share/satform", ["package.xml"]),
    ],
    # Ranges for other people's environments; `tools/satform` installs the exact versions of requirements.txt.
    install_requires=[
        "brahe>=1.8,<2",
        "numpy>=2.0,<3",
        "pydantic>=2.10,<3",
        "ruamel.yaml>=0.18,<0.20",
        "scipy>=1.15,<2",
    ],
    # `colcon test` looks for pytest here; named in tests_require it runs no test and reports success.
    extras_require={
        "plot": _FIGURES,
        "bags": _BAGS,
        "campaigns": _CAMPAIGNS,
        "dask": _DASK,
        "pandas": _PANDAS,
        "xarray": _XARRAY,
        "all": [*_FIGURES, *_BAGS, *_DASK, *_PANDAS, *_XARRAY],
        "test": ["pytest"],
    },
    zip_safe=False,
    entry_points={
        "satform.curves": [
            "ellipse = satform.orbits.curve_specs:EllipseSpec",
            "circle = satform.orbits.curve_specs:CircleSpec",
            "fixed_point = satform.orbits.curve_specs:FixedPointSpec",
        ],
        "satform.perturbations": [
            "constant = satform.dynamics.prescribed_disturbances:ConstantSpec",
            "harmonic = satform.dynamics.prescribed_disturbances:HarmonicSpec",
            "bounded_noise = satform.dynamics.prescribed_disturbances:BoundedNoiseSpec",
        ],
        "satform.controllers": [
            "artificial_potential = satform.control.artificial_potential:ArtificialPotentialSpec",
            "coast = satform.control.coast:CoastSpec",
            "feedback_linearisation = satform.control.feedback_linearisation:FeedbackLinearisationSpec",
            "impulsive_guidance = satform.planning.impulsive_guidance:ImpulsiveGuidanceSpec",
            "integral = satform.control.integral_action:IntegralSpec",
            "lqi = satform.control.lqi:LqiSpec",
            "lqr = satform.control.lqr:LqrSpec",
            "observer = satform.control.observer:ObserverSpec",
            "relative_elements = satform.control.relative_elements:ElementControlSpec",
            "sliding_mode = satform.control.sliding_mode:SlidingModeSpec",
            "timed_burns = satform.planning.impulsive_guidance:TimedBurnsSpec",
        ],
        "satform.consensus": [
            "arc_length = satform.consensus.arc_length:ArcLengthConsensusSpec",
            "motion = satform.consensus.motion_sharing:MotionSharingSpec",
            "resilient_arc_length = satform.consensus.resilient:ResilientArcLengthConsensusSpec",
        ],
        "satform.dynamics": [
            "cw = satform.dynamics.models:CwDynamicsSpec",
            "linear_j2 = satform.dynamics.models:LinearJ2DynamicsSpec",
            "cw_perturbed = satform.dynamics.models:CwPerturbedDynamicsSpec",
            "inertial = satform.dynamics.models:InertialDynamicsSpec",
            "velocity_dependent = satform.dynamics.velocity_dependent:VelocityDependentDynamicsSpec",
        ],
        "satform.metrics": [
            "arc_length_mean = satform.evaluation.arc_lengths:ArcLengthMean",
            "arc_length_rate = satform.evaluation.arc_lengths:ArcLengthRate",
            "arc_length_settling = satform.evaluation.arc_lengths:ArcLengthSettling",
            "arc_length_spread = satform.evaluation.arc_lengths:ArcLengthSpread",
            "attitude_error_at = satform.evaluation.attitude:AttitudeErrorAt",
            "attitude_rate_error_at = satform.evaluation.attitude:AttitudeRateErrorAt",
            "attitude_settling = satform.evaluation.attitude:AttitudeSettling",
            "saturated_steps = satform.evaluation.equipment:SaturatedSteps",
            "control = satform.evaluation.control_effort:Control",
            "delta_v = satform.evaluation.control_effort:DeltaV",
            "distance = satform.evaluation.tracking:Distance",
            "estimation_error = satform.evaluation.equipment:EstimationError",
            "navigation_error = satform.evaluation.equipment:NavigationError",
            "offset = satform.evaluation.response:Offset",
            "overshoot = satform.evaluation.response:Overshoot",
            "panel_to_sun = satform.evaluation.attitude:PanelToSun",
            "pass_distance = satform.evaluation.passes:PassDistance",
            "pass_light_angle = satform.evaluation.passes:PassLightAngle",
            "pass_time = satform.evaluation.passes:PassTime",
            "pointing_error = satform.evaluation.attitude:PointingError",
            "propellant_used = satform.evaluation.equipment:PropellantUsed",
            "range = satform.evaluation.response:Range",
            "reaching_time = satform.evaluation.tracking:ReachingTime",
            "response_time = satform.evaluation.response:ResponseTime",
            "rejoin_time = satform.evaluation.presence:RejoinTime",
            "ripple = satform.evaluation.response:Ripple",
            "settling_time = satform.evaluation.tracking:SettlingTime",
            "sliding_variable = satform.evaluation.tracking:SlidingVariable",
            "spectral_radius = satform.evaluation.loops:SpectralRadius",
            "propellant_depleted_steps = satform.evaluation.equipment:PropellantDepletedSteps",
            "steps_absent = satform.evaluation.presence:StepsAbsent",
            "tracking_error = satform.evaluation.tracking:TrackingError",
            "tracking_error_at = satform.evaluation.tracking:TrackingErrorAt",
            "velocity_error = satform.evaluation.response:VelocityError",
            "wheel_momentum = satform.evaluation.attitude:WheelMomentum",
            "wheel_saturation = satform.evaluation.attitude:WheelSaturation",
            "wheel_torque = satform.evaluation.attitude:WheelTorque",
            "below_minimum_impulse_steps = satform.evaluation.equipment:BelowMinimumImpulseSteps",
        ],
        "satform.topologies": [
            "complete = satform.consensus.graph:CompleteSpec",
            "ring = satform.consensus.graph:RingSpec",
            "line = satform.consensus.graph:LineSpec",
            "star = satform.consensus.graph:StarSpec",
            "none = satform.consensus.graph:NoneSpec",
            "matrix = satform.consensus.graph:MatrixSpec",
            "random_regular = satform.consensus.random_graphs:RandomRegularSpec",
        ],
        "satform.distributions": [
            "choice = satform.campaign.distributions:ChoiceSpec",
            "log_uniform = satform.campaign.distributions:LogUniformSpec",
            "normal = satform.campaign.distributions:NormalSpec",
            "truncated_normal = satform.campaign.distributions:TruncatedNormalSpec",
            "uniform = satform.campaign.distributions:UniformSpec",
        ],
        "satform.sampling": [
            "grid = satform.campaign.sampling:GridSpec",
            "latin_hypercube = satform.campaign.sampling:LatinHypercubeSpec",
            "monte_carlo = satform.campaign.sampling:MonteCarloSpec",
            "one_at_a_time = satform.campaign.sampling:OneAtATimeSpec",
            "sobol = satform.campaign.sampling:SobolSpec",
        ],
        "satform.campaign_expectations": [
            "mean = satform.campaign.expectations:MeanSpec",
            "percentile = satform.campaign.expectations:PercentileSpec",
            "success_rate = satform.campaign.expectations:SuccessRateSpec",
        ],
        "satform.faults": [
            "clock_offset = satform.membership.faults:ClockOffsetSpec",
            "frozen_sensor = satform.membership.faults:FrozenSensorSpec",
            "byzantine = satform.membership.faults:ByzantineSpec",
            "satellite_lost = satform.membership.faults:SatelliteLostSpec",
            "stuck_thruster = satform.membership.faults:StuckThrusterSpec",
            "weak_thruster = satform.membership.faults:WeakThrusterSpec",
        ],
    },
)
