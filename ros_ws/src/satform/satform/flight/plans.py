# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of the parts of a flight: plain data, compiled once from a scenario.

Each part takes its own plan and no scenario. `satform.flight.compile` makes them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from satform.attitude.attitude_filter import AttitudeFilter
from satform.attitude.ground_pointing import CircularOrbit
from satform.attitude.guidance import Orientation
from satform.attitude.wheels import Wheels
from satform.common.spec import Spec
from satform.communication.physical_links import LinkMedium
from satform.consensus.arc_length import Announces, ArcLengthConsensus
from satform.consensus.graph import Graph
from satform.consensus.motion_sharing import MotionSharing
from satform.control.protocol import FlightSetting, Motion
from satform.dynamics.protocol import Dynamics
from satform.equipment.sensors.protocol import SensorChannel
from satform.equipment.sensors.relative_motion import Sensor
from satform.equipment.thruster import Thruster
from satform.flight.sun_states import SunStates
from satform.membership.faults import FaultSchedule
from satform.navigation.relative_state_filter import Estimator
from satform.navigation.satellite_navigation import SatelliteNavigation
from satform.numeric.elementwise import Array
from satform.orbits.curve import Curve
from satform.orbits.curve_specs import CurveSpec
from satform.orbits.path_reference import Path
from satform.scenario.limits import LimitsSpec
from satform.scenario.parts import NominalMotion, SatelliteSpec


@dataclass(frozen=True)
class TimingPlan:
    """Steps of a flight, and how long its parts wait.

    Attributes:
        step: control period, s.
        steps: of the whole flight.
        step_nanoseconds: control period in whole nanoseconds, from which every stamp is computed.
        command_timeout: simulated time for which a command is held while no newer one arrives, s.
        node_timeout: wall-clock time after which a satellite that does not answer counts as lost, s.
        checkpoint_steps: steps between two checkpoints of a satellite; None when none are stored.
        external_timeout: wall-clock time for which the start waits for external satellites, s; zero without
            any.
    """

    step: float
    steps: int
    step_nanoseconds: int
    command_timeout: float
    node_timeout: float
    checkpoint_steps: int | None
    external_timeout: float = 0.0

    @property
    def duration(self) -> float:
        """Simulated time of the whole flight, s."""
        return self.steps * self.step


@dataclass(frozen=True)
class FlightPlan:
    """Plan of a satellite before flight; arrays carry a leading axis when many fly as one.

    Attributes:
        path: the closed orbit to fly and how it is parametrised.
        controller: the control law, a `Controller`, or a `NeighbourController` under `MotionSharing`.
        consensus: the law by which satellites agree on their phase, or the sharing of their motion.
        nominal_rate: rate of the generalised arc length once all agree, m/s, shape (...).
        phase_offset: by how much this satellite leads the agreement, m, shape (...).
        arc_length: generalised, at the start, m, shape (...).
        rate: of the generalised arc length at the start, m/s, shape (...).
        start: where the satellite begins.
        step: control period, s.
        estimator: what is made of the measurements; None to take them as they are.
        orientation: where the satellite points and how; None for one without attitude.
        navigation: the filter on the readings of its sensors; None for one that flies by measured motion.
        attitude_filter: likewise of its gyro and star trackers; None for one that knows its true attitude.
    """

    path: Path
    controller: Any
    consensus: ArcLengthConsensus | MotionSharing
    nominal_rate: Array
    phase_offset: Array
    arc_length: Array
    rate: Array
    start: Motion
    step: float
    estimator: Estimator | None = None
    orientation: Orientation | None = None
    navigation: SatelliteNavigation | None = None
    attitude_filter: AttitudeFilter | None = None


@dataclass(frozen=True)
class AttitudePlan:
    """The attitude of one satellite in the plant.

    Attributes:
        orientation: body, pointing and attitude at the start.
        wheels: with their limits.
        parts: sub-steps of a control period in which the true attitude is integrated.
    """

    orientation: Orientation
    wheels: Wheels
    parts: int


@dataclass(frozen=True, eq=False)
class PlantPlan:
    """What the plant moves, and with what.

    Attributes:
        dynamics: truth model of all satellites.
        step: control period, s.
        seed: of everything random in the run.
        start: position in m and velocity in m/s of all satellites, LVLH, shapes (N, 3).
        chief_radius: of the chief's orbit, m; of satellites of many runs shape (N,).
        thrusters: of each satellite; None for one that gives its commands as they are.
        sensors: of each satellite; None for one that knows its true motion.
        attitudes: of each satellite; None for one without attitude.
        faults: of thrusters and sensors.
        links: radio and optical links, whose state follows from the truth; None where there are none.
        attitude_orbits: the chief's orbit in the axes of each satellite's attitude; None without attitude.
        channels: of the sensors of each satellite, in order.
        navigates: whether each satellite knows its motion by these sensors alone.
        sun: where the Sun is; None where no sensor needs it.
        identities: for satellites of many runs, the seed of each one's run and its index in that run; None
            for those of one run.
    """

    dynamics: Dynamics
    step: float
    seed: int
    start: Motion
    chief_radius: Array | float
    thrusters: tuple[Thruster | None, ...]
    sensors: tuple[Sensor | None, ...]
    attitudes: tuple[AttitudePlan | None, ...]
    faults: FaultSchedule
    identities: tuple[tuple[int, int], ...] | None = None
    links: LinkMedium | None = None
    attitude_orbits: tuple[CircularOrbit | None, ...] = ()
    channels: tuple[tuple[SensorChannel, ...], ...] = ()
    navigates: tuple[bool, ...] = ()
    sun: SunStates | None = None


@dataclass(frozen=True)
class LimitPlan:
    """At what a flight ends early.

    Attributes:
        names: of the satellites.
        step: control period, s.
        limits: of distances, speeds, accelerations, rates, altitude.
        chief_radius: of the chief's orbit, m.
    """

    names: tuple[str, ...]
    step: float
    limits: LimitsSpec
    chief_radius: float


@dataclass(frozen=True)
class ParameterPlan:
    """What of one satellite may be changed in flight.

    Attributes:
        controller: specification of its control law.
        curve: specification of its orbit.
        phase_offset: generalised arc length by which it leads the agreement, m.
        attitude_controller: specification of its attitude law; None without attitude.
        setting: what a control law may know when it is built.
        scale: metres of arc length per metre of generalised arc length.
        nominal_motion: how fast the satellite goes round once all agree.
    """

    controller: Spec
    curve: CurveSpec
    phase_offset: float
    attitude_controller: Spec | None
    setting: FlightSetting
    scale: float
    nominal_motion: NominalMotion


@dataclass(frozen=True, eq=False)
class ReconfigurationPlan:
    """What new targets of satellites that are asked for in flight are checked against.

    Attributes:
        satellites: by their names, each with what it has from the defaults.
        announces: what satellites send each other.
        nominal_period: about the time of one revolution, s.
        largest_distance: of a reference from the chief, m.
    """

    satellites: Mapping[str, SatelliteSpec]
    announces: Announces
    nominal_period: float
    largest_distance: float


@dataclass(frozen=True, eq=False)
class ScenePlan:
    """What a picture of a formation needs to know of it beside what it sees.

    Attributes:
        names: of the satellites.
        step: control period, s.
        period: of the longest revolution of any satellite along its curve, or the duration if shorter, s.
        curves: on which the satellites are to fly.
        attitude_orbits: the chief's orbit in the axes of each satellite's attitude; None without attitude.
        graph: of communication at the start.
    """

    names: tuple[str, ...]
    step: float
    period: float
    curves: tuple[Curve, ...]
    attitude_orbits: tuple[CircularOrbit | None, ...]
    graph: Graph
