# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""From a scenario to the plans of a flight's parts; `compile_satellite` has those of one satellite.

A scenario is taken apart in these two modules only. In-process flights, nodes and launcher start from
the same plans.
"""

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from satform.attitude.guidance import Orientation
from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.attitude.wheels import Wheels
from satform.communication.messages import WIDTH
from satform.communication.physical_links import LinkMedium
from satform.communication.receiver import LinkPlan
from satform.communication.satellite_groups import SatelliteGroups
from satform.communication.topic_table import Equipment, SensorTopic, TopicPlan
from satform.consensus.arc_length import Announces
from satform.dynamics.specs import OF_SATELLITES
from satform.flight.compile_satellite import attitude_orbit, departure, flight_plan, parameter_plan
from satform.flight.geodetic_fixes import GeodeticPlan, geodetic_plan
from satform.flight.orbit_states import OrbitStates, epoch_of, orbit_states, unperturbed_chief
from satform.flight.plans import (
    AttitudePlan,
    FlightPlan,
    LimitPlan,
    ParameterPlan,
    PlantPlan,
    ReconfigurationPlan,
    ScenePlan,
    TimingPlan,
)
from satform.flight.sun_states import SunStates
from satform.flight.truth import truth_model
from satform.membership.faults import FaultSchedule
from satform.membership.formation import MembershipPlan
from satform.navigation.joint_state import SIZE
from satform.numeric import stacking
from satform.orbits.curve import Curve, FixedPoint
from satform.orbits.curve_specs import InertialPointSpec
from satform.orbits.path_reference import Path
from satform.scenario import Scenario
from satform.scenario.navigation_checks import sensor_channels
from satform.scenario.parts import SatelliteSpec


class FormationPlan:
    """The plans of a flight's parts, each compiled when it is first asked for.

    A satellite's process so compiles neither the plant nor the other satellites.

    Attributes:
        name: of the scenario.
        names: of the satellites, in order.
        external: names of the satellites whose nodes somebody else starts.
        announces: what satellites exchange: their phase or their motion.
        timing: steps of the flight, and how long its parts wait.
        groups: of satellites that exchange arrays; None where each satellite has its own topics.
    """

    def __init__(self, scenario: Scenario, groups: SatelliteGroups | None = None) -> None:
        """Plans of a flight.

        Args:
            scenario: validated.
            groups: of satellites that exchange arrays; None where each satellite has its own topics.
        """
        self._scenario = scenario
        self.groups = groups
        self._satellites: dict[int, FlightPlan] = {}
        self.name = scenario.name
        self.names = tuple(satellite.name for satellite in scenario.satellites)
        self.external = external_satellites(scenario)
        self.announces: Announces = scenario.consensus.announces
        self.timing = timing_plan(scenario)

    @cached_property
    def membership(self) -> MembershipPlan:
        """Who takes part and over which graph, by step."""
        return self._scenario.membership_plan()

    @cached_property
    def faults(self) -> FaultSchedule:
        """What goes wrong with equipment and messages, by step."""
        return fault_schedule(self._scenario)

    @cached_property
    def links(self) -> LinkPlan:
        """What happens to messages between satellites."""
        return link_plan(self._scenario)

    @cached_property
    def topics(self) -> TopicPlan:
        """From what the topics of the flight follow."""
        if self.groups is not None:
            satellites = tuple(Equipment(name) for name in self.names)
            return TopicPlan(satellites, self.announces, self.groups.graph, self.groups)
        return topic_plan(self._scenario)

    @cached_property
    def orbit_states(self) -> OrbitStates | None:
        """What the inertial states on topics follow from; None where the scenario publishes none."""
        return orbit_states(self._scenario) if self._scenario.publish_orbits else None

    @cached_property
    def geodetic(self) -> GeodeticPlan | None:
        """What latitudes and longitudes on topics follow from; None where there are none."""
        topics = [topic for own in self.topics.satellites for topic in own.sensor_topics]
        late = [topic.latency for topic in topics if topic.kind == "fix"]
        return geodetic_plan(self._scenario, max(late)) if late else None

    @cached_property
    def limits(self) -> LimitPlan:
        """At what the flight ends early."""
        return limit_plan(self._scenario)

    @cached_property
    def plant(self) -> PlantPlan:
        """What the plant moves, and with what."""
        return plant_plan(self._scenario, [self._compiled(index) for index in range(len(self.names))])

    @cached_property
    def scene(self) -> ScenePlan:
        """What a picture of the formation needs to know."""
        return scene_plan(self._scenario)

    @cached_property
    def points_at_satellites(self) -> bool:
        """Whether a satellite points at another one."""
        specs = (self._scenario.satellite(index).attitude for index in range(len(self.names)))
        return any(spec is not None and isinstance(spec.pointing, SatellitePointingSpec) for spec in specs)

    def satellite(self, index: int, neighbours: Sequence[int] | None = None) -> FlightPlan:
        """Plan of one satellite; arguments as in `flight_plan`."""
        plan = self._compiled(index)
        target = None if plan.orientation is None else plan.orientation.target
        if neighbours is None or plan.orientation is None or target is None:
            return plan
        return replace(plan, orientation=replace(plan.orientation, target=target.among(neighbours)))

    def _compiled(self, index: int) -> FlightPlan:
        """Plan of one satellite, compiled once."""
        if index not in self._satellites:
            self._satellites[index] = flight_plan(self._scenario, index)
        return self._satellites[index]

    def parameters(self, index: int) -> ParameterPlan:
        """What of one satellite may be changed in flight."""
        return parameter_plan(self._scenario, index)

    def orientations(self) -> list[Orientation | None]:
        """Where each satellite points; None for one without attitude."""
        return [self._compiled(index).orientation for index in range(len(self.names))]

    @cached_property
    def reconfiguration(self) -> ReconfigurationPlan:
        """What new targets that are asked for in flight are checked against."""
        scenario = self._scenario
        whole = {own.name: scenario.satellite(index) for index, own in enumerate(scenario.satellites)}
        period = 2.0 * math.pi / scenario.orbit.rate
        return ReconfigurationPlan(whole, self.announces, period, scenario.limits.distance)

    @property
    def dynamics_text(self) -> str:
        """What the dynamics model is built from and all runs that are flown as one have to share, as JSON."""
        shared = self._scenario.dynamics.model_dump(mode="json", exclude=set(OF_SATELLITES))
        return json.dumps([self._scenario.orbit.rate, shared])


def compile_scenario(scenario: Scenario, groups: SatelliteGroups | None = None) -> FormationPlan:
    """The plans of a flight's parts.

    Args:
        scenario: validated.
        groups: of satellites that exchange arrays; None where each satellite has its own topics.
    """
    return FormationPlan(scenario, groups)


def timing_plan(scenario: Scenario) -> TimingPlan:
    """Steps of a flight, and how long its parts wait."""
    timing = scenario.timing
    return TimingPlan(
        step=timing.step,
        steps=timing.steps,
        step_nanoseconds=timing.step_nanoseconds,
        command_timeout=scenario.command_timeout,
        node_timeout=scenario.node_timeout,
        checkpoint_steps=scenario.checkpoint_steps,
        external_timeout=scenario.external_timeout if external_satellites(scenario) else 0.0,
    )


def external_satellites(scenario: Scenario) -> tuple[str, ...]:
    """Names of the satellites whose nodes somebody else starts."""
    return tuple(satellite.name for satellite in scenario.satellites if satellite.external)


def fault_schedule(scenario: Scenario) -> FaultSchedule:
    """What goes wrong with equipment and messages, by step."""
    names = [satellite.name for satellite in scenario.satellites]
    return FaultSchedule.of(scenario.faults, names, scenario.timing.step)


def link_plan(scenario: Scenario) -> LinkPlan:
    """What happens to messages between satellites."""
    names = tuple(satellite.name for satellite in scenario.satellites)
    width = WIDTH[scenario.consensus.announces]
    return LinkPlan(
        scenario.links, names, scenario.timing.step, scenario.seed, fault_schedule(scenario), width
    )


def topic_plan(scenario: Scenario) -> TopicPlan:
    """From what the topics of a flight follow."""
    specs = [scenario.satellite(index) for index in range(len(scenario.satellites))]
    medium = link_medium(scenario)
    receivers = set() if medium is None else set(medium.edges[:, 1].tolist())
    satellites = tuple(
        Equipment(
            name=spec.name,
            thruster=spec.thruster is not None,
            sensor=spec.measures_motion,
            filter=spec.estimates_motion,
            readings=sum(channel.width for channel in sensor_channels(scenario, index)),
            navigates=spec.navigation is not None,
            sensor_topics=_sensor_topics(scenario, index) if scenario.publish_sensor_messages else (),
            estimated=_estimated_size(scenario, spec),
            exchanges=spec.navigation is not None and spec.navigation.exchange != "none",
            plans=spec.controller is not None and spec.controller.makes_plans,
            attitude=spec.attitude is not None,
            attitude_filter=spec.estimates_attitude,
            links=index in receivers,
            orbit=scenario.publish_orbits,
            external=spec.external,
        )
        for index, spec in enumerate(specs)
    )
    return TopicPlan(satellites, scenario.consensus.announces, scenario.possible_graph())


def limit_plan(scenario: Scenario) -> LimitPlan:
    """At what a flight ends early."""
    names = tuple(satellite.name for satellite in scenario.satellites)
    return LimitPlan(names, scenario.timing.step, scenario.limits, scenario.orbit.radius)


def plant_plan(scenario: Scenario, compiled: Sequence[FlightPlan] | None = None) -> PlantPlan:
    """What the plant of a flight moves, and with what.

    Args:
        scenario: what is flown.
        compiled: plans of its satellites; they are compiled when left out.
    """
    step, count = scenario.timing.step, len(scenario.satellites)
    specs = [scenario.satellite(index) for index in range(count)]
    plans = [flight_plan(scenario, index) for index in range(count)] if compiled is None else compiled
    return PlantPlan(
        dynamics=truth_model(scenario),
        step=step,
        seed=scenario.seed,
        start=stacking.stack([plan.start for plan in plans]),
        chief_radius=scenario.orbit.radius,
        thrusters=tuple(None if spec.thruster is None else spec.thruster.build(step) for spec in specs),
        sensors=tuple(None if spec.sensor is None else spec.sensor.build(step) for spec in specs),
        attitudes=tuple(_attitude_plan(spec, plan, step) for spec, plan in zip(specs, plans, strict=True)),
        faults=fault_schedule(scenario),
        links=link_medium(scenario),
        attitude_orbits=tuple(attitude_orbit(scenario, index) for index in range(count)),
        channels=tuple(sensor_channels(scenario, index) for index in range(count)),
        navigates=tuple(spec.navigation is not None for spec in specs),
        sun=_sun_states(scenario, specs),
    )


def _sun_states(scenario: Scenario, specs: Sequence[SatelliteSpec]) -> SunStates | None:
    """Where the Sun is, if a sensor needs it."""
    epoch = epoch_of(scenario)
    if epoch is None or not any(sensor.needs_sun for spec in specs for sensor in spec.sensors):
        return None
    return SunStates(epoch, unperturbed_chief(scenario))


_STANDARD_MESSAGES = {
    "laser_ranging": "range",
    "radio_ranging": "range",
    "gyro": "imu",
    "star_tracker": "orientation",
    "gnss": "fix",
}
"""Kinds of sensors that sensor_msgs has a message for, and the kinds of their topics."""


def _sensor_topics(scenario: Scenario, index: int) -> tuple[SensorTopic, ...]:
    """Topics with a satellite's readings as messages of sensor_msgs, with a number where names are equal."""
    found: list[SensorTopic] = []
    names: Counter[str] = Counter()
    first = 0
    for channel in sensor_channels(scenario, index):
        kind, _, target = channel.name.partition(" ")
        name = f"{kind}_{target}" if target else kind
        names[name] += 1
        # A position on the Earth needs a date.
        if kind in _STANDARD_MESSAGES and not (kind == "gnss" and epoch_of(scenario) is None):
            number = f"_{names[name]}" if names[name] > 1 else ""
            variance = () if channel.model is None else tuple(channel.model.variance.tolist())
            found.append(
                SensorTopic(
                    name + number,
                    _STANDARD_MESSAGES[kind],
                    first,
                    channel.width,
                    channel.timing.latency,
                    variance,
                )
            )
        first += channel.width
    return tuple(found)


def _estimated_size(scenario: Scenario, spec: SatelliteSpec) -> int:
    """Numbers of the state of the whole formation that a satellite estimates; 0 for one that does not."""
    estimates = spec.navigation is not None and spec.navigation.estimates == "formation"
    return SIZE * len(scenario.satellites) if estimates else 0


def link_medium(scenario: Scenario) -> LinkMedium | None:
    """Radio and optical links between satellites; None where there are none."""
    if scenario.links is None or not scenario.links.physical:
        return None
    names = tuple(satellite.name for satellite in scenario.satellites)
    receivers, senders = np.nonzero(scenario.possible_graph().adjacency)
    edges = list(zip(senders.tolist(), receivers.tolist(), strict=True))
    return scenario.links.medium(edges, names)


def _attitude_plan(spec: SatelliteSpec, plan: FlightPlan, step: float) -> AttitudePlan | None:
    if spec.attitude is None or plan.orientation is None:
        return None
    limits = (spec.attitude.wheel_torque_limit, spec.attitude.wheel_momentum_limit)
    wheels = Wheels(*(np.asarray(np.inf if limit is None else limit) for limit in limits))
    parts = max(1, math.ceil(step / spec.attitude.maximum_step * (1.0 - 1e-12)))
    return AttitudePlan(plan.orientation, wheels, parts)


def scene_plan(scenario: Scenario) -> ScenePlan:
    """What a picture of a formation needs to know of it beside what it sees."""
    specs = [scenario.satellite(index) for index in range(len(scenario.satellites))]
    return ScenePlan(
        names=tuple(spec.name for spec in specs),
        step=scenario.timing.step,
        period=min(_longest_revolution(scenario), scenario.timing.duration),
        curves=tuple(_shown_curve(scenario, spec) for spec in specs),
        attitude_orbits=tuple(attitude_orbit(scenario, index) for index in range(len(specs))),
        graph=scenario.communication_graph(),
    )


def _shown_curve(scenario: Scenario, spec: SatelliteSpec) -> Curve:
    """The curve of a satellite in LVLH; a point of other axes where it is at time zero."""
    assert spec.curve is not None  # noqa: S101 - the scenario's validator has seen to it
    if isinstance(spec.curve, InertialPointSpec):
        _, _, desired = departure(scenario, spec)
        return FixedPoint(position=desired.position, perimeter=np.zeros(()))
    return spec.curve.build()


def _longest_revolution(scenario: Scenario) -> float:
    """Time of the longest revolution of any satellite along its curve, s."""
    rate = scenario.nominal_motion.rate
    if rate is None:
        assert scenario.nominal_motion.period is not None  # noqa: S101 - the scenario's validator has seen to it
        return scenario.nominal_motion.period
    specs = [scenario.satellite(index) for index in range(len(scenario.satellites))]
    periods = [float(Path(spec.curve.build(), np.asarray(spec.scale)).period) for spec in specs if spec.curve]
    longest = max(periods)
    return longest / abs(rate) if rate and longest else 2.0 * math.pi / scenario.orbit.rate
