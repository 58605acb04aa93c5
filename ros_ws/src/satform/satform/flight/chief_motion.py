# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The chief's motion in a flight, computed once more from the scenario: no command acts on a chief."""

import json
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from satform.flight.orbit_states import epoch_of, unperturbed_chief
from satform.flight.truth import truth_model
from satform.numeric.elementwise import Array
from satform.orbits.inertial_motion import ChiefMotion, unperturbed
from satform.orbits.turning_axes import AxesByStep, AxesName, axes_by_step
from satform.scenario.model import Scenario


def chief_motion(scenario: Scenario, steps: int) -> ChiefMotion | None:
    """The chief of a flight in inertial space, bitwise as the truth model has it.

    Args:
        scenario: that is flown.
        steps: K, up to which it is computed.

    Returns:
        None where the scenario has no epoch or does not say in which plane the chief moves. Where the truth
        model does not propagate a chief, the unperturbed orbit of time zero.
    """
    epoch = epoch_of(scenario)
    if epoch is None:
        return None
    frames = truth_model(scenario).chief_frames(steps)
    if frames is not None:
        return ChiefMotion(epoch, frames)
    chief = unperturbed_chief(scenario)
    if chief is None:
        return None
    times: Array = np.arange(steps + 1, dtype=np.float64) * scenario.timing.step
    return ChiefMotion(epoch, unperturbed(chief, times), nominal=True)


def turning_axes(scenario: Scenario, name: AxesName) -> AxesByStep:
    """Inertial axes, or axes that point at the Sun, as the LVLH axes of a flight have them.

    Flight software takes them as known: star trackers measure its attitude and an ephemeris has the chief.

    Args:
        scenario: that is flown.
        name: of the axes.

    Raises:
        ValueError: the truth model does not say where the chief is.
    """
    chief = scenario.orbit.chief
    orbit = [scenario.orbit.rate, None if chief is None else chief.model_dump(mode="json")]
    # The truth model is built with the number of satellites and the seed, too.
    built = [scenario.timing.step, scenario.timing.steps, len(scenario.satellites), scenario.seed]
    text = json.dumps([orbit, scenario.dynamics.model_dump(mode="json"), built])
    return _axes(_Asked(name, text, scenario))


@dataclass(frozen=True)
class _Asked:
    """What is asked for, which is the same for scenarios that do not differ in the chief's motion."""

    name: AxesName
    text: str
    scenario: Scenario = field(compare=False)


@lru_cache(maxsize=4)
def _axes(asked: _Asked) -> AxesByStep:
    timing = asked.scenario.timing
    chief = chief_motion(asked.scenario, timing.steps)
    if chief is None:
        raise ValueError("the truth model does not say where the chief is, so that only LVLH axes are known")
    return axes_by_step(asked.name, chief, timing.step)
