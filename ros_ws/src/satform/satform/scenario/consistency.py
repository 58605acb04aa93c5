# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks of the parts of a scenario against each other, beyond what each part checks of itself."""

import math

from satform.attitude.satellite_pointing import SatellitePointingSpec
from satform.common.spec import Complaint
from satform.consensus.graph import Graph
from satform.control.protocol import require_protocol
from satform.dynamics.integrators import substep_complaint
from satform.scenario.definition import ScenarioDefinition
from satform.scenario.deployment import host_complaints
from satform.scenario.environment import environment_complaints, environment_of
from satform.scenario.figure_checks import figure_complaints
from satform.scenario.inertial_points import inertial_point_complaints
from satform.scenario.membership_checks import fault_complaints, schedule_complaints
from satform.scenario.navigation_checks import navigation_complaints
from satform.scenario.reconfiguration_checks import reconfiguration_complaints
from satform.scenario.satellite_start import known_starts, start_complaints
from satform.scenario.start import coincident_with_followed, singular_references
from satform.scenario.stations import station_complaints

_RESERVED_NAMES = frozenset({"plant", "recorder", "display", "formation", "clock"})


def consistency_complaints(scenario: ScenarioDefinition, *, recorded: bool) -> list[Complaint]:
    """Why a scenario cannot be flown or judged: field and sentence of each fault.

    Args:
        scenario: whose parts are well-formed.
        recorded: it comes from a recorded flight, whose expectations may have no source.
    """
    return [
        *_satellite_complaints(scenario),
        *_equipment_complaints(scenario),
        *navigation_complaints(scenario),
        *_controller_complaints(scenario),
        *_dynamics_complaints(scenario),
        *_graph_complaints(scenario),
        *_following_complaints(scenario),
        *_reference_complaints(scenario),
        *_attitude_complaints(scenario),
        *inertial_point_complaints(
            [scenario.satellite(index) for index in range(len(scenario.satellites))],
            scenario.dynamics,
            scenario.timing.steps,
        ),
        *_environment_complaints(scenario),
        *_expectation_complaints(scenario, recorded=recorded),
        *_link_complaints(scenario),
        *_schedule_complaints(scenario),
        *_fault_complaints(scenario),
        *_reconfiguration_complaints(scenario),
        *scenario.limits.complaints(scenario.orbit.altitude),
        *_station_complaints(scenario),
        *host_complaints(
            scenario.hosts,
            [satellite.name for satellite in scenario.satellites],
            [satellite.name for satellite in scenario.satellites if satellite.external],
        ),
    ]


def _initial_target_complaints(own: str, target: str | None, names: list[str]) -> list[str]:
    if target is None or (target in names and target != own):
        return []
    others = ", ".join(sorted(set(names) - {own})) or "no others"
    return [f"pointing.initial_target: {target} is not another satellite; there are {others}"]


def _satellite_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    complaints: list[Complaint] = []
    seen: set[str] = set()
    for index, satellite in enumerate(scenario.satellites):
        name = satellite.name
        if name in seen:
            sentence = f"another satellite is called {name} too; every name has to be its own"
            complaints.append((("satellites", index, "name"), sentence))
        seen.add(name)
        if name in _RESERVED_NAMES:
            sentence = f"a satellite cannot be called {name}: the name belongs to another node"
            complaints.append((("satellites", index, "name"), sentence))
        for field in ("curve", "controller"):
            if getattr(satellite, field) is None and getattr(scenario.satellite_defaults, field) is None:
                sentence = f"satellite {name} has no {field}: give it one, or give satellite_defaults one"
                complaints.append((("satellites", index), sentence))
    return complaints


def _equipment_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    complaints: list[Complaint] = []
    inherits_all = False
    for index, own in enumerate(scenario.satellites):
        given = own.model_fields_set & {"thruster", "sensor", "filter"}
        if inherits_all and not given:
            # One satellite with nothing of its own is like another.
            continue
        inherits_all = inherits_all or not given
        for field, sentence in scenario.satellite(index).equipment_complaints(scenario.setting):
            path = ("satellites", index, field) if field in given else ("satellite_defaults", field)
            if (path, sentence) not in complaints:
                complaints.append((path, sentence))
    return complaints


def _controller_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    setting = scenario.setting
    complaints: list[Complaint] = []
    tried: set[str] = set()
    for index, own in enumerate(scenario.satellites):
        law = own.controller or scenario.satellite_defaults.controller
        # One satellite with nothing of its own is like another.
        gains = "" if own.controller is None else repr(law)
        if law is None or gains in tried:
            continue
        tried.add(gains)
        try:
            require_protocol(law.build(setting), law)
        except ValueError as error:
            path = ("satellite_defaults",) if own.controller is None else ("satellites", index)
            complaints.append(((*path, "controller"), str(error)))
    return complaints


def _dynamics_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    found = scenario.dynamics.complaints(scenario.dynamics_setting)
    whole: list[Complaint] = [(("dynamics", *field), sentence) for field, sentence in found]
    # Where a satellite starts is asked of a truth model that can be flown.
    shared = scenario.satellite_defaults.model_fields_set
    return whole or start_complaints(scenario.satellites, shared, scenario.start_of)


def _expectation_complaints(scenario: ScenarioDefinition, *, recorded: bool) -> list[Complaint]:
    complaints: list[Complaint] = []
    for index, expectation in enumerate(scenario.expect):
        found = figure_complaints(scenario, expectation)
        if not expectation.has_criterion:
            found.append(((), "give a value with its tolerance, or below, or above"))
        elif not (expectation.origin or recorded):
            sentence = (
                "nothing says where the figure comes from: give a source (paper, theory, another "
                "program), or say regression: true where it is what this software gave"
            )
            found.append(((), sentence))
        complaints += [(("expect", index, *field), sentence) for field, sentence in found]
    return complaints


def _graph_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    try:
        scenario.communication_graph()
    except ValueError as error:
        return [(("graph",), str(error))]
    return []


def _following_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    sends_motion = scenario.consensus.announces == "motion"
    complaints: list[Complaint] = []
    for index, own in enumerate(scenario.satellites):
        law = scenario.satellite(index).controller
        if law is None or (law.follows == "neighbour") == sends_motion:
            continue
        sent = "their motion" if sends_motion else "their arc length"
        sentence = (
            f"satellite {own.name} has a controller that follows a {law.follows}, but satellites send "
            f"each other {sent}; consensus kind motion goes with controllers that follow a neighbour"
        )
        complaints.append((("satellites", index), sentence))
    if complaints or not sends_motion:
        return complaints
    try:
        graph = scenario.communication_graph()
    except ValueError:
        return []
    for index, own in enumerate(scenario.satellites):
        in_degree = len(graph.neighbours(index))
        if in_degree != 1:
            sentence = f"satellite {own.name} has {in_degree} in-neighbours; it needs one, which it follows"
            complaints.append((("graph",), sentence))
    whole = [scenario.satellite(index) for index in range(len(scenario.satellites))]
    if complaints or any(satellite.curve is None for satellite in whole):
        return complaints
    found = coincident_with_followed(whole, graph, known_starts(len(whole), scenario.start_of))
    return [(("satellites", index), text) for index, text in found]


def _reference_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    whole = [scenario.satellite(index) for index in range(len(scenario.satellites))]
    found = singular_references(whole, 2.0 * math.pi / scenario.orbit.rate)
    return [(("satellites", index), sentence) for index, sentence in found]


def _attitude_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    names = [satellite.name for satellite in scenario.satellites]
    graph: Graph | None = None
    complaints: list[Complaint] = []
    for index in range(len(names)):
        spec = scenario.satellite(index).attitude
        if spec is None:
            continue
        found = spec.complaints(scenario.orbit.rate)
        too_many = substep_complaint(scenario.timing.step, spec.maximum_step)
        found += [] if too_many is None else [f"maximum_step: {too_many}"]
        if isinstance(spec.pointing, SatellitePointingSpec):
            graph = graph or _graph_or_none(scenario)
            found += _target_complaints(scenario, index, spec.pointing.target, names, graph)
            found += _initial_target_complaints(names[index], spec.pointing.initial_target, names)
        complaints += [(("satellites", index), f"attitude of {names[index]}: {fault}") for fault in found]
    return complaints


def _environment_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    attitudes = (
        (index, own.name, scenario.satellite(index).attitude) for index, own in enumerate(scenario.satellites)
    )
    pointings = [(index, name, spec.pointing) for index, name, spec in attitudes if spec is not None]
    environment = environment_of(scenario.dynamics)
    if environment is None:
        return []
    return environment_complaints(environment, pointings)


def _station_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    found = station_complaints(scenario.stations)
    if scenario.stations and environment_of(scenario.dynamics) is None:
        kind = getattr(scenario.dynamics, "kind", type(scenario.dynamics).__name__)
        sentence = (
            f"ground stations need a truth model with a date, cw_perturbed or inertial; found {kind}, "
            "which does not know where the Earth's surface is"
        )
        found.append((("stations",), sentence))
    if scenario.publish_orbits and environment_of(scenario.dynamics) is None and scenario.orbit.chief is None:
        sentence = "inertial states need a truth model with a date, cw_perturbed or inertial, or orbit.chief"
        found.append((("publish_orbits",), sentence))
    return found


def _target_complaints(
    scenario: ScenarioDefinition, index: int, target: str, names: list[str], graph: Graph | None
) -> list[str]:
    if target not in names:
        return [f"there is no satellite {target} to point at; there are {', '.join(sorted(names))}"]
    if scenario.consensus.announces != "arc_length":
        return ["pointing at another satellite needs its arc length, and satellites send their motion"]
    if graph is None:
        return []
    if names.index(target) not in graph.neighbours(index):
        return [f"pointing at {target} needs it as an in-neighbour"]
    return []


def _link_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    if scenario.links is None:
        return []
    names = [satellite.name for satellite in scenario.satellites]
    found = scenario.links.complaints(names, scenario.timing.step)
    return [(("links", *path), sentence) for path, sentence in found]


def _schedule_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    graph = _graph_or_none(scenario)
    if graph is None:
        return []
    names = [satellite.name for satellite in scenario.satellites]
    changes, announces = scenario.graph_schedule, scenario.consensus.announces
    return schedule_complaints(changes, graph, names, scenario.timing, announces)


def _fault_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    whole = {own.name: scenario.satellite(index) for index, own in enumerate(scenario.satellites)}
    return fault_complaints(
        scenario.faults, whole, scenario.timing, scenario.consensus.announces, scenario.checkpoint_period
    )


def _reconfiguration_complaints(scenario: ScenarioDefinition) -> list[Complaint]:
    whole = {own.name: scenario.satellite(index) for index, own in enumerate(scenario.satellites)}
    period = 2.0 * math.pi / scenario.orbit.rate
    return reconfiguration_complaints(
        scenario.reconfigurations,
        whole,
        scenario.timing,
        scenario.consensus.announces,
        period,
        scenario.limits.distance,
    )


def _graph_or_none(scenario: ScenarioDefinition) -> Graph | None:
    try:
        return scenario.communication_graph()
    except ValueError:
        return None
