# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every loop of a scenario that is closed once a step, with the factor by which it shrinks errors."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from satform.attitude.mrp_tracking import attitude_transition
from satform.consensus.arc_length import ArcLengthGainsSpec
from satform.consensus.graph import MAXIMUM_SPECTRUM, Graph
from satform.consensus.stability import Gains, sampled_modes
from satform.control.protocol import FlightSetting
from satform.control.sampled_stability import LoopKind, SampledLoop, closed_loop, spectral_radius
from satform.flight.compile_satellite import flight_setting
from satform.membership.formation import topology_changes
from satform.navigation.relative_state_filter import estimation_transition
from satform.numeric.elementwise import Array
from satform.scenario import SatelliteSpec, Scenario

Analysis = tuple[float | None, str]


def sampled_loops(scenario: Scenario) -> list[SampledLoop]:
    """The loops of a scenario: of each tracking law, of agreement, of each attitude law and filter.

    Args:
        scenario: that is to be flown.

    Returns:
        One entry for all satellites with the same numbers.
    """
    specs = [scenario.satellite(index) for index in range(len(scenario.satellites))]
    indices = {spec.name: index for index, spec in enumerate(specs)}
    return [
        *_alike(
            "tracking",
            specs,
            lambda spec: _tracking(scenario, spec, flight_setting(scenario, indices[spec.name])),
            lambda spec: repr((spec.controller, spec.sensor, spec.filter, spec.thruster)),
        ),
        *_consensus(scenario, [spec.name for spec in specs]),
        *_alike(
            "attitude",
            [spec for spec in specs if spec.attitude is not None],
            lambda spec: _attitude(scenario, spec),
            lambda spec: repr(spec.attitude and spec.attitude.controller),
        ),
        *_alike(
            "estimation",
            [spec for spec in specs if spec.filter is not None],
            lambda spec: _estimation(scenario, spec),
            lambda spec: repr((spec.filter, spec.sensor)),
        ),
    ]


def _alike(
    kind: LoopKind,
    specs: Iterable[SatelliteSpec],
    analysis: Callable[[SatelliteSpec], Analysis],
    key: Callable[[SatelliteSpec], str],
) -> list[SampledLoop]:
    """One entry for all satellites with the same key."""
    found: dict[str, tuple[list[str], Analysis]] = {}
    for spec in specs:
        same = key(spec)
        if same not in found:
            found[same] = ([], _analysed(analysis, spec))
        found[same][0].append(spec.name)
    return [SampledLoop(kind, tuple(names), *analysed) for names, analysed in found.values()]


def _analysed(analysis: Callable[[SatelliteSpec], Analysis], spec: SatelliteSpec) -> Analysis:
    """An analysis, of numbers that may be of any size."""
    with np.errstate(all="ignore"):
        try:
            return analysis(spec)
        except np.linalg.LinAlgError as error:
            return None, f"a loop whose eigenvalues were not found: {error}"


def _tracking(scenario: Scenario, spec: SatelliteSpec, setting: FlightSetting) -> Analysis:
    assert spec.controller is not None  # noqa: S101 - the scenario's validator has seen to it
    kind = str(getattr(spec.controller, "kind", type(spec.controller).__name__))
    own_transition = spec.controller.linearisation(setting)
    if isinstance(own_transition, str):
        return None, f"{kind}, {own_transition}"
    if own_transition is not None:
        return spectral_radius(own_transition), kind
    if spec.controller.follows == "neighbour":
        return None, f"{kind}, which gives no linearisation"
    law: Any = spec.controller.build(setting)
    update, latency, words = _measured(scenario, spec)
    transition = closed_loop(law, setting, update, latency)
    if transition is None:
        return None, f"{kind}, which is not linear close to its reference"
    return spectral_radius(_changing(transition), update), f"{kind}{words}"


def _changing(transition: Array) -> Array:
    """A transition without what never changes, as the integral of an axis that has no integral gain."""
    fixed = np.all(transition == np.eye(len(transition)), axis=1)
    free: Array = transition[np.ix_(~fixed, ~fixed)]
    return free


def _measured(scenario: Scenario, spec: SatelliteSpec) -> tuple[int, int, str]:
    """Steps between measurements and on their way, as the law feels them, and what is said of them."""
    if spec.sensor is None or spec.filter is not None:
        # A filter carries late measurements to now with the commands since: the loop feels none of it.
        return 1, 0, ""
    sensor = spec.sensor.build(scenario.timing.step)
    if sensor.update == 1 and sensor.latency == 0:
        return 1, 0, ""
    return sensor.update, sensor.latency, " on measurements that are rare or late"


def _consensus(scenario: Scenario, names: list[str]) -> list[SampledLoop]:
    law = scenario.consensus
    if not isinstance(law, ArcLengthGainsSpec):
        return []
    if law.arc_length_source == "projected":
        words = f"{law.kind} on projected arc lengths, whose loop leads through the motion of the satellites"
        return [SampledLoop("consensus", tuple(names), None, words)]
    gains = Gains(law.tracking_gain, law.coupling_gain, law.rate_gain)
    if len(names) > MAXIMUM_SPECTRUM:
        return [SampledLoop("consensus", tuple(names), None, f"{law.kind} of so many satellites")]
    graphs: list[Graph] = [scenario.communication_graph()]
    graphs += [event.graph for _, event in topology_changes(scenario.membership_plan().events)]
    with np.errstate(all="ignore"):
        radius = max(
            float(sampled_modes(graph.eigenvalues, gains, scenario.timing.step).max()) for graph in graphs
        )
    return [SampledLoop("consensus", tuple(names), radius, f"{law.kind}, slowest mode of the graph")]


def _attitude(scenario: Scenario, spec: SatelliteSpec) -> Analysis:
    assert spec.attitude is not None  # noqa: S101 - asked for those with attitude only
    law = spec.attitude.controller.build()
    radius = spectral_radius(attitude_transition(law, scenario.timing.step))
    return radius, f"{spec.attitude.controller.kind} on its reference"


def _estimation(scenario: Scenario, spec: SatelliteSpec) -> Analysis:
    assert spec.filter is not None  # noqa: S101 - asked for those with a filter only
    assert spec.sensor is not None  # noqa: S101 - the scenario's validator has seen to it
    estimator = spec.filter.build(scenario.orbit.rate, scenario.timing.step, spec.sensor, scenario.chief)
    try:
        return spectral_radius(estimation_transition(estimator), estimator.update), "Kalman filter"
    except ValueError as error:
        return None, f"Kalman filter: {error}"
