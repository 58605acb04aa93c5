# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plan of a flight that is compiled once, in the process of which all processes of the flight are forks.

The supervisor writes a file with the path of the scenario file, and the process server reads and compiles
that scenario before its next fork. A process that is no fork of such a server, or is started for another
scenario file, reads and compiles the scenario itself.
"""

import gc
import os
from contextlib import suppress
from functools import partial
from pathlib import Path

from satform.files.durable_file import write_durably
from satform.flight.compile import FormationPlan, compile_scenario
from satform.scenario import Scenario, ScenarioError, load_scenario
from satform_nodes import SHARED_SCENARIO

_plans: dict[str, tuple[Scenario, FormationPlan]] = {}
"""Scenario and plan by the path of the scenario file that nodes are given."""

_taken: list[int] = []
"""When the file that was taken last was written, ns."""


def announce(file: Path, scenario_file: Path) -> None:
    """Name a scenario file to the process server.

    Args:
        file: that it reads before its next fork.
        scenario_file: which the nodes are given.

    Raises:
        OSError: it cannot be written.
    """
    write_durably(file, os.fsencode(scenario_file))


def take_before_forks() -> None:
    """Have this process take the scenario before it forks others, if its environment names the file."""
    file = os.environ.pop(SHARED_SCENARIO, "")
    if file:
        os.register_at_fork(before=partial(_take, Path(file), os.getpid()))


def scenario_and_plan(scenario_file: str) -> tuple[Scenario, FormationPlan] | None:
    """Scenario and plan that this process has from the one that it was forked from; None without any.

    Args:
        scenario_file: that this process was given.
    """
    return _plans.get(scenario_file)


def _take(file: Path, server: int) -> None:
    if os.getpid() != server:
        # A fork that forks in its turn.
        return
    # A node of it then says what is wrong with a file.
    with suppress(OSError, ScenarioError):
        written = file.stat().st_mtime_ns
        if _taken == [written]:
            return
        _taken[:] = [written]
        scenario_file = os.fsdecode(file.read_bytes())
        scenario = load_scenario(scenario_file)
        plan = compile_scenario(scenario)
        _plans.clear()
        _plans[scenario_file] = scenario, plan
        # What every satellite's process would make for itself.
        _ = plan.topics, plan.membership
        # Forks then leave these objects, and the memory that they are in, as they are.
        gc.freeze()
