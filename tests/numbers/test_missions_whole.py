# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Missions over the whole time that their sources print, where the shipped scenario flies a part of it."""

import pytest

from flights import shipped
from satform.evaluation.evaluate import evaluate
from satform.flight.simulate import simulate

pytestmark = [pytest.mark.slow, pytest.mark.unmeasured]


def test_the_helix_of_tandem_x_is_kept_for_twelve_days() -> None:
    """Printed: better than 10 m over 12 days on board, and 150 m in the radial/normal plane."""
    scenario = shipped("tandemx_helix", "timing.duration=1036800.0")
    missed = [own for own in evaluate(scenario, simulate(scenario)) if not own.met]
    assert missed == []
