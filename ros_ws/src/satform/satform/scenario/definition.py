# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a scenario file says, and what follows directly from it. SI units and radians."""

from functools import cached_property
from typing import Annotated

from pydantic import Field

from satform.common.spec import Plugin, Positive, Spec
from satform.communication.channel_model import LinksSpec
from satform.consensus.arc_length import ConsensusSpec
from satform.consensus.graph import Graph, TopologySpec
from satform.control.protocol import FlightSetting, Motion
from satform.dynamics.protocol import DynamicsSetting, DynamicsSpec
from satform.membership.faults import FaultSpec
from satform.membership.formation import GraphChangeSpec, MembershipPlan, planned_events
from satform.membership.reconfiguration import ReconfigurationSpec
from satform.orbits.chief import KeplerianChief
from satform.scenario.deployment import HostSpec
from satform.scenario.expectation import Expectation
from satform.scenario.limits import LimitsSpec
from satform.scenario.parts import (
    Name,
    NominalMotion,
    Orbit,
    SatelliteFields,
    SatelliteSpec,
    Sentence,
    Source,
    Timing,
)
from satform.scenario.satellite_start import ChiefAtStart, chief_at_start
from satform.scenario.stations import StationSpec


class ScenarioDefinition(Spec):
    """Fields of a scenario, in the order of the file, and quantities that they determine.

    Nothing here has been checked against each other: `Scenario` is the checked one.
    """

    name: Name = "formation"
    """The scenario's own name: lower case letters, digits and underscores."""
    title: Sentence = "untitled"
    """One line that says what is flown."""
    text: Sentence = ""
    """What the scenario shows, which of its numbers were printed in its source and which chosen."""
    sources: tuple[Source, ...] = ()
    """Where the scenario comes from."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    """Seed of everything random in the run."""
    orbit: Orbit
    """The chief's orbit."""
    timing: Timing
    """Control period and duration."""
    dynamics: Annotated[DynamicsSpec, Plugin("satform.dynamics")]
    """The model that moves the satellites."""
    graph: Annotated[TopologySpec, Plugin("satform.topologies")]
    """The communication graph."""
    consensus: Annotated[ConsensusSpec, Plugin("satform.consensus")]
    """How satellites agree on their phase."""
    nominal_motion: NominalMotion
    """How fast they go round."""
    # Made without validation, which would make validators of all kinds at import.
    satellite_defaults: SatelliteFields = SatelliteFields.model_construct()
    """Defaults for all satellites."""
    satellites: Annotated[tuple[SatelliteSpec, ...], Field(min_length=1, max_length=10_000)]
    """The satellites, in the order of the graph's rows."""
    links: LinksSpec | None = None
    """What happens to messages between satellites; when left out every message arrives at once."""
    graph_schedule: tuple[GraphChangeSpec, ...] = ()
    """When the communication graph becomes another one."""
    faults: tuple[Annotated[FaultSpec, Plugin("satform.faults")], ...] = ()
    """What goes wrong, and when."""
    reconfigurations: Annotated[tuple[ReconfigurationSpec, ...], Field(max_length=10_000)] = ()
    """When satellites get other targets, and which."""
    stations: Annotated[tuple[StationSpec, ...], Field(max_length=100)] = ()
    """Ground stations whose contacts are in the report; they change nothing in the flight."""
    line_of_sight_margin: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Height above the Earth's equatorial radius that a line of sight between satellites keeps, m."""
    publish_orbits: bool = False
    """Whether the plant publishes the inertial state and the relative elements of every satellite at every
    step; they change nothing in the flight."""
    publish_sensor_messages: bool = False
    """Whether the plant also publishes readings of sensors as messages of sensor_msgs, for programs that know
    these; they change nothing in the flight."""
    limits: LimitsSpec = LimitsSpec()
    """At what a flight ends early, as one that has diverged or hit the ground."""
    checkpoint_period: Positive | None = None
    """Time between two checkpoints of each satellite, s; none are stored when left out."""
    tolerated_losses: Annotated[int, Field(ge=0)] = 0
    """Satellites that may be lost, beside those in `faults`, without the run counting as failed."""
    expect: tuple[Annotated[Expectation, Plugin("satform.metrics")], ...] = ()
    """What the run is judged by."""
    omitted_expectations: tuple[Sentence, ...] = ()
    """Labels of what the longer flight is judged by that `--set` has shortened, and this one is not."""
    command_timeout: Positive = 10.0
    """Simulated time for which a command is held on the wall clock while no newer one arrives, s; after it
    the satellite's thrusters and wheels are off. A command is held for a step after its own at least."""
    node_timeout: Annotated[float, Field(ge=0.1, le=86_400.0)] = 10.0
    """Wall-clock time after which a satellite that sends no message counts as lost, s; the plant counts as
    lost after twice that time."""
    external_timeout: Annotated[float, Field(ge=1.0, le=86_400.0)] = 120.0
    """Wall-clock time for which a run waits at the start for the nodes of external satellites, s."""
    hosts: Annotated[tuple[HostSpec, ...], Field(max_length=1000)] = ()
    """Which machine runs which part, where the formation is flown on several."""

    @property
    def chief(self) -> KeplerianChief | None:
        """The chief's orbit at time zero, as laws and figures know it.

        Returns:
            None for a circular one in an unknown plane. A truth model about a circle has the circle of an
            eccentric `orbit.chief`.
        """
        own = self.dynamics.keplerian_chief(self.orbit.rate)
        if own is None and self.orbit.chief is not None:
            circle = self.orbit.chief.orbit.model_copy(update={"eccentricity": 0.0})
            return circle.keplerian(self.orbit.rate)
        return own

    @property
    def setting(self) -> FlightSetting:
        """What all satellites know of the flight: the chief's orbit and the control period."""
        return FlightSetting(mean_motion=self.orbit.rate, step=self.timing.step, chief=self.chief)

    @property
    def dynamics_setting(self) -> DynamicsSetting:
        """What the truth model is built with."""
        return DynamicsSetting(self.orbit.rate, self.timing.step, len(self.satellites), self.seed)

    @property
    def checkpoint_steps(self) -> int | None:
        """Control steps between two checkpoints of a satellite; None when none are kept."""
        if self.checkpoint_period is None:
            return None
        return max(1, round(self.checkpoint_period / self.timing.step))

    @cached_property
    def _graph(self) -> Graph:
        return self.graph.build(len(self.satellites))

    @cached_property
    def _possible_graph(self) -> Graph:
        return self.membership_plan().possible_graph

    def communication_graph(self) -> Graph:
        """The communication graph at the start, with a row for each satellite in order."""
        return self._graph

    def possible_graph(self) -> Graph:
        """Every edge that the communication graph has at some time of the flight."""
        return self._possible_graph

    def membership_plan(self) -> MembershipPlan:
        """Who takes part and over which graph, by step."""
        names = tuple(satellite.name for satellite in self.satellites)
        events = planned_events(
            names,
            self._graph,
            self.timing.step,
            self.faults,
            self.graph_schedule,
            self.checkpoint_steps,
            self.reconfigurations,
        )
        return MembershipPlan(names, self._graph, events, self.timing.steps)

    @cached_property
    def _chief_at_start(self) -> ChiefAtStart:
        return chief_at_start(self.orbit, self.dynamics, self.dynamics_setting, self.chief)

    def start_of(self, index: int) -> Motion | None:
        """Position (m) and velocity (m/s) in LVLH at time zero that a satellite's `start` stands for.

        Args:
            index: of the satellite.

        Returns:
            None for a satellite without one, which starts on its reference.

        Raises:
            ValueError: the start cannot be taken about this chief.
        """
        start = self.satellites[index].start
        return None if start is None else self._chief_at_start.motion(start)

    def satellite(self, index: int) -> SatelliteSpec:
        """One satellite with what it left out filled in from `satellite_defaults`."""
        own = self.satellites[index]
        inherited = {
            field: getattr(self.satellite_defaults, field)
            for field in self.satellite_defaults.model_fields_set - own.model_fields_set
        }
        return own.model_copy(update=inherited)
