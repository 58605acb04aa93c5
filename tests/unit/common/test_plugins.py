# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts from another package: found through entry points, flown by name; a bad one is named in a sentence."""

import json
import os
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import pytest
from pydantic import TypeAdapter, ValidationError

from satform.common.spec import PerAxis, Plugin, PositivePerAxis, Spec, installed_entry_points, specs
from satform.control.protocol import ControllerSpec
from satform.orbits.curve_specs import CircleSpec

PARTS = '''
from dataclasses import dataclass
from typing import Literal

import numpy as np

from satform.control.protocol import Action, ControllerSpec
from satform.orbits.curve import CurvePoint
from satform.orbits.curve_specs import CurveSpec
from satform.dynamics.prescribed_disturbances import PerturbationSpec
from satform.common.spec import Number, PerAxis, Positive


@dataclass(frozen=True)
class SteadyPush:
    value: np.ndarray

    def start(self, motion):
        return None

    def resume(self, memory, gap):
        return memory

    def act(self, motion, reference, memory, step):
        acceleration = self.value + 0.0 * motion.position
        return Action(acceleration, 0.0 * acceleration)


class SteadyPushSpec(ControllerSpec):
    """The same push at every step, whatever happens."""

    kind: Literal["steady_push"] = "steady_push"
    push: PerAxis
    """Acceleration that is commanded, m/s^2."""

    def build(self, setting):
        return SteadyPush(np.array(self.push))


@dataclass(frozen=True)
class PolarCircle:
    """A circle about the chief, from the radial towards the normal direction."""

    radius: np.ndarray

    @property
    def perimeter(self):
        return 2.0 * np.pi * self.radius

    def angle_at(self, arc_length):
        return arc_length / self.radius

    def arc_length_at(self, angle):
        return angle * self.radius

    def point(self, angle):
        outward = np.stack((np.cos(angle), 0.0 * angle, np.sin(angle)), axis=-1)
        tangent = np.stack((-np.sin(angle), 0.0 * angle, np.cos(angle)), axis=-1)
        zero = 0.0 * angle
        bend, speed = 1.0 / self.radius + zero, self.radius + zero
        return CurvePoint(self.radius[..., None] * outward, tangent, -outward, bend, speed, zero)


class PolarCircleSpec(CurveSpec):
    kind: Literal["polar_circle"] = "polar_circle"
    radius: Positive
    """Radius, m."""

    def build(self):
        return PolarCircle(np.asarray(self.radius)[()])


@dataclass(frozen=True)
class Ramp:
    slope: float
    step: float
    count: int

    def acceleration(self, step, offset):
        value = np.zeros((self.count, 3))
        value[:, 1] = self.slope * (step * self.step + offset)
        return value

    def bound(self):
        return np.full((self.count, 3), np.inf)

    def centre(self):
        return np.zeros((self.count, 3))


class RampSpec(PerturbationSpec):
    kind: Literal["ramp"] = "ramp"
    slope: Number
    """Growth of the along-track acceleration, m/s^3."""

    def build(self, setting):
        return Ramp(self.slope, setting.step, setting.satellite_count)


class Renamed(ControllerSpec):
    kind: Literal["its_own_name"] = "its_own_name"


class Nameless(ControllerSpec):
    pass


not_a_class = SteadyPushSpec.model_construct()
'''

ENTRY_POINTS = """
[satform.controllers]
steady_push = outside_parts:SteadyPushSpec

[satform.curves]
polar_circle = outside_parts:PolarCircleSpec

[satform.perturbations]
ramp = outside_parts:RampSpec

[outside.renamed]
another_name = outside_parts:Renamed

[outside.nameless]
nameless = outside_parts:Nameless

[outside.plain_class]
steady_push = outside_parts:SteadyPush

[outside.instance]
steady_push = outside_parts:not_a_class

[outside.lone]
steady_push = outside_parts:SteadyPushSpec

[outside.mixed]
steady_push = outside_parts:SteadyPushSpec
polar_circle = outside_parts:PolarCircleSpec
"""

FLY = """
import json, sys
from satform.scenario import Scenario, load_scenario
from satform.flight.simulate import simulate

scenario = load_scenario(sys.argv[1])
record, one_by_one = simulate(scenario), simulate(scenario, stacked=False)
json.dump({
    "time": record.time.tolist(),
    "position": record.position.tolist(),
    "reference": record.reference_position.tolist(),
    "acceleration": record.acceleration.tolist(),
    "differences": record.differences(one_by_one),
    "again": Scenario.model_validate_json(scenario.to_json()) == scenario,
    "schema": json.dumps(Scenario.model_json_schema()),
}, sys.stdout)
"""

# With a chief that turns once in twenty thousand years, the relative motion is free of tides.
SCENARIO = """
name: outside
title: Parts from another package
text: A push and a ramp act on satellites that are told to fly a circle.
orbit: {mean_motion: 1.0e-11}
timing: {step: 0.5, duration: 20.0}
dynamics: {kind: cw, perturbations: [{kind: ramp, slope: 6.0e-3}]}
graph: {kind: complete}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {rate: 3.0}
satellite_defaults:
  curve: {kind: polar_circle, radius: 50.0}
satellites:
  - {name: sat1, rate: 0.0, controller: {kind: steady_push, push: [0.02, 0.0, -0.04]}}
  - {name: sat2, rate: 0.0, controller: {kind: steady_push, push: 0.0}}
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package as pip would have installed it."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "outside_parts.py").write_text(PARTS)
    about = folder / "outside_parts-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: outside-parts\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRY_POINTS)
    return folder


@pytest.fixture(scope="module")
def flown(package: Path) -> dict[str, Any]:
    """What a fresh Python that finds the package makes of the scenario."""
    scenario = package / "scenario.yaml"
    scenario.write_text(SCENARIO)
    paths = [str(package), *filter(None, sys.path)]
    finished = subprocess.run(
        [sys.executable, "-c", FLY, str(scenario)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert finished.returncode == 0, finished.stderr
    flight: dict[str, Any] = json.loads(finished.stdout)
    return flight


def test_a_controller_from_outside_commands_the_flight(flown: dict[str, Any]) -> None:
    assert all(row == [[0.02, 0.0, -0.04], [0.0, 0.0, 0.0]] for row in flown["acceleration"])


def test_a_curve_from_outside_leads_the_reference(flown: dict[str, Any]) -> None:
    first = flown["reference"][0][0]
    assert first == [50.0, 0.0, 0.0]
    for row in flown["reference"]:
        for x, y, z in row:
            assert y == 0.0
            assert x * x + z * z == pytest.approx(2500.0, rel=1e-12)


def test_a_perturbation_from_outside_moves_the_satellites(flown: dict[str, Any]) -> None:
    for time, (pushed, left_alone) in zip(flown["time"], flown["position"], strict=True):
        drift = 6.0e-3 * time**3 / 6.0
        assert pushed == pytest.approx([50.0 + 0.01 * time**2, drift, -0.02 * time**2], abs=1e-7)
        assert left_alone == pytest.approx([50.0, drift, 0.0], abs=1e-7)


def test_parts_from_outside_are_stacked_like_those_shipped(flown: dict[str, Any]) -> None:
    assert flown["differences"] == []


def test_a_scenario_with_parts_from_outside_survives_its_json(flown: dict[str, Any]) -> None:
    assert flown["again"]


def test_the_schema_of_scenarios_describes_the_parts_from_outside(flown: dict[str, Any]) -> None:
    for words in ("steady_push", "polar_circle", "ramp", "Acceleration that is commanded, m/s^2."):
        assert words in flown["schema"]


def test_without_the_package_its_names_are_unknown_and_those_shipped_are_offered() -> None:
    assert "steady_push" not in specs("satform.controllers")
    assert "sliding_mode" in specs("satform.controllers")


@pytest.fixture
def installed(package: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The package made visible to this process, for groups that nothing else asks for."""
    monkeypatch.syspath_prepend(str(package))
    installed_entry_points.cache_clear()
    yield
    installed_entry_points.cache_clear()


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("group", "sentence"),
    [
        ("outside.renamed", r"another_name \(outside_parts:Renamed\) declares kind 'its_own_name'"),
        ("outside.nameless", r"nameless \(outside_parts:Nameless\) declares kind None"),
        (
            "outside.plain_class",
            r"steady_push \(outside_parts:SteadyPush\) is not a satform.common.spec.Spec",
        ),
        ("outside.instance", r"steady_push \(outside_parts:not_a_class\) is not a satform.common.spec.Spec"),
    ],
)
def test_a_bad_entry_point_is_refused_by_its_group_name_and_place(group: str, sentence: str) -> None:
    with pytest.raises(TypeError, match=f"{group}:{sentence}"):
        specs(group)


@pytest.mark.usefixtures("installed")
def test_a_name_that_two_packages_register_is_refused(package: Path) -> None:
    about = package / "rival_parts-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: rival-parts\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[outside.twice]\nellipse = satform.orbits.curve_specs:EllipseSpec\n"
        "circle = satform.orbits.curve_specs:CircleSpec\n"
    )
    about = package / "other_parts-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: other-parts\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[outside.twice]\ncircle = other_circle:OtherSpec\n")
    (package / "other_circle.py").write_text(
        textwrap.dedent("""
            from satform.orbits.curve_specs import CircleSpec

            class OtherSpec(CircleSpec):
                pass
        """)
    )
    with pytest.raises(TypeError, match=r"outside.twice:circle is registered twice"):
        specs("outside.twice")


@pytest.mark.usefixtures("installed")
def test_a_curve_registered_as_a_controller_is_refused() -> None:
    class Vehicle(Spec):
        controller: Annotated[ControllerSpec, Plugin("outside.lone")]

    assert Vehicle.model_validate({"controller": {"push": 1.0}}).controller.kind == "steady_push"
    with pytest.raises(TypeError, match=r"PolarCircleSpec is registered in outside.mixed but is not a Contr"):
        TypeAdapter(Annotated[ControllerSpec, Plugin("outside.mixed")]).rebuild()


def test_a_group_without_entry_points_is_refused() -> None:
    assert specs("outside.empty") == {}
    with pytest.raises(TypeError, match=r"no entry point is registered in the group outside.empty"):
        TypeAdapter(Annotated[ControllerSpec, Plugin("outside.empty")]).rebuild()


@pytest.mark.parametrize("group", ["curves", "controllers", "perturbations", "dynamics", "topologies"])
def test_the_parts_shipped_come_through_the_same_door(group: str) -> None:
    found = specs(f"satform.{group}")
    assert found
    assert all(spec.model_fields["kind"].default == name for name, spec in found.items())


class Gains(Spec):
    per_axis: PerAxis = (0.0, 0.0, 0.0)
    positive: PositivePerAxis = (1.0, 1.0, 1.0)


def test_a_lone_number_stands_for_the_same_value_on_each_axis() -> None:
    assert Gains(per_axis=-2, positive=0.5) == Gains(per_axis=(-2.0, -2.0, -2.0), positive=(0.5, 0.5, 0.5))


@pytest.mark.parametrize(
    "fields",
    [
        {"per_axis": (1.0, 2.0)},
        {"per_axis": float("nan")},
        {"per_axis": (0.0, float("inf"), 0.0)},
        {"per_axis": 2e15},
        {"positive": 0.0},
        {"positive": (1.0, -1.0, 1.0)},
        {"per_axes": 1.0},
    ],
)
def test_a_spec_refuses_what_is_not_declared_or_out_of_bounds(fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Gains(**fields)


def test_a_part_built_in_python_tells_its_kind_like_one_from_a_file() -> None:
    assert json.loads(CircleSpec(radius=5.0).model_dump_json(exclude_unset=True)) == {
        "kind": "circle",
        "radius": 5.0,
    }


def test_a_kind_that_a_scenario_does_not_have_is_not_loaded() -> None:
    code = (
        "import sys; from satform.scenario import load_scenario; load_scenario(sys.argv[1]); "
        "print([name in sys.modules for name in sys.argv[2:]])"
    )
    triangle = str(Path(__file__).parents[3] / "scenarios" / "triangle.yaml")
    modules = ["satform.control.sliding_mode", "satform.control.lqi", "satform.equipment.sensors.gnss"]
    ended = subprocess.run(
        [sys.executable, "-c", code, triangle, *modules],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert ended.stdout.strip() == "[True, False, False]"
