# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plan of a flight that is compiled once, in the process of which all processes of the flight are forks.

The supervisor writes a file with the scenario, which it has validated, and the process server takes it before
its next fork. A process that is no fork of such a server, or is started for another scenario file, reads and
compiles the scenario itself.
"""

import gc
import os
import pickle
from contextlib import suppress
from functools import partial
from pathlib import Path

from satform.files.durable_file import write_durably
from satform.flight.compile import FormationPlan, compile_scenario
from satform.scenario import Scenario
from satform_nodes import SHARED_SCENARIO

_plans: dict[str, tuple[Scenario, FormationPlan]] = {}
"""Scenario and plan by the path of the scenario file that nodes are given."""

_taken: list[int] = []
"""When the file that was taken last was written, ns."""


def write_scenario(file: Path, scenario_file: Path, scenario: Scenario) -> None:
    """Write the file for the process server.

    Args:
        file: that it takes.
        scenario_file: which the nodes are given.
        scenario: as it is in that file.

    Raises:
        OSError: it cannot be written.
    """
    write_durably(file, pickle.dumps((str(scenario_file), scenario)))


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
    with suppress(OSError):
        written = file.stat().st_mtime_ns
        if _taken == [written]:
            return
        _taken[:] = [written]
        scenario_file, scenario = pickle.loads(file.read_bytes())  # noqa: S301 - this user's own, see above
        plan = compile_scenario(scenario)
        _plans.clear()
        _plans[scenario_file] = scenario, plan
        # What every satellite's process would make for itself.
        _ = plan.topics, plan.membership
        # Forks then leave these objects, and the memory that they are in, as they are.
        gc.freeze()
