# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The typed model of a scenario file. SI units and radians; nothing unknown is accepted."""

import hashlib
import math
import re
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any

from pydantic import Field, ValidationError, ValidationInfo, model_validator

from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.common.spec import Complaint, Plugin, Positive, Spec, require_consistent
from satform.communication.channel_model import LinksSpec
from satform.consensus.arc_length import ConsensusSpec
from satform.consensus.graph import Graph, TopologySpec
from satform.control.protocol import FlightSetting, Motion, require_protocol
from satform.dynamics.integrators import substep_complaint
from satform.dynamics.protocol import DynamicsSetting, DynamicsSpec
from satform.files.named_file import BY_CONTENT, with_copies
from satform.membership.faults import FaultSpec
from satform.membership.formation import GraphChangeSpec, MembershipPlan, planned_events
from satform.orbits.chief import KeplerianChief
from satform.scenario.deployment import HostSpec, host_complaints
from satform.scenario.environment import environment_complaints, environment_of
from satform.scenario.expectation import Expectation
from satform.scenario.limits import LimitsSpec
from satform.scenario.membership_checks import fault_complaints, schedule_complaints
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
from satform.scenario.satellite_start import (
    ChiefAtStart,
    chief_at_start,
    chief_complaints,
    known_starts,
    start_complaints,
    without_chief,
)
from satform.scenario.start import coincident_with_followed, singular_references
from satform.scenario.stations import StationSpec, station_complaints
from satform.scenario.variation import refusal, varied

_NOT_IN_YAML = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")
"""Characters that stand in JSON as they are, but not in YAML, which reads it otherwise as its own."""

_RESERVED_NAMES = frozenset({"plant", "recorder", "display", "formation", "clock"})


class _RefusedInSentences(type(Spec)):  # type: ignore[misc]
    """Class of a model whose constructor raises `ScenarioError` instead of pydantic's own error."""

    def __call__(cls, /, **fields: Any) -> Any:
        try:
            return super().__call__(**fields)
        except ValidationError as error:
            raise refusal(cls, fields, error.errors(include_url=False)) from None


def _initial_target_complaints(own: str, target: str | None, names: list[str]) -> list[str]:
    if target is None or (target in names and target != own):
        return []
    others = ", ".join(sorted(set(names) - {own})) or "no others"
    return [f"pointing.initial_target: {target} is not another satellite; there are {others}"]


class Scenario(Spec, metaclass=_RefusedInSentences):
    """A formation, its flight and what is expected of it. A run is a pure function of this."""

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
    satellite_defaults: SatelliteFields = SatelliteFields()
    """Defaults for all satellites."""
    satellites: Annotated[tuple[SatelliteSpec, ...], Field(min_length=1, max_length=10_000)]
    """The satellites, in the order of the graph's rows."""
    links: LinksSpec | None = None
    """What happens to messages between satellites; when left out every message arrives at once."""
    graph_schedule: tuple[GraphChangeSpec, ...] = ()
    """When the communication graph becomes another one."""
    faults: tuple[Annotated[FaultSpec, Plugin("satform.faults")], ...] = ()
    """What goes wrong, and when."""
    stations: Annotated[tuple[StationSpec, ...], Field(max_length=100)] = ()
    """Ground stations whose contacts are in the report; they change nothing in the flight."""
    line_of_sight_margin: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Height above the Earth's equatorial radius that a line of sight between satellites keeps, m."""
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
    hosts: Annotated[tuple[HostSpec, ...], Field(max_length=1000)] = ()
    """Which machine runs which part, where the formation is flown on several."""

    @model_validator(mode="after")
    def _about_the_chief(self) -> "Scenario":
        if self.orbit.chief is not None:
            require_consistent(chief_complaints(self.dynamics))
            # All who ask the truth model for chief and date find those of the orbit.
            about = self.dynamics.about(self.orbit.chief.orbit, self.orbit.chief.time_zero)
            self.__dict__["dynamics"] = about
        return self

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> "Scenario":
        complaints = [
            *self._satellite_complaints(),
            *self._equipment_complaints(),
            *self._controller_complaints(),
            *self._dynamics_complaints(),
            *self._graph_complaints(),
            *self._following_complaints(),
            *self._reference_complaints(),
            *self._attitude_complaints(),
            *self._environment_complaints(),
            *self._expectation_complaints(recorded=bool(getattr(info.context, "recorded", False))),
            *self._link_complaints(),
            *self._schedule_complaints(),
            *self._fault_complaints(),
            *self.limits.complaints(self.orbit.altitude),
            *self._station_complaints(),
            *host_complaints(self.hosts, [satellite.name for satellite in self.satellites]),
        ]
        require_consistent(complaints)
        return self

    def _satellite_complaints(self) -> list[Complaint]:
        complaints: list[Complaint] = []
        seen: set[str] = set()
        for index, satellite in enumerate(self.satellites):
            name = satellite.name
            if name in seen:
                sentence = f"another satellite is called {name} too; every name has to be its own"
                complaints.append((("satellites", index, "name"), sentence))
            seen.add(name)
            if name in _RESERVED_NAMES:
                sentence = f"a satellite cannot be called {name}: the name belongs to another node"
                complaints.append((("satellites", index, "name"), sentence))
            for field in ("curve", "controller"):
                if getattr(satellite, field) is None and getattr(self.satellite_defaults, field) is None:
                    sentence = f"satellite {name} has no {field}: give it one, or give satellite_defaults one"
                    complaints.append((("satellites", index), sentence))
        return complaints

    def _equipment_complaints(self) -> list[Complaint]:
        complaints: list[Complaint] = []
        inherits_all = False
        for index, own in enumerate(self.satellites):
            given = own.model_fields_set & {"thruster", "sensor", "filter"}
            if inherits_all and not given:
                # One satellite with nothing of its own is like another.
                continue
            inherits_all = inherits_all or not given
            for field, sentence in self.satellite(index).equipment_complaints(
                self.orbit.rate, self.timing.step
            ):
                place = ("satellites", index, field) if field in given else ("satellite_defaults", field)
                if (place, sentence) not in complaints:
                    complaints.append((place, sentence))
        return complaints

    def _controller_complaints(self) -> list[Complaint]:
        setting = self.setting
        complaints: list[Complaint] = []
        tried: set[str] = set()
        for index, own in enumerate(self.satellites):
            law = own.controller or self.satellite_defaults.controller
            # One satellite with nothing of its own is like another.
            gains = "" if own.controller is None else repr(law)
            if law is None or gains in tried:
                continue
            tried.add(gains)
            try:
                require_protocol(law.build(setting), law)
            except ValueError as error:
                place = ("satellite_defaults",) if own.controller is None else ("satellites", index)
                complaints.append(((*place, "controller"), str(error)))
        return complaints

    def _dynamics_complaints(self) -> list[Complaint]:
        setting = DynamicsSetting(self.orbit.rate, self.timing.step, len(self.satellites), self.seed)
        found = self.dynamics.complaints(setting)
        whole: list[Complaint] = [(("dynamics", *field), sentence) for field, sentence in found]
        # Where a satellite starts is asked of a truth model that can be flown.
        shared = self.satellite_defaults.model_fields_set
        return whole or start_complaints(self.satellites, shared, self.start_of)

    def _expectation_complaints(self, *, recorded: bool) -> list[Complaint]:
        whole = {own.name: self.satellite(index) for index, own in enumerate(self.satellites)}
        complaints: list[Complaint] = []
        for index, expectation in enumerate(self.expect):
            found = expectation.complaints(set(whole), self.timing)
            found = found or expectation.complaints_about_satellites(whole, self.consensus.announces)
            found = found or expectation.orbit_complaints(self.setting, self.timing)
            if not expectation.has_criterion:
                found.append("give a value with its tolerance, or below, or above")
            elif not (expectation.origin or recorded):
                found.append(
                    "nothing says where the figure comes from: give a source (paper, theory, another "
                    "program), or say regression: true where it is what this software gave"
                )
            complaints += [(("expect", index), sentence) for sentence in found]
        return complaints

    def _graph_complaints(self) -> list[Complaint]:
        try:
            self.communication_graph()
        except ValueError as error:
            return [(("graph",), str(error))]
        return []

    def _following_complaints(self) -> list[Complaint]:
        shares_motion = self.consensus.announces == "motion"
        complaints: list[Complaint] = []
        for index, own in enumerate(self.satellites):
            law = self.satellite(index).controller
            if law is None or (law.follows == "neighbour") == shares_motion:
                continue
            sent = "their motion" if shares_motion else "their arc length"
            sentence = (
                f"satellite {own.name} has a controller that follows a {law.follows}, but satellites send "
                f"each other {sent}; consensus kind motion goes with controllers that follow a neighbour"
            )
            complaints.append((("satellites", index), sentence))
        if complaints or not shares_motion:
            return complaints
        try:
            graph = self.communication_graph()
        except ValueError:
            return []
        for index, own in enumerate(self.satellites):
            in_degree = len(graph.neighbours(index))
            if in_degree != 1:
                sentence = (
                    f"satellite {own.name} has {in_degree} in-neighbours; it needs one, which it follows"
                )
                complaints.append((("graph",), sentence))
        if complaints or any(self.satellite(index).curve is None for index in range(len(self.satellites))):
            return complaints
        whole = [self.satellite(index) for index in range(len(self.satellites))]
        found = coincident_with_followed(whole, graph, known_starts(len(whole), self.start_of))
        return [(("satellites", index), text) for index, text in found]

    def _reference_complaints(self) -> list[Complaint]:
        whole = [self.satellite(index) for index in range(len(self.satellites))]
        found = singular_references(whole, 2.0 * math.pi / self.orbit.rate)
        return [(("satellites", index), sentence) for index, sentence in found]

    def _attitude_complaints(self) -> list[Complaint]:
        names = [satellite.name for satellite in self.satellites]
        graph: Graph | None = None
        complaints: list[Complaint] = []
        for index in range(len(names)):
            spec = self.satellite(index).attitude
            if spec is None:
                continue
            found = spec.complaints(self.orbit.rate)
            too_many = substep_complaint(self.timing.step, spec.maximum_step)
            found += [] if too_many is None else [f"maximum_step: {too_many}"]
            if isinstance(spec.pointing, SatellitePointingSpec):
                graph = graph or self._graph_or_none()
                found += self._target_complaints(index, spec.pointing.target, names, graph)
                found += _initial_target_complaints(names[index], spec.pointing.initial_target, names)
            complaints += [(("satellites", index), f"attitude of {names[index]}: {fault}") for fault in found]
        return complaints

    def _environment_complaints(self) -> list[Complaint]:
        attitudes = (
            (index, own.name, self.satellite(index).attitude) for index, own in enumerate(self.satellites)
        )
        pointings = [(index, name, spec.pointing) for index, name, spec in attitudes if spec is not None]
        environment = environment_of(self.dynamics)
        if environment is None:
            return []
        found = environment_complaints(environment, pointings)
        for index, expectation in enumerate(self.expect):
            found += [
                (("expect", index, field), sentence)
                for field, sentence in expectation.environment_complaints(environment)
            ]
        return found

    def _station_complaints(self) -> list[Complaint]:
        found = station_complaints(self.stations)
        if self.stations and environment_of(self.dynamics) is None:
            kind = getattr(self.dynamics, "kind", type(self.dynamics).__name__)
            sentence = (
                f"ground stations need a truth model with a date, cw_perturbed or inertial; found {kind}, "
                "which does not know where the Earth's surface is"
            )
            found.append((("stations",), sentence))
        return found

    def _target_complaints(self, index: int, target: str, names: list[str], graph: Graph | None) -> list[str]:
        if target not in names:
            return [f"there is no satellite {target} to point at; there are {', '.join(sorted(names))}"]
        if self.consensus.announces != "arc_length":
            return ["pointing at another satellite needs its arc length, and satellites send their motion"]
        if graph is None:
            return []
        if names.index(target) not in graph.neighbours(index):
            return [f"pointing at {target} needs it as an in-neighbour"]
        return []

    def _link_complaints(self) -> list[Complaint]:
        if self.links is None:
            return []
        names = [satellite.name for satellite in self.satellites]
        found = self.links.complaints(names, self.timing.step)
        return [(("links", *place), sentence) for place, sentence in found]

    def _schedule_complaints(self) -> list[Complaint]:
        graph = self._graph_or_none()
        if graph is None:
            return []
        names = [satellite.name for satellite in self.satellites]
        return schedule_complaints(self.graph_schedule, graph, names, self.timing, self.consensus.announces)

    def _fault_complaints(self) -> list[Complaint]:
        whole = {own.name: self.satellite(index) for index, own in enumerate(self.satellites)}
        return fault_complaints(
            self.faults, whole, self.timing, self.consensus.announces, self.checkpoint_period
        )

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
    def checkpoint_steps(self) -> int | None:
        """Control steps between two checkpoints of a satellite; None when none are kept."""
        if self.checkpoint_period is None:
            return None
        return max(1, round(self.checkpoint_period / self.timing.step))

    def _graph_or_none(self) -> Graph | None:
        try:
            return self.communication_graph()
        except ValueError:
            return None

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
        )
        return MembershipPlan(names, self._graph, events, self.timing.steps)

    @cached_property
    def _chief_at_start(self) -> ChiefAtStart:
        setting = DynamicsSetting(self.orbit.rate, self.timing.step, len(self.satellites), self.seed)
        return chief_at_start(self.orbit, self.dynamics, setting, self.chief)

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

    def with_(self, changes: Mapping[str, Any] | None = None, /, **fields: Any) -> "Scenario":
        """This scenario with some fields set to other values, checked like a file.

        Args:
            changes: values by the path of a field as messages print it, such as `{"timing.step": 0.5}`,
                `{"satellites[sat1].scale": 2.0}`, or `{"satellites[*].controller.boundary_layer": 1e-3}` for
                all satellites.
            **fields: whole fields of the scenario, such as `seed=3` or `graph=RingSpec()`.

        Returns:
            A new scenario. Where the flight became shorter, what is expected, breaks or changes beyond its
            new end is left out.

        Raises:
            ScenarioError: a path leads nowhere, or the changed scenario cannot fly; all problems at once.
        """
        return varied(type(self), self.to_json(), self.files(), {**(changes or {}), **fields})

    def __repr__(self) -> str:
        count, timing = len(self.satellites), self.timing
        satellites = "1 satellite" if count == 1 else f"{count} satellites"
        dynamics = getattr(self.dynamics, "kind", type(self.dynamics).__name__)
        return f"<Scenario {self.name}: {satellites}, {dynamics}, {timing.steps} steps of {timing.step:g} s>"

    __str__ = __repr__

    def to_json(self) -> str:
        """The scenario as JSON text, from which the same scenario is read again.

        Files that it names stand there by the names of their copies, the keys of `files`.
        """
        text, _ = with_copies(self, indent=1, exclude_unset=True)
        return _NOT_IN_YAML.sub(lambda found: f"\\u{ord(found[0]):04x}", text)

    def files(self) -> dict[str, bytes]:
        """Content of the files that the scenario names, by the names of their copies."""
        return with_copies(self, exclude_unset=True)[1]

    def digest(self) -> str:
        """SHA-256 of the scenario's meaning: the same for two files that describe the same run."""
        satellites = tuple(self.satellite(index) for index in range(len(self.satellites)))
        parts = {"satellites": satellites, "satellite_defaults": SatelliteFields()}
        # What follows from the orbit is counted with the orbit: its last digits may differ among processors.
        explicit = self.model_copy(update={**parts, "dynamics": without_chief(self.dynamics, self.orbit)})
        without_start = [index for index, satellite in enumerate(satellites) if satellite.start is None]
        # Where the parts run does not change what is flown, nor what is not judged what is judged; nor
        # does it matter that an orbit was allowed, who looks on from the ground, or that a scenario could say
        # more and does not.
        return hashlib.sha256(
            explicit.model_dump_json(
                exclude={
                    "hosts": True,
                    "omitted_expectations": True,
                    "orbit": {"allow_below_surface", *(() if self.orbit.chief else ("chief",))},
                    "satellites": {index: {"start"} for index in without_start},
                    "stations": True,
                    "line_of_sight_margin": True,
                },
                context=BY_CONTENT,
            ).encode()
        ).hexdigest()
