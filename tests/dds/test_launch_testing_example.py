# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The example of a test with launch_testing: what it launches exists, and its assertion holds in a flight."""

import importlib.util
import sys
import types
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.unmeasured

BRINGUP = Path(__file__).resolve().parents[2] / "ros_ws" / "src" / "satform_bringup"


class Made:
    """Stands for an action: what it was made with."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        self.positional = positional
        self.named = named


STAND_INS: dict[str, dict[str, Any]] = {
    "launch": {"LaunchDescription": lambda entities: entities},
    "launch.actions": {"IncludeLaunchDescription": Made},
    "launch.launch_description_sources": {"PythonLaunchDescriptionSource": Made},
    "launch_testing.actions": {"ReadyToTest": Made},
    "launch_testing.asserts": {},
    "launch_testing.markers": {"keep_alive": lambda function: function},
    "launch_testing": {"ProcInfoHandler": Made, "post_shutdown_test": lambda: lambda case: case},
}
"""The few names of `launch` and `launch_testing` that the file uses; neither is among the wheels."""


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The file as a module."""
    for name, contents in STAND_INS.items():
        module = types.ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
        package, _, part = name.rpartition(".")
        if package == "launch_testing":
            STAND_INS["launch_testing"][part] = module
    spec = importlib.util.spec_from_file_location("flight", BRINGUP / "test" / "launch_test_flight.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_it_launches_the_installed_file_with_arguments_that_this_has(example: Any) -> None:
    include, ready = example.generate_test_description()
    (source,) = include.positional
    assert isinstance(ready, Made)
    file = Path(source.positional[0])
    assert file.read_bytes() == (BRINGUP / "launch" / "scenario.launch.py").read_bytes()
    (line,) = (line for line in file.read_text().splitlines() if line.startswith("ARGUMENTS = "))
    assert {f'"{name}"' for name, _ in include.named["launch_arguments"]} <= set(
        line.removeprefix("ARGUMENTS = (").rstrip(")").split(", ")
    )


def test_its_assertion_holds_in_a_flight_with_the_same_arguments(
    example: Any, start_run: Callable[..., Any]
) -> None:
    start_run("triangle", "--namespace", "tested", "--set", "expect=[]")
    found = unittest.TestResult()
    unittest.defaultTestLoader.loadTestsFromTestCase(example.TestFlight).run(found)
    assert found.testsRun == 1
    assert found.failures + found.errors == []
