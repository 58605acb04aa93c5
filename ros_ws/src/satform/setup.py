"""Package description of `satform`, with the names under which a scenario finds its parts."""

from setuptools import find_packages, setup

setup(
    name="satform",
    version="0.1.0",
    packages=find_packages(include=["satform", "satform.*"]),
    package_data={"satform": ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/satform"]),
        ("share/satform", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    entry_points={
        "satform.curves": [
            "ellipse = satform.curves:EllipseSpec",
            "circle = satform.curves:CircleSpec",
            "fixed_point = satform.curves:FixedPointSpec",
        ],
        "satform.perturbations": [
            "constant = satform.dynamics.perturbations:ConstantSpec",
            "harmonic = satform.dynamics.perturbations:HarmonicSpec",
            "bounded_noise = satform.dynamics.perturbations:BoundedNoiseSpec",
        ],
        "satform.controllers": [
            "hill_pd = satform.control.hill_pd:HillPdSpec",
            "impulse = satform.control.waypoints:ImpulseSpec",
            "lqi = satform.control.integral:LqiSpec",
            "lqr = satform.control.lqr:LqrSpec",
            "observer = satform.control.observer:ObserverSpec",
            "relative_elements = satform.control.roe:ElementControlSpec",
            "sliding_mode = satform.control.sliding_mode:SlidingModeSpec",
            "timed_burns = satform.control.waypoints:TimedBurnsSpec",
        ],
        "satform.consensus": [
            "arc_length = satform.consensus.arc_length:ArcLengthConsensusSpec",
        ],
        "satform.dynamics": [
            "cw = satform.dynamics.models:CwDynamicsSpec",
            "cw_perturbed = satform.dynamics.models:CwPerturbedDynamicsSpec",
            "inertial = satform.dynamics.models:InertialDynamicsSpec",
        ],
        "satform.metrics": [
            "arc_length_mean = satform.metrics:ArcLengthMean",
            "arc_length_rate = satform.metrics:ArcLengthRate",
            "arc_length_settling = satform.metrics:ArcLengthSettling",
            "arc_length_spread = satform.metrics:ArcLengthSpread",
            "clipped_commands = satform.equipment_metrics:ClippedCommands",
            "control = satform.metrics:Control",
            "delta_v = satform.metrics:DeltaV",
            "distance = satform.metrics:Distance",
            "estimation_error = satform.equipment_metrics:EstimationError",
            "navigation_error = satform.equipment_metrics:NavigationError",
            "propellant_used = satform.equipment_metrics:PropellantUsed",
            "reaching_time = satform.metrics:ReachingTime",
            "settling_time = satform.metrics:SettlingTime",
            "sliding_variable = satform.metrics:SlidingVariable",
            "starved_steps = satform.equipment_metrics:StarvedSteps",
            "tracking_error = satform.metrics:TrackingError",
            "tracking_error_at = satform.metrics:TrackingErrorAt",
            "withheld_commands = satform.equipment_metrics:WithheldCommands",
        ],
        "satform.topologies": [
            "complete = satform.consensus.graph:CompleteSpec",
            "ring = satform.consensus.graph:RingSpec",
            "line = satform.consensus.graph:LineSpec",
            "star = satform.consensus.graph:StarSpec",
            "none = satform.consensus.graph:NoneSpec",
            "matrix = satform.consensus.graph:MatrixSpec",
        ],
    },
)
