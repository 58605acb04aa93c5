# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about sampled loops that are not stable at the control period."""

from satform.common.name_list import listed
from satform.control.sampled_stability import SampledLoop
from satform.evaluation.sampled_loops import sampled_loops
from satform.scenario import Scenario

_MAX_SATELLITES = 6
"""Satellites that a warning names at most."""

_ROUNDING = 1e-9
"""By how much a radius of one may come out smaller."""

_WHAT = {
    "tracking": ("controller of {names}", "shorten the step, lower the gains or widen the boundary layer"),
    "consensus": ("consensus", "shorten the step or lower the consensus gains"),
    "attitude": ("attitude of {names}", "shorten the step or lower the attitude gains"),
    "estimation": ("filter of {names}", "measure more often"),
}


def sampling_warnings(scenario: Scenario) -> list[str]:
    """Sentences about loops whose spectral radius is not below 1."""
    return [
        _sentence(loop, scenario.timing.step)
        for loop in sampled_loops(scenario)
        if loop.radius is not None and loop.radius >= 1.0 - _ROUNDING
    ]


def _sentence(loop: SampledLoop, step: float) -> str:
    where, remedy = _WHAT[loop.kind]
    names = listed(loop.satellites, _MAX_SATELLITES)
    return (
        f"{where.format(names=names)}: with a control period of {step:g} s, {loop.words} multiplies "
        f"errors by {loop.radius:.6g} in a step (has to be below 1); {remedy}"
    )
