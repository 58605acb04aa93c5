# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Describes the chief's orbit and the errors of the CW equations about it, for `show`."""

import math
from dataclasses import asdict
from itertools import zip_longest
from typing import Any

from satform.orbits.earth import EQUATORIAL_RADIUS
from satform.scenario import Scenario
from satform_tools import console
from satform_tools.check.integration import expected_integration_error
from satform_tools.check.linearisation import (
    MOST_LOOKED_AT,
    chief_orbit,
    expected_errors,
    oblateness_effect,
)


def orbit(scenario: Scenario) -> dict[str, float]:
    """Period in s, mean motion in rad/s, radius and altitudes in m; perigee and apogee of an ellipse."""
    circle = {
        "period": math.tau / scenario.orbit.rate,
        "mean_motion": scenario.orbit.rate,
        "radius": scenario.orbit.radius,
        "altitude": scenario.orbit.altitude,
    }
    chief = chief_orbit(scenario)
    if chief.eccentricity == 0.0:
        return circle
    axis, eccentricity = chief.semi_major_axis, chief.eccentricity
    return circle | {
        "eccentricity": eccentricity,
        "perigee_altitude": axis * (1.0 - eccentricity) - EQUATORIAL_RADIUS,
        "apogee_altitude": axis * (1.0 + eccentricity) - EQUATORIAL_RADIUS,
    }


def cw_errors(scenario: Scenario) -> list[dict[str, Any]]:
    """Distance from the chief and expected error of models in one revolution, m; None beyond any bound.

    `error` is that of CW, `eccentric_error` that of Yamanaka and Ankersen's model, both against two-body
    motion; `oblateness` is what J2 adds to them, None for satellites that are not looked at; `fitting_model`
    is the simplest model whose error is small, or None.
    """
    entries = expected_errors(scenario)
    added = [oblateness_effect(scenario, entry) for entry in entries[:MOST_LOOKED_AT]]
    return [
        {
            "satellite": entry.name,
            "distance": entry.distance,
            "error": entry.error if math.isfinite(entry.error) else None,
            "eccentric_error": entry.eccentric_error if math.isfinite(entry.eccentric_error) else None,
            "oblateness": oblate,
            "fitting_model": entry.fitting_model(oblate or 0.0),
        }
        for entry, oblate in zip_longest(entries, added)
    ]


def integration(scenario: Scenario) -> dict[str, float] | None:
    """Expected error of the integrator in one revolution, m; None where nothing is integrated."""
    found = expected_integration_error(scenario)
    return None if found is None else asdict(found)


def print_integration(data: dict[str, float] | None) -> None:
    """Print what `integration` has found."""
    if data is not None:
        console.line(
            f"integrator: has an error of up to {data['inertial']:.2g} m in one revolution, "
            f"{data['relative']:.2g} m between satellite and chief"
        )


def print_orbit(data: dict[str, float]) -> None:
    """Print what `orbit` has found."""
    if "eccentricity" in data:
        where = (
            f"eccentricity {data['eccentricity']:g}, altitude {data['perigee_altitude'] / 1e3:.1f} km at "
            f"perigee and {data['apogee_altitude'] / 1e3:.1f} km at apogee"
        )
    else:
        where = f"altitude {data['altitude'] / 1e3:.1f} km"
    console.line(
        f"chief: period {data['period']:.7g} s, mean motion {data['mean_motion']:.7g} rad/s, {where}"
    )


def print_cw_errors(errors: list[dict[str, Any]]) -> None:
    """Print the largest of what `cw_errors` has found; satellites in the chief's place are left out."""
    found = [entry for entry in errors if entry["distance"] > 0.0]
    if not found:
        return
    worst = max(found, key=lambda entry: _or_infinite(entry["error"]))
    console.line(
        f"CW against two-body motion, without control: {worst['satellite']}, {worst['distance']:.6g} m from "
        f"the chief, errs by {_size(worst['error'])} in one revolution"
    )
    if any(entry["eccentric_error"] != entry["error"] for entry in found):
        known = max(found, key=lambda entry: _or_infinite(entry["eccentric_error"]))
        console.line(
            f"yamanaka_ankersen, which knows the eccentricity: {known['satellite']} errs by "
            f"{_size(known['eccentric_error'])}"
        )
    oblate = max((entry["oblateness"] or 0.0 for entry in found), default=0.0)
    if oblate > 0.0:
        console.line(f"J2 adds up to {oblate:.3g} m to both; j2_elements contains it")
    models = sorted({entry["fitting_model"] or "none that is linear" for entry in found})
    console.line(f"model that fits to 1 % of the distance: {', '.join(models)}")
    console.line()


def _or_infinite(error: float | None) -> float:
    return math.inf if error is None else error


def _size(error: float | None) -> str:
    return "more than any bound" if error is None else f"up to {error:.3g} m"
