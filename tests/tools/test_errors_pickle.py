# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every error of ours survives a process pool: its class, its text and what it carries."""

import importlib
import inspect
import pickle
import pkgutil
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

import satform
import satform_bringup
import satform_nodes
import satform_setup
import satform_tools
from satform.scenario import Problem, ScenarioError, parse_scenario

PACKAGES = (satform, satform_nodes, satform_bringup, satform_tools, satform_setup)
VALUES = {
    "sentence": "it failed",
    "code": 3,
    "problems": [Problem("f.yaml", 3, "orbit", "is missing")],
    "nearest": 2.5,
    "path": Path("results/cases.parquet"),
}
"""An argument for each parameter that an error of ours is made with."""


def our_errors() -> list[type[BaseException]]:
    found = set()
    for package in PACKAGES:
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if module.name.endswith("__main__"):
                continue
            members = vars(importlib.import_module(module.name)).values()
            found |= {
                member for member in members if inspect.isclass(member) and issubclass(member, BaseException)
            }
    ours = {error for error in found if error.__module__.partition(".")[0].startswith("satform")}
    return sorted(ours, key=lambda error: error.__qualname__)


def made(kind: type[BaseException]) -> BaseException:
    if "__init__" not in vars(kind):
        return kind("it failed")
    names = list(inspect.signature(kind).parameters)
    return kind(*(VALUES[name] for name in names))


def test_every_error_of_ours_is_the_same_after_pickling() -> None:
    errors = our_errors()
    assert len(errors) > 8
    for kind in errors:
        error = made(kind)
        again = pickle.loads(pickle.dumps(error))  # noqa: S301 - of our own making
        assert type(again) is kind
        assert str(again) == str(error)
        assert vars(again) == vars(error)


def test_a_scenario_that_cannot_fly_is_told_by_a_process_of_a_pool_as_here() -> None:
    with pytest.raises(ScenarioError) as here:
        parse_scenario("name: 1\n", "f.yaml")
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        task = pool.submit(parse_scenario, "name: 1\n", "f.yaml")
        with pytest.raises(ScenarioError) as there:
            task.result(timeout=120)
    assert str(there.value) == str(here.value)
    assert there.value.problems == here.value.problems
