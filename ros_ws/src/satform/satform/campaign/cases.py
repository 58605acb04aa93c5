# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The cases of a campaign: the changes of case N, and the scenario with them."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import ValidationError
from scipy.special import ndtr, ndtri

from satform.campaign.dispersion import Dispersion
from satform.campaign.distributions import LARGEST_QUANTILE, LEAST_QUANTILE, Value
from satform.campaign.exact_arithmetic import factor_times
from satform.campaign.model import Campaign
from satform.campaign.paths import Target
from satform.campaign.sampling import Coordinate, case_seed
from satform.common.angle_text import radians_of
from satform.scenario import Problem, Scenario, ScenarioError
from satform.scenario.field_errors import problems


def case_values(campaign: Campaign, number: int) -> dict[str, Any]:
    """The changes of a case.

    Args:
        campaign: loaded.
        number: of the case, from 0 to `campaign.cases - 1`.

    Returns:
        Values by the path of a field as messages print it, one for each dispersed field in the order of the
        dispersions, and `seed`. They are numbers, text, or true and false; a pure function of the arguments.

    Raises:
        IndexError: there is no such case.
    """
    return values_at(campaign, case_coordinates(campaign, number)) | _seed(campaign, number)


def case_scenario(campaign: Campaign, number: int) -> Scenario:
    """The scenario of a case: that of the campaign with the changes of the case.

    Args:
        campaign: loaded.
        number: of the case.

    Returns:
        The scenario, complete and consistent.

    Raises:
        IndexError: there is no such case.
        ScenarioError: with these values it cannot fly; all problems at once.
    """
    return changed_scenario(campaign, case_values(campaign, number), f"case {number}")


def case_coordinates(campaign: Campaign, number: int) -> list[Coordinate]:
    """Where a case lies on each axis, after the correlations.

    Args:
        campaign: loaded.
        number: of the case.

    Raises:
        IndexError: there is no such case.
    """
    if not 0 <= number < campaign.cases:
        raise IndexError(f"there is no case {number}: campaign {campaign.name} has 0 to {campaign.cases - 1}")
    axes = campaign.axes
    if not axes:
        return []
    found = campaign.sampling.coordinates(axes, campaign.cases, campaign.seed, number)
    for group, factor in campaign.copulas:
        quantiles = [quantile for axis in group if isinstance(quantile := found[axis], float)]
        # One at a time: where a value is the scenario's own, there is nothing to depend on.
        if len(quantiles) == len(group):
            normals = factor_times(factor, [float(ndtri(quantile)) for quantile in quantiles])
            for axis, normal in zip(group, normals, strict=True):
                found[axis] = min(LARGEST_QUANTILE, max(LEAST_QUANTILE, float(ndtr(normal))))
    return found


def values_at(campaign: Campaign, coordinates: Sequence[Coordinate]) -> dict[str, Any]:
    """The values of all dispersed fields at coordinates.

    Args:
        campaign: loaded.
        coordinates: one for each axis.

    Returns:
        Values by path.
    """
    values: dict[str, Any] = {}
    axis = 0
    for dispersion, found in zip(campaign.dispersions, campaign.targets, strict=True):
        drawn: Value | None = None
        for index, target in enumerate(found):
            if index == 0 or not dispersion.shared:
                drawn = _drawn(dispersion, coordinates[axis])
                axis += 1
            value = target.value if drawn is None else _applied(dispersion, target, drawn)
            # A field that the scenario leaves out stays left out in the case of the scenario's own values.
            if value is not None:
                values[target.text] = value
    return values


def changed_scenario(campaign: Campaign, values: Mapping[str, Any], source: str) -> Scenario:
    """The scenario of a campaign with values of dispersed fields.

    Args:
        campaign: loaded.
        values: by path, of `case_values`.
        source: name for messages.

    Raises:
        ScenarioError: with these values it cannot fly; all problems at once.
    """
    template = campaign.template
    data = json.loads(template.text)
    for path, value in values.items():
        node, parts = data, template.paths[path]
        for part in parts[:-1]:
            node = node[part]
        node[parts[-1]] = value
    try:
        return Scenario.model_validate(data, context=template.files)
    except ScenarioError:
        raise
    except ValidationError as error:
        changed = {
            template.paths[path]: f"{source}, {path} = {_shown(value)}" for path, value in values.items()
        }
        found = [
            problem
            for details in error.errors(include_url=False)
            for problem in problems(details, Scenario, data, None, source, changed)
        ]
        found = [_named_once(problem) for problem in found]
        raise ScenarioError(found) from None


def _seed(campaign: Campaign, number: int) -> dict[str, int]:
    if any(target.path == ("seed",) for found in campaign.targets for target in found):
        return {}
    return {"seed": campaign.base.seed if campaign.same_noise else case_seed(campaign.seed, number)}


def _drawn(dispersion: Dispersion, coordinate: Coordinate) -> Value | None:
    """What is drawn at a coordinate; None for the scenario's own value."""
    if coordinate is None:
        return None
    if dispersion.grid is not None:
        return dispersion.grid.points[int(coordinate)]
    assert dispersion.distribution is not None  # noqa: S101 - the validator has seen to it
    return dispersion.distribution.value(float(coordinate))


def _applied(dispersion: Dispersion, target: Target, drawn: Value) -> Value:
    """The value of a field after a draw."""
    value = drawn
    if isinstance(drawn, str) and (angle := radians_of(drawn, target.angle)) is not None:
        value = angle
    if dispersion.applied != "replace":
        assert isinstance(drawn, int | float)  # noqa: S101 - the campaign's validator has seen to it
        assert isinstance(target.value, int | float)  # noqa: S101 - likewise
        value = target.value + drawn if dispersion.applied == "add" else target.value * drawn
    if isinstance(value, float) and target.is_whole and math.isfinite(value):
        return round(value)
    return value


def _named_once(problem: Problem) -> Problem:
    """A problem without its field where the name of its source ends with that field and its value."""
    named = f", {problem.field} = " in problem.file
    return replace(problem, field="") if named else problem


def _shown(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)
