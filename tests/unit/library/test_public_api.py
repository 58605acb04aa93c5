# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The library as its users import it: public names, building and varying scenarios, access to a record."""

import ast
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import satform as sf
from flights import shipped, shortened

STUB = Path(sf.__file__).with_name("__init__.pyi")


def built(**fields: object) -> sf.Scenario:
    parts: dict[str, object] = {
        "orbit": sf.Orbit(period=6000.0),
        "timing": sf.Timing(step=1.0, duration=60.0),
        "dynamics": sf.CwDynamicsSpec(),
        "graph": sf.RingSpec(),
        "consensus": sf.ArcLengthConsensusSpec(coupling_gain=1e-6, rate_gain=1e-3, tracking_gain=1e-3),
        "nominal_motion": sf.NominalMotion(period=6000.0),
        "satellite_defaults": sf.SatelliteFields(
            curve=sf.CircleSpec(radius=1000.0), controller=sf.SlidingModeSpec(boundary_layer=0.1)
        ),
        "satellites": [sf.SatelliteSpec(name=name) for name in ("a", "b")],
    }
    return sf.Scenario(**{**parts, **fields})


def test_every_public_name_is_there_and_type_checkers_see_the_same_names() -> None:
    assert all(getattr(sf, name) is not None for name in sf.__all__)
    stub = ast.parse(STUB.read_text(encoding="utf-8"))
    seen = {
        (alias.asname, f"{node.module}.{alias.name}")
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(name for name, _ in seen if name) == list(sf.__all__)
    own = {(name, f"{getattr(sf, name).__module__}.{name}") for name in sf.__all__ if name != "plot"}
    assert seen - {("plot", "satform.plot")} == own


def test_a_name_that_is_not_public_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Simulate'"):
        _ = sf.Simulate


def test_importing_the_library_imports_none_of_its_parts_nor_what_they_need() -> None:
    code = (
        "import sys, satform; print(sorted(m for m in sys.modules "
        "if m.startswith('satform.') or m in ('numpy', 'scipy', 'pydantic', 'brahe', 'rclpy')))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_simulating_a_scenario_and_reading_bags_import_nothing_of_ros() -> None:
    code = (
        "import sys, satform; satform.load_scenario; satform.simulate; satform.evaluate; satform.read_bag; "
        "satform.plot; print([m for m in sys.modules if m.split('.')[0] in "
        "('rclpy', 'satform_msgs', 'satform_nodes', 'rosidl_parser', 'ament_index_python')])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_a_scenario_built_in_python_is_the_same_as_one_from_a_file() -> None:
    scenario = built()
    again = sf.parse_scenario(scenario.to_json())
    assert again.digest() == scenario.digest()
    assert sf.simulate(again).digest() == sf.simulate(scenario).digest()


def test_a_scenario_that_cannot_fly_is_refused_in_sentences_with_paths() -> None:
    with pytest.raises(sf.ScenarioError) as refusal:
        built(timing={"step": 1.0, "duration": 10.5}, graph={"kind": "rong"}, title="")
    sentences = [str(problem) for problem in refusal.value.problems]
    assert any("Scenario: timing: duration 10.5 s is 10.5 steps" in text for text in sentences)
    assert any("graph: there is no kind 'rong'; did you mean ring?" in sentence for sentence in sentences)
    assert any("Scenario: title:" in sentence for sentence in sentences)
    with pytest.raises(sf.ScenarioError, match="satellite c has no curve"):
        built(satellite_defaults=sf.SatelliteFields(), satellites=[{"name": "c"}])


def test_a_varied_scenario_has_the_new_values_and_leaves_the_old_one_as_it_was() -> None:
    scenario = built()
    before = scenario.digest()
    varied = scenario.with_(
        {"satellites[*].controller.boundary_layer": 0.5, "satellites[b].scale": np.float64(2.0)},
        seed=7,
        graph=sf.CompleteSpec(),
    )
    layers = [varied.satellite(index).controller.boundary_layer for index in range(2)]
    assert layers == [(0.5, 0.5, 0.5)] * 2
    assert [own.scale for own in varied.satellites] == [1.0, 2.0]
    assert (varied.seed, varied.graph.kind) == (7, "complete")
    assert varied.satellite_defaults.controller.boundary_layer == (0.1, 0.1, 0.1)
    assert scenario.digest() == before


def test_a_scenario_varied_to_its_own_values_is_itself() -> None:
    scenario = shipped("triangle")
    assert scenario.with_({"timing.step": scenario.timing.step}).digest() == scenario.digest()


def test_a_shorter_flight_is_not_judged_by_what_lies_beyond_its_end() -> None:
    scenario = shipped("triangle").with_({"timing.duration": 600.0})
    assert scenario.timing.steps == 1200
    assert scenario.expect == ()
    assert scenario.digest() == shortened("triangle", 600.0).digest()


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ("timing.step", -1, "timing.step: found -1; it should be greater than"),
        ("timing.step", "5", 'timing.step: found "5"; it should be a number'),
        ("timing.stepp", 1.0, "did you mean step?"),
        (
            "satellites[z].scale",
            1.0,
            "there is no satellites.z in the scenario; entries are counted from 0",
        ),
        ("satellites[*].controller.boundary_layr", 1.0, "did you mean boundary_layer?"),
        ("timing.step.first", 1.0, "there is no timing.step.first in the scenario"),
    ],
)
def test_a_change_that_is_not_allowed_names_the_path_and_what_is_allowed(
    path: str, value: object, sentence: str
) -> None:
    with pytest.raises(sf.ScenarioError) as refusal:
        built().with_({path: value})
    assert all(str(problem).startswith(f"with_ '{path}': ") for problem in refusal.value.problems)
    assert sentence in str(refusal.value)


def test_scenario_and_record_are_short_in_print() -> None:
    scenario = built()
    record = sf.simulate(scenario)
    assert repr(scenario) == str(scenario) == "<Scenario formation: 2 satellites, cw, 60 steps of 1 s>"
    assert repr(record) == "<FlightRecord of a, b: 60 steps of 1 s, 60 s in all>"
    assert repr(record["b"]) == "<SatelliteRecord b: 60 steps of 1 s>"


def test_a_satellite_is_found_in_a_record_by_its_name() -> None:
    record = sf.simulate(built())
    view = pickle.loads(pickle.dumps(record["b"]))  # noqa: S301 - our own
    np.testing.assert_array_equal(view.position, record.position[:, 1])
    np.testing.assert_array_equal(view.tracking_error, record.tracking_error[:, 1])
    np.testing.assert_array_equal(view.time, record.time)
    assert {"position", "arc_length", "control", "time"} <= set(dir(view))
    with pytest.raises(KeyError, match="no satellite 'c' in this flight; there are a, b"):
        record["c"]
    with pytest.raises(AttributeError, match="a satellite's record has no altitude; it has time, position"):
        _ = view.altitude


@pytest.mark.parametrize(("method", "extra"), [("to_xarray", "xarray"), ("to_pandas", "pandas")])
def test_a_missing_extra_is_named(method: str, extra: str, monkeypatch: pytest.MonkeyPatch) -> None:
    record = sf.simulate(built())
    monkeypatch.setitem(sys.modules, extra, None)
    with pytest.raises(ImportError, match=rf"{method} needs {extra}: pip install 'satform\[{extra}\]'"):
        getattr(record, method)()


def test_the_state_hash_of_a_flight_is_that_of_version_0_1_0() -> None:
    # The hash takes the quantities by their names of that version, whatever they are called now.
    assert sf.simulate(shortened("triangle", 20.0)).digest()[:16] == "93e1b15970d6a7bc"
