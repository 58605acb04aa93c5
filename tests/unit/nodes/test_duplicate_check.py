# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""When a process ends itself because another one flies its satellite, and when it must not."""

import pytest

from flights import shortened
from satform.flight.compile import compile_scenario
from satform.flight.plans import TimingPlan
from satform_nodes.satellite.duplicate_check import DuplicateCheck
from satform_nodes.transport.node_error import NodeError


def timing() -> TimingPlan:
    return compile_scenario(shortened("triangle", 10.0)).timing


def test_steps_of_the_known_formation_taken_without_this_process_mean_that_another_one_flies() -> None:
    check = DuplicateCheck("sat2", timing(), rate=0.0)
    for step in (1096, 1097, 1098):
        check.require_lost(step, 7, alive=True, known_version=7)
    with pytest.raises(NodeError, match="sat2 is not lost: another process flies it, at step 1099"):
        check.require_lost(1099, 7, alive=True, known_version=7)


def test_states_of_before_its_rejoin_that_are_received_after_the_status_prove_nothing() -> None:
    # The status of version 8 announces the rejoin at step 1105 while states of version 7 are still queued.
    check = DuplicateCheck("sat2", timing(), rate=0.0)
    for step in range(1096, 1105):
        check.require_lost(step, 7, alive=True, known_version=8)


def test_a_loss_between_the_steps_begins_the_count_anew() -> None:
    check = DuplicateCheck("sat2", timing(), rate=0.0)
    check.require_lost(10, 7, alive=True, known_version=7)
    check.require_lost(11, 8, alive=False, known_version=8)
    for step in (12, 13, 14):
        check.require_lost(step, 9, alive=True, known_version=9)
