# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A figure of each case beside those that the scenario expects something of."""

from typing import Annotated, Any

from pydantic import BeforeValidator

from satform.common.spec import Plugin, Spec
from satform.scenario.expectation import Expectation
from satform.scenario.parts import Name

CRITERION = ("value", "relative", "absolute", "below", "above", "source", "regression")
"""Fields of an expectation that a figure does not have."""


def _without_bounds(value: Any) -> Any:
    """A measure, which has the fields of an expectation but those that say what is expected."""
    given = [name for name in CRITERION if name in value] if isinstance(value, dict) else []
    if given:
        raise ValueError(
            f"a figure has no {', '.join(given)}: bounds of each case belong to the scenario's expect, for "
            "example by set, and bounds of all cases to the campaign's expect"
        )
    return value


class Figure(Spec):
    """A figure of each case that is not judged case by case."""

    name: Name
    """By which `expect`, tables and reports name it."""
    measure: Annotated[Expectation, Plugin("satform.metrics"), BeforeValidator(_without_bounds)]
    """What is measured: `kind` and fields of an expectation of a scenario, without bounds and source."""
