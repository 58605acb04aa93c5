"""What is allowed in a scenario but unwise: gains against disturbances, steps against margins, graphs."""

import numpy as np

from satform.consensus.arc_length import ArcLengthConsensusSpec, delay_margin
from satform.consensus.graph import MAXIMUM_SPECTRUM
from satform.consensus.resilient import ResilientArcLengthConsensusSpec
from satform.consensus.robustness import promise
from satform.control.sliding_mode import SlidingModeSpec, gain_warnings, sampling_warnings
from satform.dynamics.models import PerturbedDynamicsSpec
from satform.dynamics.protocol import DynamicsSetting
from satform.elementwise import Array
from satform.formation import planned, rewirings
from satform.reference import SteadyMotion, steady_motion
from satform.satellite import flight_plan
from satform.scenario import Scenario
from satform_tools.disturbance_advice import disturbance_warnings

_SAME_PERIOD = 1e-9
"""Relative difference of periods up to which satellites can agree for ever."""


def warnings(scenario: Scenario) -> list[str]:
    """Sentences about what is unwise in a scenario; none when all is well."""
    return [
        *_graph_warnings(scenario),
        *_liar_warnings(scenario),
        *_period_warnings(scenario),
        *_delay_warnings(scenario),
        *disturbance_warnings(scenario),
        *_controller_warnings(scenario),
    ]


def margin(scenario: Scenario) -> float | None:
    """Delay in s of all arc-length values that agreement bears; None where it is not known in closed form."""
    graph, law = scenario.communication_graph(), scenario.consensus
    if not isinstance(law, ArcLengthConsensusSpec) or len(graph) > MAXIMUM_SPECTRUM or graph.directed:
        return None
    return delay_margin(np.asarray(graph.eigenvalues), law.tracking_gain, law.coupling_gain, law.rate_gain)


def steady_motions(scenario: Scenario) -> list[SteadyMotion]:
    """Extremes of each satellite's motion once all agree, worked out once for those on the same path."""
    known: dict[tuple[object, ...], SteadyMotion] = {}
    found = []
    for index in range(len(scenario.satellites)):
        spec, plan = scenario.satellite(index), flight_plan(scenario, index)
        rate = float(plan.nominal_rate)
        path = (repr(spec.curve), spec.scale, spec.parameter, spec.feed_forward, rate)
        if path not in known:
            known[path] = steady_motion(plan.path, rate)
        found.append(known[path])
    return found


def _graph_warnings(scenario: Scenario) -> list[str]:
    graph = scenario.communication_graph()
    # Who chooses no links at all does not mean to agree on anything; a graph that changes is looked at later.
    if not graph.edges or graph.connected() or scenario.graph_schedule:
        return []
    return ["graph: it is not connected; satellites that nobody connects never agree on their phase"]


def _liar_warnings(scenario: Scenario) -> list[str]:
    law = scenario.consensus
    if not isinstance(law, ResilientArcLengthConsensusSpec):
        return []
    graphs = [(0, scenario.communication_graph())]
    graphs += [(step, event.graph) for step, event in rewirings(planned(scenario))]
    most_heard = max(int(graph.adjacency.sum(axis=1).max()) for _, graph in graphs)
    found = [
        f"consensus: {doubt}; honest satellites may leave the interval of phases in which they began"
        for doubt in law.doubts(most_heard, scenario.timing.step)
    ]
    said: dict[str, str] = {}
    for step, graph in graphs:
        promised = promise(graph, law.tolerated_liars)
        if not (promised.local or promised.total):
            when = f"from {step * scenario.timing.step:g} s on: " if step else ""
            # A schedule that goes to and fro has each graph many times.
            said.setdefault(promised.sentence, f"consensus.tolerated_liars: {when}{promised.sentence}")
    return [*found, *said.values()]


def _period_warnings(scenario: Scenario) -> list[str]:
    if not scenario.communication_graph().edges:
        return []
    periods = [float(flight_plan(scenario, index).path.period) for index in range(len(scenario.satellites))]
    # A fixed point has no lap: it goes along with any agreement.
    periods = [period for period in periods if period > 0.0]
    if not periods or max(periods) - min(periods) <= _SAME_PERIOD * max(periods):
        return []
    return [
        f"satellites: perimeter divided by scale runs from {min(periods):.10g} to {max(periods):.10g} m; "
        "satellites that agree on the arc length make a lap in the same time only if it is the same for all"
    ]


def _delay_warnings(scenario: Scenario) -> list[str]:
    bound = margin(scenario)
    if bound is None or scenario.timing.step < bound:
        return []
    return [
        f"timing.step: {scenario.timing.step:g} s is not shorter than the delay of {bound:g} s at which "
        "agreement on the phase becomes unstable; use a shorter step or lower consensus gains"
    ]


def _controller_warnings(scenario: Scenario) -> list[str]:
    found: dict[str, list[str]] = {}
    bound, centre = _disturbance(scenario)
    steady = steady_motions(scenario)
    for index, satellite in enumerate(scenario.satellites):
        spec = scenario.satellite(index)
        if not isinstance(spec.controller, SlidingModeSpec):
            continue
        jerk = steady[index].jerk_max
        sentences = gain_warnings(spec.controller, bound[index], centre[index])
        sentences += sampling_warnings(spec.controller, scenario.timing.step, jerk, spec.feed_forward)
        for sentence in sentences:
            found.setdefault(sentence, []).append(satellite.name)
    return [f"controller of {', '.join(names)}: {sentence}" for sentence, names in found.items()]


def _disturbance(scenario: Scenario) -> tuple[Array, Array]:
    """Largest magnitude and centre of what the scenario declares, m/s^2, shapes (N, 3)."""
    count = len(scenario.satellites)
    bound, centre = np.zeros((count, 3)), np.zeros((count, 3))
    if isinstance(scenario.dynamics, PerturbedDynamicsSpec):
        setting = DynamicsSetting(scenario.orbit.rate, scenario.timing.step, count, scenario.seed)
        for perturbation in scenario.dynamics.build_perturbations(setting):
            bound = bound + perturbation.bound()
            centre = centre + perturbation.centre()
    return bound, centre
