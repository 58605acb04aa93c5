# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""After how long a silent plant counts as lost: as the pages say, twice what a satellite is waited for."""

from pathlib import Path
from unittest.mock import Mock

import pytest

from flights import shortened
from satform.common.spec import field_description
from satform.flight.compile import compile_scenario
from satform.scenario import Scenario
from satform_nodes.satellite.flight_loop import fly_all
from satform_nodes.transport.node_error import NodeError

DOCS = Path(__file__).parents[3] / "docs"


def test_satellites_wait_for_the_plant_for_twice_the_silence_that_is_tolerated() -> None:
    satellite = Mock()
    satellite.plan = compile_scenario(shortened("triangle", 10.0, "node_timeout=7.0"))
    satellite.name, satellite.steps.step, satellite.steps.view.ended = "sat1", 12, None
    executor = Mock()
    # The first state comes; the next one does not.
    executor.spin_while.side_effect = [True, False]
    stop = Mock()
    stop.asked = False
    with pytest.raises(NodeError, match="nothing received from the plant at step 12"):
        fly_all([satellite], executor, stop)
    assert executor.spin_while.call_args_list[1].args[1] == 14.0


def test_the_pages_say_so() -> None:
    described = field_description(Scenario, "node_timeout")
    assert "the plant counts as lost after twice that time" in " ".join(described.split())
    for page in ("verification.md", "multi_host.md"):
        assert "twice that" in (DOCS / page).read_text(encoding="utf-8")
