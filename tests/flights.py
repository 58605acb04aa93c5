# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The shipped scenarios, for the tests that fly them."""

import functools
from pathlib import Path

from satform.scenario import Scenario, load_scenario

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@functools.cache
def shipped(name: str, *changes: str) -> Scenario:
    """A shipped scenario, with changes such as `timing.step=1.0`; read once, as nothing can change it."""
    return load_scenario(SCENARIOS / f"{name}.yaml", changes)


def shortened(name: str, duration: float, *changes: str) -> Scenario:
    """A shipped scenario flown for a while only, and not judged."""
    return shipped(name, f"timing.duration={duration}", "expect=[]", *changes)
