# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Forks of a process server have the scenario that it was given last; others read the file."""

import subprocess
import sys
from pathlib import Path

FORKS = """
import os, sys
from pathlib import Path
from satform.scenario import load_scenario, save_scenario
from satform_nodes import SHARED_SCENARIO
from satform_nodes.runtime import shared_plan

shared, scenario_file = Path(sys.argv[1]), Path(sys.argv[2])
os.environ[SHARED_SCENARIO] = str(shared)
shared_plan.take_before_forks()
assert SHARED_SCENARIO not in os.environ
triangle = load_scenario(sys.argv[3])


def fork(check):
    child = os.fork()
    if not child:
        os._exit(0 if check() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


fork(lambda: shared_plan.scenario_and_plan(str(scenario_file)) is None)
for seed in (1, 2):
    save_scenario(triangle.with_(seed=seed), scenario_file)
    shared_plan.announce(shared, scenario_file)

    def as_in_the_file():
        scenario, plan = shared_plan.scenario_and_plan(str(scenario_file))
        return scenario == load_scenario(scenario_file) and scenario.seed == seed and plan.plant.seed == seed

    fork(as_in_the_file)
    fork(lambda: shared_plan.scenario_and_plan(str(scenario_file) + "x") is None)
"""


def test_forks_have_the_scenario_that_was_given_last(tmp_path: Path) -> None:
    triangle = Path(__file__).parents[3] / "scenarios" / "triangle.yaml"
    arguments = [str(tmp_path / "shared"), str(tmp_path / "scenario.json"), str(triangle)]
    ended = subprocess.run(
        [sys.executable, "-c", FORKS, *arguments], capture_output=True, text=True, timeout=120, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, "")
