# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warnings about models of relative motion far from two-body motion: wide formations, eccentric chiefs."""

import math
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from satform.common.spec import specs
from satform.control.protocol import ControllerSpec
from satform.dynamics.cw_error import cw_error, eccentric_error, free_motion
from satform.dynamics.formula_model import FormulaDynamicsSpec
from satform.dynamics.j2_element_model import LOWEST_INCLINATION, J2ElementModel
from satform.dynamics.truth_models import CwDynamicsSpec, CwPerturbedDynamicsSpec, LinearJ2DynamicsSpec
from satform.dynamics.velocity_dependent import VelocityDependentDynamicsSpec
from satform.dynamics.yamanaka_ankersen import YamanakaAnkersenModel
from satform.flight.compile_satellite import flight_plan
from satform.orbits.chief import KeplerianChief
from satform.scenario import Scenario

_NOTEWORTHY = 0.01
"""Error in one revolution, relative to the distance from the chief, from which on `check` warns."""

MOST_LOOKED_AT = 8
"""Satellites for which the effect of J2 is computed: the first of those that are meant."""

_ECCENTRIC = "yamanaka_ankersen"
"""The model of relative motion about a chief of any eccentricity."""

_SAMPLES = 12
"""Times of a revolution at which the effect of J2 is looked at."""


@dataclass(frozen=True)
class ExpectedError:
    """What models of relative motion are expected to err by for one satellite without control.

    Attributes:
        name: of the satellite.
        distance: from the chief, where its planned motion begins, m.
        error: of CW, largest within one revolution of the chief, m; infinite where it is on no ellipse.
        eccentric_error: likewise of Yamanaka and Ankersen's model, which knows the eccentricity.
        start: position and velocity at which the motion begins, LVLH, m and m/s.
    """

    name: str
    distance: float
    error: float
    eccentric_error: float
    start: tuple[float, ...] = ()

    def fitting_model(self, oblateness: float = 0.0) -> str | None:
        """Simplest model whose error is small: cw, yamanaka_ankersen or j2_elements; None where none is.

        Args:
            oblateness: what J2 adds to the error of the first two, m.
        """
        small = max(1e-3, _NOTEWORTHY * self.distance)
        errors = {
            "cw": self.error + oblateness,
            "yamanaka_ankersen": self.eccentric_error + oblateness,
            "j2_elements": self.eccentric_error,
        }
        return next((name for name, error in errors.items() if error <= small), None)


def expected_errors(scenario: Scenario) -> list[ExpectedError]:
    """Expected error of each model for each satellite; empty where the truth is about no orbit.

    Each begins where its plan begins, at the planned velocity where that is free motion and else on the
    closed ellipse through that position.
    """
    if _gravity(scenario) == "none":
        return []
    chief = chief_orbit(scenario)
    known: dict[bytes, tuple[float, float]] = {}
    found = []
    for index, satellite in enumerate(scenario.satellites):
        spec, start = scenario.satellite(index), flight_plan(scenario, index).start
        position = start.position - np.asarray(spec.position_error)
        planned = start.velocity - np.asarray(spec.velocity_error)
        velocity = free_motion(position, planned, chief.mean_motion)
        key = position.tobytes() + velocity.tobytes()
        if key not in known:
            period = math.tau / chief.mean_motion
            of_cw = of_eccentric = cw_error(position, velocity, chief, period)
            if chief.eccentricity > 0.0:
                of_eccentric = eccentric_error(position, velocity, chief, period)
            known[key] = (of_cw, of_eccentric)
        began = (*position.tolist(), *velocity.tolist())
        found.append(ExpectedError(satellite.name, float(np.linalg.norm(position)), *known[key], began))
    return found


def oblateness_effect(scenario: Scenario, entry: ExpectedError) -> float:
    """What J2 changes in the free motion of a satellite in one revolution of the chief, m.

    Args:
        scenario: in which it flies.
        entry: of the satellite.

    Returns:
        Largest distance between the models j2_elements and yamanaka_ankersen; 0 where the truth has no J2 or
        the chief's orbit lies in the equator.
    """
    chief, truth = scenario.chief, scenario.dynamics
    gravity = getattr(truth, "gravity", None)
    has_oblateness = isinstance(truth, LinearJ2DynamicsSpec) or getattr(gravity, "degree", 0) >= 2
    if chief is None or not has_oblateness or math.sin(chief.inclination) < LOWEST_INCLINATION:
        return 0.0
    times = np.linspace(0.0, chief.period, 1 + _SAMPLES)[1:]
    start, zero = np.array(entry.start), np.zeros_like(times)
    apart = J2ElementModel(chief).transition(zero, times) - YamanakaAnkersenModel(chief).transition(
        zero, times
    )
    return float(np.max(np.linalg.norm((apart @ start)[:, :3], axis=-1)))


def chief_orbit(scenario: Scenario) -> KeplerianChief:
    """The chief's two-body orbit; circular where the truth model knows no other."""
    given = scenario.orbit.chief
    chief = scenario.chief if given is None else given.orbit.keplerian(scenario.orbit.rate)
    return KeplerianChief.from_mean_motion(scenario.orbit.rate) if chief is None else chief


def linearisation_warnings(scenario: Scenario) -> list[str]:
    """Sentences about satellites for which the model in use errs by much of their distance from the chief."""
    entries = expected_errors(scenario)
    if chief_orbit(scenario).eccentricity > 0.0:
        if _linear(scenario):
            return _circular_truth_warnings(scenario, entries)
        return [*_circular_model_warnings(scenario, entries), *_eccentric_model_warnings(scenario, entries)]
    far = [entry for entry in entries if entry.fitting_model() != "cw"]
    if not far or not _linear(scenario):
        return []
    kind = getattr(scenario.dynamics, "kind", "")
    return [
        f"dynamics: {kind} is of first order in the distance; its motion of {_worst(far, circular=True)}; "
        "cw_perturbed and inertial contain the higher orders"
    ]


def _circular_truth_warnings(scenario: Scenario, entries: list[ExpectedError]) -> list[str]:
    """A truth about a circle where `orbit.chief` is an ellipse: what its motion and its starts err by."""
    far = [entry for entry in entries if entry.fitting_model() != "cw"]
    if not far:
        return []
    kind, eccentricity = getattr(scenario.dynamics, "kind", ""), chief_orbit(scenario).eccentricity
    starts = any(satellite.start is not None for satellite in scenario.satellites)
    taken = f", a start up to {2.0 * eccentricity:.2g} of the distance" if starts else ""
    return [
        f"dynamics: {kind} is about a circular chief orbit, and that of orbit.chief has an eccentricity of "
        f"{eccentricity:.3g}; its motion of {_worst(far, circular=True)}{taken}; cw_perturbed and inertial "
        "know the eccentricity"
    ]


def _circular_model_warnings(scenario: Scenario, entries: list[ExpectedError]) -> list[str]:
    """Laws and filters whose model is about a circular chief, where the chief's orbit is eccentric."""
    far = [
        entry
        for index, entry in enumerate(entries)
        if entry.fitting_model() != "cw" and _circular_users(scenario, index)
    ]
    if not far:
        return []
    users = sorted({user for index in range(len(entries)) for user in _circular_users(scenario, index)})
    fitting = {entry.fitting_model() for entry in far}
    if fitting == {"yamanaka_ankersen"}:
        best = max(entry.eccentric_error for entry in far)
        advice = (
            f"the model {_ECCENTRIC}, of {', '.join(eccentric_laws())}, of filters, and of the burns of plan "
            f"approach --model {_ECCENTRIC} for timed_burns, errs by up to {best:.3g} m"
        )
        oblate = max(oblateness_effect(scenario, entry) for entry in far[:MOST_LOOKED_AT])
        advice += f", and by {oblate:.3g} m more by J2" if oblate > 0.0 else ""
    else:
        advice = "no linear model fits at this distance"
    field = "dynamics.chief.eccentricity" if scenario.orbit.chief is None else "orbit.chief"
    return [
        f"{field}: the CW equations about a circular chief orbit are the model of "
        f"{' and '.join(users)}; with this eccentricity of {chief_orbit(scenario).eccentricity:g} the CW "
        f"motion of {_worst(far, circular=True)}; {advice}"
    ]


def _eccentric_model_warnings(scenario: Scenario, entries: list[ExpectedError]) -> list[str]:
    """Laws and filters that know the eccentricity, too far from the chief for a model of first order."""
    far = [
        entry
        for index, entry in enumerate(entries)
        if entry.fitting_model() is None and not _circular_users(scenario, index)
        if scenario.satellite(index).filter is not None
        or getattr(scenario.satellite(index).controller, "model", "") == _ECCENTRIC
    ]
    if not far:
        return []
    return [
        "satellites: the model yamanaka_ankersen is of first order in the distance; its motion of "
        f"{_worst(far, circular=False)}; fly closer to the chief or with less drift"
    ]


def eccentric_laws() -> list[str]:
    """The control laws, also of other packages, that know an eccentric chief by yamanaka_ankersen.

    Returns:
        "controller kind NAME", with the model where it is not the default.
    """
    found = []
    for kind, spec in sorted(specs("satform.controllers").items()):
        field = spec.model_fields.get("model")
        if field is None or _ECCENTRIC not in get_args(field.annotation):
            continue
        # The law within an observer may take the chief for circular whatever the observer's model is.
        if issubclass(spec, ControllerSpec):
            values: dict[str, Any] = {"model": _ECCENTRIC}
            if spec.model_construct(None, **values).assumes_circular_chief():
                continue
        chosen = "" if field.default == _ECCENTRIC else f" with model: {_ECCENTRIC}"
        found.append(f"controller kind {kind}{chosen}")
    return found


def _circular_users(scenario: Scenario, index: int) -> list[str]:
    """What of a satellite has a model about a circular chief: kind of its law, and its filter."""
    spec = scenario.satellite(index)
    users = []
    if spec.controller is not None and spec.controller.assumes_circular_chief():
        users.append(f"controller kind {getattr(spec.controller, 'kind', '')}")
    if spec.filter is not None and spec.filter.model == "cw":
        users.append("the filter")
    return users


def _worst(far: list[ExpectedError], *, circular: bool) -> str:
    """The satellite with the largest error for its distance, in words."""

    def error(entry: ExpectedError) -> float:
        return entry.error if circular else entry.eccentric_error

    worst = max(far, key=lambda entry: error(entry) / max(entry.distance, 1.0))
    finite = math.isfinite(error(worst))
    size = f"{error(worst):.3g} m in one revolution" if finite else "more than any bound"
    more = f" ({len(far) - 1} more likewise)" if len(far) > 1 else ""
    return (
        f"{worst.name}, {worst.distance:.6g} m from the chief, has, without control, an error of up to "
        f"{size}{more}"
    )


def _linear(scenario: Scenario) -> bool:
    """Whether the truth itself is linear in the distance."""
    truth = scenario.dynamics
    ideal = isinstance(truth, CwPerturbedDynamicsSpec) and truth.chief_motion == "circular"
    return ideal or isinstance(truth, CwDynamicsSpec | LinearJ2DynamicsSpec) or _gravity(scenario) == "cw"


def _gravity(scenario: Scenario) -> str | None:
    """The gravity of a truth model that is about no orbit but with it; None for the others."""
    truth = scenario.dynamics
    if not isinstance(truth, VelocityDependentDynamicsSpec | FormulaDynamicsSpec):
        return None
    return truth.gravity
