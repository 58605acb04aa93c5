# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Borders of stability of a scenario by theory: the value of a field at which a loop stops to decay."""

import math
from collections.abc import Callable

from satform.consensus.arc_length import ArcLengthConsensusSpec
from satform.consensus.lossy_links import LossyConsensus
from satform.consensus.stability import Gains
from satform.control.sampled_stability import LoopKind, border_between
from satform.evaluation.sampled_loops import sampled_loops
from satform.scenario import Scenario


def loop_radius(scenario: Scenario, loop: LoopKind | None = None) -> float:
    """The largest spectral radius of the sampled loops of a scenario.

    Args:
        scenario: validated.
        loop: kind of the loops that are meant; all when left out.

    Returns:
        Below 1 where all of them decay; NaN where none is analysed.
    """
    radii = [
        found.radius
        for found in sampled_loops(scenario)
        if found.radius is not None and loop in (None, found.kind)
    ]
    return max(radii, default=math.nan)


def stability_border(
    scenario: Scenario, path: str, low: float, high: float, loop: LoopKind | None = None
) -> float | None:
    """The value of a field at which the sampled loops of a scenario pass from stable to unstable, or back.

    Args:
        scenario: validated.
        path: of the field, as `Scenario.with_` takes it, such as
            `satellites[*].controller.reaching_gain`.
        low: a value of the field.
        high: a larger one.
        loop: kind of the loops that are meant; all when left out.

    Returns:
        Between `low` and `high`, in the unit of the field; None where the loops are stable at both, or at
        neither.

    Raises:
        ScenarioError: with such a value the scenario cannot fly.
    """
    return crossing(lambda value: loop_radius(scenario.with_({path: value}), loop), low, high)


def crossing(radius: Callable[[float], float], low: float, high: float) -> float | None:
    """Where a spectral radius passes 1, by bisection.

    Args:
        radius: as a function of a parameter.
        low: a value of it.
        high: a larger one.

    Returns:
        The parameter; None where the radius is below 1 at both ends, or at neither.
    """
    if (radius(low) < 1.0) == (radius(high) < 1.0):
        return None
    low, high = border_between(lambda value: radius(value) < 1.0, low, high)
    return 0.5 * (low + high)


def lossy_consensus(scenario: Scenario) -> LossyConsensus:
    """The consensus of a scenario over links that lose messages.

    Args:
        scenario: with the linear consensus on arc lengths. Loss and period of its default link count; delays,
            outages and timeouts do not.

    Raises:
        ValueError: the satellites follow another law, or the formation is too large.
    """
    law = scenario.consensus
    if not isinstance(law, ArcLengthConsensusSpec) or law.arc_length_source == "projected":
        raise ValueError("mean-square convergence is worked out for the linear consensus on reference phases")
    step = scenario.timing.step
    period = 0.0 if scenario.links is None else scenario.links.default.period
    return LossyConsensus.of(
        scenario.communication_graph(),
        Gains(law.tracking_gain, law.coupling_gain, law.rate_gain),
        step,
        max(1, round(period / step)),
        law.neighbour_values,
    )
