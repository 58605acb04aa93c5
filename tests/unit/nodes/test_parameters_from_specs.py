# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS parameters made of a specification: type, default, bounds, description; changes and refusals."""

import json
import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
import pytest
import rclpy
from pydantic import Field
from rcl_interfaces.msg import ParameterType
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from formations import formation
from satform.common.angle_text import OR_DEGREES, OR_DEGREES_PER_SECOND
from satform.common.spec import NonNegative, NonNegativePerAxis, Number, PerAxis, Positive, Spec
from satform.control.sliding_mode import SlidingModeSpec
from satform.flight.compile import compile_scenario
from satform.flight.satellite import Satellite
from satform.membership.reconfiguration import Target, TargetSpec
from satform.orbits.curve_specs import CircleSpec, EllipseSpec, FixedPointSpec
from satform.scenario.yaml_reader import read_value
from satform_bringup.deployment.domain_lock import own_domain
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.runtime.parameters import (
    ParameterError,
    declare_fixed,
    declare_rate,
    declare_spec,
    on_spec_change,
)
from satform_nodes.satellite.parameters import SatelliteParameters


class Tuning(Spec):
    """Every kind of field that a part may have."""

    kind: Literal["tuning"] = "tuning"
    gain: Positive = 2.0
    """Some gain, 1/s."""
    level: Annotated[float, Field(ge=-1.0, le=3.0)] = 0.5
    offset: Number = -4.0
    limit: NonNegative | None = 7.0
    excluded: Positive | None = None
    count: Annotated[int, Field(ge=1, le=9)] = 3
    smooth: bool = True
    mode: Literal["hold", "extrapolate"] = "hold"
    weights: NonNegativePerAxis = (1.0, 2.0, 3.0)


class Flown:
    """A node with the parameters of a sliding-mode law and of a tuning, and what became of them."""

    def __init__(self, node: FormationNode) -> None:
        self.node = node
        self.controller: Any = SlidingModeSpec(switching_gain=(0.1, 0.2, 0.3))
        self.tuning: Any = Tuning()
        self.accepted: list[dict[str, Any]] = []
        declare_fixed(node, "scenario", "a.yaml", "path of the scenario file")
        declare_spec(node, "controller", self.controller)
        declare_spec(node, "tuning", self.tuning)
        on_spec_change(node, "controller", lambda: self.controller, self._accept_controller)
        on_spec_change(node, "tuning", lambda: self.tuning, self._accept_tuning)

    def _accept_controller(self, spec: Spec, fields: dict[str, Any]) -> str:
        self.controller = spec
        self.accepted.append(fields)
        return "takes effect at step 12"

    def _accept_tuning(self, spec: Any, fields: dict[str, Any]) -> str:
        if spec.gain > 100.0:
            raise ValueError(f"a gain of {spec.gain:g} cannot fly at this step")
        self.tuning = spec
        return ""

    def change(self, **values: Any) -> Any:
        """Change parameters together; two underscores stand for the dot."""
        parameters = [Parameter(name.replace("__", "."), value=value) for name, value in values.items()]
        return self.node.set_parameters_atomically(parameters)


@pytest.fixture(scope="module")
def ros() -> Iterator[rclpy.Context]:
    context = rclpy.Context()
    with own_domain() as domain:
        rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        yield context
        rclpy.shutdown(context=context)


class QuietNode(FormationNode):
    """The node of a formation in a context of its own."""

    def __init__(self, context: rclpy.Context, *arguments: str) -> None:
        self.sentence = ""
        super(FormationNode, self).__init__(
            "tuned", context=context, start_parameter_services=False, cli_args=list(arguments)
        )


@pytest.fixture
def flown(ros: rclpy.Context) -> Iterator[Flown]:
    node = QuietNode(ros)
    yield Flown(node)
    node.destroy_node()


def test_every_gain_of_the_sliding_mode_law_is_a_parameter_with_its_value(flown: Flown) -> None:
    values = {name: value.value for name, value in flown.node.get_parameters_by_prefix("controller").items()}
    assert values.pop("kind") == "sliding_mode"
    assert {name: list(value) for name, value in values.items()} == {
        "proportional_gain": [0.01, 0.01, 0.01],
        "switching_gain": [0.1, 0.2, 0.3],
        "reaching_gain": [0.1, 0.1, 0.1],
        "boundary_layer": [0.0, 0.0, 0.0],
        "disturbance_centre": [0.0, 0.0, 0.0],
    }


@pytest.mark.parametrize("name", SlidingModeSpec.model_fields)
def test_a_gain_is_described_as_the_scenarios_schema_describes_it(flown: Flown, name: str) -> None:
    descriptor = flown.node.describe_parameter(f"controller.{name}")
    if name == "kind":
        assert descriptor.type == ParameterType.PARAMETER_STRING
        assert descriptor.read_only
        return
    declared = SlidingModeSpec.model_json_schema()["properties"][name]
    assert descriptor.type == ParameterType.PARAMETER_DOUBLE_ARRAY
    assert not descriptor.read_only
    assert descriptor.description == declared["description"]
    assert "m/s" in descriptor.description or "1/s" in descriptor.description


def test_the_bounds_of_a_gain_per_axis_are_said_in_words(flown: Flown) -> None:
    said = {
        name: flown.node.describe_parameter(f"controller.{name}").additional_constraints
        for name in ("proportional_gain", "switching_gain", "disturbance_centre")
    }
    assert said == {
        "proportional_gain": "each number > 0 and <= 1e+15; one number stands for all",
        "switching_gain": "each number >= 0 and <= 1e+15; one number stands for all",
        "disturbance_centre": "each number >= -1e+15 and <= 1e+15; one number stands for all",
    }


@pytest.mark.parametrize(
    ("name", "kind", "value"),
    [
        ("gain", ParameterType.PARAMETER_DOUBLE, 2.0),
        ("level", ParameterType.PARAMETER_DOUBLE, 0.5),
        ("offset", ParameterType.PARAMETER_DOUBLE, -4.0),
        ("limit", ParameterType.PARAMETER_DOUBLE, 7.0),
        ("count", ParameterType.PARAMETER_DOUBLE, 3.0),
        ("smooth", ParameterType.PARAMETER_BOOL, True),
        ("mode", ParameterType.PARAMETER_STRING, "hold"),
    ],
)
def test_a_field_becomes_the_parameter_type_that_can_hold_it(
    flown: Flown, name: str, kind: int, value: Any
) -> None:
    assert flown.node.describe_parameter(f"tuning.{name}").type == kind
    assert flown.node.get_parameter(f"tuning.{name}").value == value


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("gain", 0.0, 1e15), ("level", -1.0, 3.0), ("limit", 0.0, 1e15), ("count", 1.0, 9.0)],
)
def test_the_bounds_of_a_number_are_its_parameters_range(
    flown: Flown, name: str, low: float, high: float
) -> None:
    ranges = flown.node.describe_parameter(f"tuning.{name}").floating_point_range
    assert [(limits.from_value, limits.to_value, limits.step) for limits in ranges] == [(low, high, 0.0)]


def test_a_field_without_a_description_is_told_by_its_name(flown: Flown) -> None:
    assert flown.node.describe_parameter("tuning.gain").description == "Some gain, 1/s."
    assert flown.node.describe_parameter("tuning.level").description == "level of tuning"


def test_a_field_that_is_left_out_is_no_parameter(flown: Flown) -> None:
    assert not flown.node.has_parameter("tuning.left_out")


def test_a_change_reaches_the_specification_and_the_reply_says_when_it_acts(flown: Flown) -> None:
    reply = flown.change(controller__switching_gain=[0.4, 0.5, 0.6])
    assert (reply.successful, reply.reason) == (True, "takes effect at step 12")
    assert flown.controller.switching_gain == (0.4, 0.5, 0.6)
    assert flown.controller.reaching_gain == (0.1, 0.1, 0.1)
    assert flown.accepted == [{"switching_gain": [0.4, 0.5, 0.6]}]
    assert list(flown.node.get_parameter("controller.switching_gain").value) == [0.4, 0.5, 0.6]


def test_gains_changed_together_are_accepted_together(flown: Flown) -> None:
    assert flown.change(controller__switching_gain=[0.4] * 3, controller__reaching_gain=[0.2] * 3).successful
    assert [sorted(fields) for fields in flown.accepted] == [["reaching_gain", "switching_gain"]]


def test_every_kind_of_number_can_be_changed(flown: Flown) -> None:
    before = flown.tuning
    reply = flown.change(tuning__gain=1.0, tuning__count=4.0, tuning__weights=[0.0] * 3)
    assert reply.successful, reply.reason
    expected = Tuning(gain=1.0, count=4, smooth=before.smooth, mode=before.mode, weights=(0.0, 0.0, 0.0))
    assert flown.tuning == expected


NEGATIVE = "found -1.0; it should be greater than or equal to 0"
SAME = [
    ({"tuning__gain": 3}, "gain=3"),
    ({"tuning__gain": "1e1"}, "gain=1e1"),
    ({"tuning__offset": "1.0e3"}, "offset=1.0e3"),
    ({"tuning__offset": "-2E-3"}, "offset=-2E-3"),
    ({"tuning__weights": [1, 2, 3]}, "weights=[1, 2, 3]"),
    ({"tuning__weights": 2.5}, "weights=2.5"),
    ({"tuning__weights": 4}, "weights=4"),
    ({"tuning__weights": "1e1"}, "weights=1e1"),
    ({"tuning__weights": "[1e-1, 2, .5]"}, "weights=[1e-1, 2, .5]"),
    ({"tuning__weights": ["1e-1", "2e0", "5e-1"]}, "weights=[1e-1, 2e0, 5e-1]"),
]


@pytest.mark.parametrize(("values", "setting"), SAME)
def test_a_parameter_takes_what_a_scenario_file_takes_and_makes_the_same_of_it(
    flown: Flown, values: dict[str, Any], setting: str
) -> None:
    name, _, text = setting.partition("=")
    assert flown.change(**values).successful
    assert flown.tuning == Tuning(**{name: read_value(text, "typed")})


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"tuning__gain": "fast"}, 'tuning.gain: found "fast"; it should be a number'),
        ({"tuning__gain": True}, "tuning.gain: found true; it should be a number"),
        ({"tuning__gain": [1.0]}, "tuning.gain: found [1.0]; it should be a number"),
        ({"tuning__weights": ["1", "x", "2"]}, 'tuning.weights[1]: found "x"; it should be a number'),
        ({"tuning__weights": True}, "tuning.weights: found true; it should be a number"),
        ({"tuning__weights": -1}, "; ".join(f"tuning.weights[{axis}]: {NEGATIVE}" for axis in range(3))),
    ],
)
def test_what_is_no_number_is_refused_in_the_words_of_a_scenarios_errors(
    flown: Flown, values: dict[str, Any], sentence: str
) -> None:
    assert refused(flown, **values) == sentence


def test_a_vector_that_a_scenario_file_wants_in_full_is_wanted_in_full_here(ros: rclpy.Context) -> None:
    node = QuietNode(ros)
    declare_spec(node, "curve", FixedPointSpec(position=(1.0, 2.0, 3.0)))
    result = node.set_parameters_atomically([Parameter("curve.position", value=1.0)])
    node.destroy_node()
    assert result.reason == "curve.position: found 1.0; it should be a list, such as [x, y, z]"


@pytest.mark.parametrize(
    ("given", "expected"), [("1e1", [10.0] * 3), ("[1, 2, 3]", [1.0, 2.0, 3.0]), ("0.5", [0.5] * 3)]
)
def test_a_value_given_at_the_start_is_taken_in_the_same_forms(
    ros: rclpy.Context, given: str, expected: list[float]
) -> None:
    node = QuietNode(ros, "--ros-args", "-p", f"tuning.weights:={given}", "-p", "rate:=10")
    declare_spec(node, "tuning", Tuning())
    assert list(node.get_parameter("tuning.weights").value) == expected
    assert declare_rate(node) == 10.0
    node.destroy_node()


class Turning(Spec):
    """A specification with an angle and with rates."""

    target: Annotated[float, OR_DEGREES] = 0.0
    rates: Annotated[PerAxis, OR_DEGREES_PER_SECOND] = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("target", "45 deg", math.pi / 4.0),
        ("rates", "0.18 deg/s", [math.pi / 1000.0] * 3),
    ],
)
def test_angles_and_rates_are_taken_in_degrees_in_flight_and_at_the_start(
    ros: rclpy.Context, name: str, text: str, expected: float | list[float]
) -> None:
    node = QuietNode(ros)
    declare_spec(node, "turning", Turning())
    reply = node.set_parameters_atomically([Parameter(f"turning.{name}", value=text)])
    assert reply.successful, reply.reason
    assert node.get_parameter(f"turning.{name}").value == pytest.approx(expected, rel=1e-15)
    reply = node.set_parameters_atomically([Parameter(f"turning.{name}", value="45 degrees")])
    assert f'turning.{name}: found "45 degrees"' in reply.reason
    node.destroy_node()
    started = QuietNode(ros, "--ros-args", "-p", f"turning.{name}:={text}")
    declare_spec(started, "turning", Turning())
    assert started.get_parameter(f"turning.{name}").value == pytest.approx(expected, rel=1e-15)
    started.destroy_node()


def test_a_value_of_another_type_given_at_the_start_is_a_sentence(ros: rclpy.Context) -> None:
    node = QuietNode(ros, "--ros-args", "-p", "tuning.gain:=fast")
    with pytest.raises(ParameterError, match=r'tuning\.gain: found "fast"; it should be a number'):
        declare_spec(node, "tuning", Tuning())
    node.destroy_node()


def refused(flown: Flown, **values: Any) -> str:
    """The reason of a refusal, which must leave everything as it was."""
    controller, tuning = flown.controller, flown.tuning
    before = {name: value.value for name, value in flown.node.get_parameters_by_prefix("").items()}
    reply = flown.change(**values)
    after = {name: value.value for name, value in flown.node.get_parameters_by_prefix("").items()}
    assert not reply.successful
    assert (flown.controller, flown.tuning, flown.accepted) == (controller, tuning, [])
    assert before == after
    return str(reply.reason)


def test_a_gain_out_of_bounds_is_refused_by_its_name_value_and_bound(flown: Flown) -> None:
    reason = refused(flown, controller__switching_gain=[0.1, -2.5, 0.1])
    assert reason.startswith("controller.switching_gain[1]: found -2.5; it should be ")
    assert "greater than or equal to 0" in reason


def test_everything_wrong_is_said_at_once(flown: Flown) -> None:
    reason = refused(flown, controller__switching_gain=[-1.0, 0.1, -3.0])
    assert "switching_gain[0]: found -1.0" in reason
    assert "switching_gain[2]: found -3.0" in reason


def test_one_bad_gain_refuses_the_good_ones_that_come_with_it(flown: Flown) -> None:
    reason = refused(flown, controller__reaching_gain=[0.5] * 3, controller__proportional_gain=[0.0] * 3)
    assert "reaching_gain" not in reason
    assert "controller.proportional_gain[0]" in reason


@pytest.mark.parametrize("value", [[0.1, 0.1], [0.1] * 4, [float("nan")] * 3])
def test_a_gain_per_axis_needs_three_numbers(flown: Flown, value: list[float]) -> None:
    reply = flown.change(controller__switching_gain=value)
    assert not reply.successful
    assert "controller.switching_gain" in reply.reason
    assert flown.accepted == []


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"tuning__gain": -1.0}, "tuning.gain"),
        ({"tuning__gain": 0.0}, "greater than 0"),
        ({"tuning__gain": 1000.0}, "a gain of 1000 cannot fly at this step"),
        ({"tuning__level": 3.1}, "tuning.level"),
        ({"tuning__count": 2.5}, "tuning.count: found 2.5"),
        ({"tuning__gain": float("nan")}, "tuning.gain"),
    ],
)
def test_a_refusal_is_a_sentence(flown: Flown, values: dict[str, Any], words: str) -> None:
    assert words in refused(flown, **values)


@pytest.mark.parametrize("name", ["controller__kind", "tuning__mode", "scenario"])
def test_what_is_fixed_at_the_start_cannot_be_changed(flown: Flown, name: str) -> None:
    assert "read-only" in refused(flown, **{name: "pid"})


def test_a_fixed_parameter_has_its_value_and_description(flown: Flown) -> None:
    assert flown.node.get_parameter("scenario").value == "a.yaml"
    descriptor = flown.node.describe_parameter("scenario")
    assert (descriptor.read_only, descriptor.description) == (True, "path of the scenario file")


def test_a_later_change_does_not_repeat_an_earlier_reply(flown: Flown) -> None:
    flown.change(controller__switching_gain=[0.4] * 3)
    assert flown.change(tuning__gain=3.0).reason == ""


def test_the_specification_after_a_change_is_the_one_a_scenario_would_give(flown: Flown) -> None:
    flown.change(controller__boundary_layer=[0.1, 0.2, 0.3])
    again = SlidingModeSpec.model_validate(json.loads(flown.controller.model_dump_json()))
    assert again == flown.controller


class Nested(Spec):
    """A part with another part in it."""

    kind: Literal["nested"] = "nested"
    law: Tuning = Tuning()
    points: tuple[Tuning, ...] = (Tuning(),)


def test_a_part_within_a_part_is_changed_by_a_name_with_one_more_dot(flown: Flown) -> None:
    held: list[Spec] = [Nested()]
    node = flown.node

    def accept(spec: Spec, _fields: dict[str, Any]) -> str:
        held[0] = spec
        return ""

    declare_spec(node, "nested", held[0])
    on_spec_change(node, "nested", lambda: held[0], accept)
    assert not node.has_parameter("nested.points")
    result = node.set_parameters_atomically([Parameter("nested.law.weights", value=[4.0, 5.0, 6.0])])
    assert result.successful
    assert held[0] == Nested(law=Tuning(weights=(4.0, 5.0, 6.0)))
    refused = node.set_parameters_atomically([Parameter("nested.law.weights", value=[-4.0, 5.0, 6.0])])
    assert not refused.successful
    assert "nested.law.weights" in refused.reason


def test_parameters_show_a_new_target_and_are_refused_for_a_curve_of_another_kind(
    ros: rclpy.Context,
) -> None:
    plan = compile_scenario(formation([{}], 20.0))
    node = QuietNode(ros)
    satellite = Satellite(plan.satellite(0))
    changes: list[tuple[str, list[float]]] = []
    parameters = SatelliteParameters(node, plan, 0, lambda: (satellite, 7), changes)

    def set_radius(value: float) -> Any:
        return node.set_parameters_atomically([Parameter("curve.radius", value=value)])

    parameters.retarget(satellite, Target(TargetSpec(curve=CircleSpec(radius=700.0), phase_offset=5.0), 3))
    assert node.get_parameter("curve.radius").value == 700.0
    assert node.get_parameter("phase.offset").value == 5.0
    assert set_radius(800.0).reason == "takes effect at step 7"
    assert changes == [("curve.radius", [800.0])]
    parameters.retarget(satellite, Target(TargetSpec(curve=FixedPointSpec(position=(1.0, 2.0, 3.0))), 9))
    found = set_radius(900.0)
    assert not found.successful
    ellipse = EllipseSpec(first_axis=(2.0, 0.0, 0.0), second_axis=(0.0, 1.0, 0.0))
    parameters.retarget(satellite, Target(TargetSpec(curve=ellipse), 11))
    found = node.set_parameters_atomically([Parameter("curve.centre", value=[1.0, 0.0, 0.0])])
    assert not found.successful
    assert "a reconfiguration gave the satellite another kind" in found.reason
    assert satellite.plan.path.curve.point(np.asarray(0.0)).position.tolist() == [2.0, 0.0, 0.0]
    # A second target with that kind cannot be shown either, and one with the declared kind is shown again.
    parameters.retarget(satellite, Target(TargetSpec(curve=ellipse, phase_offset=6.0), 13))
    assert node.get_parameter("phase.offset").value == 6.0
    assert node.get_parameter("curve.radius").value == 800.0
    parameters.retarget(satellite, Target(TargetSpec(curve=CircleSpec(radius=650.0)), 15))
    assert node.get_parameter("curve.radius").value == 650.0
    assert set_radius(660.0).successful
    node.destroy_node()
