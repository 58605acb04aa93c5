# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A scenario as the data that `show` prints: graph, gains, modal roots, processes, topics, expectations."""

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from satform.communication.topic_table import channels
from satform.consensus.arc_length import ArcLengthConsensusSpec, modal_roots
from satform.consensus.byzantine_robustness import (
    MAXIMUM_SATELLITES,
    agreement_guarantee,
    lower_bound,
    robustness,
)
from satform.consensus.graph import MAXIMUM_SPECTRUM, Graph
from satform.evaluation.sampled_loops import sampled_loops
from satform.flight.compile import compile_scenario, external_satellites, topic_plan
from satform.flight.compile_satellite import flight_plan
from satform.numeric.elementwise import Array
from satform.orbits.path_reference import SteadyMotion
from satform.scenario import Scenario
from satform.scenario.loader import SCENARIO_FILE
from satform.scenario.navigation_checks import sensor_channels
from satform_bringup import BAG_FOLDER
from satform_tools.check import warnings
from satform_tools.check.consensus import margin
from satform_tools.check.controllers import declared_disturbance
from satform_tools.check.disturbances import describe_schedule
from satform_tools.check.reference_motion import steady_motions
from satform_tools.describe import orbit as describe_orbit
from satform_tools.describe.feedback import attitude_of, desired_at_start, feedback_of, start_of
from satform_tools.describe.lyapunov import lyapunov_of

ALLOWED = {"value", "relative", "absolute", "below", "above"}
"""Fields of an expectation that give the allowed range."""


def describe(scenario: Scenario) -> dict[str, Any]:
    """Everything that `show` prints, as data."""
    graph = scenario.communication_graph()
    names = [satellite.name for satellite in scenario.satellites]
    return {
        "name": scenario.name,
        "title": scenario.title,
        "text": scenario.text,
        "sources": [source.model_dump() for source in scenario.sources],
        "digest": scenario.digest(),
        "seed": scenario.seed,
        "orbit": describe_orbit.orbit(scenario),
        "timing": {**scenario.timing.model_dump(), "steps": scenario.timing.steps},
        "dynamics": scenario.dynamics.model_dump(mode="json"),
        "graph": {
            "kind": getattr(scenario.graph, "kind", ""),
            "in_neighbours": {name: [names[j] for j in graph.neighbours(i)] for i, name in enumerate(names)},
            "directed": graph.directed,
            "connected": graph.connected(),
            "eigenvalues": [_complex(value) for value in graph.eigenvalues] if _small(graph) else [],
            "robustness": _robustness(graph),
            "promise": asdict(
                agreement_guarantee(graph, getattr(scenario.consensus, "tolerated_byzantine", 0))
            ),
        },
        "consensus": {
            **scenario.consensus.model_dump(mode="json"),
            "modal_roots": _roots(scenario),
            **_delay_margin(scenario),
        },
        "sampled_loops": [asdict(loop) for loop in sampled_loops(scenario)],
        "links": _links(scenario),
        "schedule": [asdict(state) for state in describe_schedule(scenario)],
        "faults": [fault.model_dump(exclude_none=True) for fault in scenario.faults],
        "checkpoint_period": scenario.checkpoint_period,
        "tolerated_losses": scenario.tolerated_losses,
        "satellites": _satellites(scenario),
        "integration_error": describe_orbit.integration(scenario),
        "cw_errors": describe_orbit.cw_errors(scenario),
        "processes": _processes(scenario),
        "topics": _topics(scenario),
        "expectations": [
            {
                "label": expectation.describe(),
                "unit": expectation.unit,
                **expectation.model_dump(mode="json", include=ALLOWED, exclude_none=True),
                "source": expectation.source,
                "regression": expectation.regression,
            }
            for expectation in scenario.expect
        ],
        "warnings": warnings(scenario),
    }


def _complex(value: Any) -> float | list[float]:
    number = complex(value)
    return [number.real, number.imag] if number.imag else number.real


def _small(graph: Graph) -> bool:
    return len(graph) <= MAXIMUM_SPECTRUM


def _robustness(graph: Graph) -> dict[str, Any]:
    """The largest r, exact or a lower bound, and the largest s of each r, empty where it is not known."""
    if len(graph) > MAXIMUM_SATELLITES:
        return {"r": lower_bound(graph), "s": [], "exact": False}
    return {**asdict(robustness(graph)), "exact": True}


def _roots(scenario: Scenario) -> list[list[float | list[float]]]:
    law = scenario.consensus
    graph = scenario.communication_graph()
    if not isinstance(law, ArcLengthConsensusSpec) or not _small(graph):
        return []
    eigenvalues = graph.eigenvalues
    roots = modal_roots(eigenvalues, law.tracking_gain, law.coupling_gain, law.rate_gain)
    return [[_complex(root) for root in pair] for pair in roots]


def _delay_margin(scenario: Scenario) -> dict[str, Any]:
    """Delay margin in s; None where it is infinite or unknown."""
    bound = margin(scenario)
    endless = bound == math.inf
    return {"delay_margin": None if endless else bound, "stable_for_any_delay": endless}


def _links(scenario: Scenario) -> dict[str, Any] | None:
    """The links, those of their own with what they take from the default; None where there are none."""
    links = scenario.links
    if links is None:
        return None
    return {
        "default": links.default.model_dump(),
        "edges": [
            {
                "sender": edge.sender,
                "receiver": edge.receiver,
                **links.of(edge.sender, edge.receiver).model_dump(),
            }
            for edge in links.edges
        ],
    }


def _satellites(scenario: Scenario) -> list[dict[str, Any]]:
    bound, centre = declared_disturbance(scenario)
    known: dict[str, dict[str, Any]] = {}
    return [
        _satellite(scenario, index, steady, (bound[index], centre[index]), known)
        for index, steady in enumerate(steady_motions(scenario))
    ]


def _satellite(
    scenario: Scenario,
    index: int,
    steady: SteadyMotion,
    disturbance: tuple[Array, Array],
    known: dict[str, dict[str, Any]],
) -> dict[str, Any]:
    """One satellite; `known` has the feedback of those before it, for those with the same."""
    spec, plan = scenario.satellite(index), flight_plan(scenario, index)
    same = repr((spec.controller, spec.sensor, spec.filter, spec.thruster))
    if same not in known:
        known[same] = feedback_of(scenario, index, plan)
    assert spec.curve is not None  # noqa: S101 - the scenario's validator has seen to both
    assert spec.controller is not None  # noqa: S101
    return {
        "name": spec.name,
        "external": spec.external,
        "curve": spec.curve.model_dump(mode="json", exclude_none=True),
        "parameter": spec.path_parameter,
        "scale": spec.scale,
        "perimeter": float(plan.path.curve.perimeter),
        "nominal_rate": float(plan.nominal_rate),
        "largest_reference_acceleration": steady.acceleration_max,
        "largest_reference_jerk": steady.jerk_max,
        "controller": spec.controller.model_dump(mode="json"),
        "feedback": known[same],
        "sliding": start_of(plan, disturbance),
        "lyapunov": lyapunov_of(scenario, index, plan, desired_at_start(plan)),
        "attitude": attitude_of(scenario, index, plan),
        "readings": _readings(scenario, index),
        "navigation": None if spec.navigation is None else spec.navigation.model_dump(mode="json"),
    }


def _readings(scenario: Scenario, index: int) -> list[dict[str, Any]]:
    """The channels of a satellite's sensors in the order of its readings, with the columns of each."""
    found: list[dict[str, Any]] = []
    first, step = 0, scenario.timing.step
    for channel in sensor_channels(scenario, index):
        timing = channel.timing
        found.append(
            {
                "channel": channel.name,
                "first": first,
                "numbers": channel.width,
                "period": timing.period * step,
                "latency": timing.latency * step,
            }
        )
        first += channel.width
    return found


def _processes(scenario: Scenario) -> list[dict[str, Any]]:
    from satform_bringup.deployment.node_processes import processes  # noqa: PLC0415 - only `show` needs it

    listed = processes(compile_scenario(scenario), Path(SCENARIO_FILE), Path(BAG_FOLDER))
    started = [{"node": process.name, "executable": process.executable} for process in listed]
    return [*started, *({"node": name, "executable": "external"} for name in external_satellites(scenario))]


def _topics(scenario: Scenario) -> list[dict[str, Any]]:
    """Name, publisher and subscribers of each topic, without the recorder, which subscribes to all."""
    return [
        {
            "topic": channel.topic,
            "from": "each" if channel.kind == "node_ready" else channel.publishers[0],
            "to": list(channel.subscribers_in(recorded=False)),
        }
        for channel in channels(topic_plan(scenario))
        if channel.kind not in ("recorder_progress", "diagnostics")
    ]
