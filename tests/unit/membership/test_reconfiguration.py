# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""New targets at a numbered step: what satellites fly by, across losses, and what is refused."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from formations import formation
from satform.flight.compile import compile_scenario
from satform.flight.reconfiguration_progress import Arrival, ReconfigurationProgress
from satform.flight.requested_targets import requested_targets
from satform.flight.simulate import simulate
from satform.membership.absence_log import happened
from satform.membership.formation import ParameterChanged
from satform.membership.membership_manager import MembershipManager
from satform.membership.reconfiguration import Target, TargetsChanged, TargetSpec, present_targets, target_of
from satform.orbits.curve_specs import CircleSpec, FixedPointSpec
from satform.scenario import Scenario, ScenarioError, parse_scenario

SCALED: dict[str, Any] = {"at": 4.0, "targets": [{"satellite": "sat1", "scale": 1.5}]}
CIRCLE = {"kind": "circle", "radius": 700.0}
POINT = {"kind": "fixed_point", "position": [0.0, 700.0, 0.0]}
AT = 4.0
SOON = Arrival(tolerance=1.0, hold=0, timeout=None)
STEP = 8
"""At which a change after 4 s takes effect."""


def change(*targets: dict[str, Any], at: float = AT) -> dict[str, Any]:
    return {"at": at, "targets": list(targets)}


def three(*reconfigurations: dict[str, Any], **other: Any) -> Scenario:
    satellites = [{"arc_length": 100.0 * i, "position_error": [2.0 * i, 1.0, -1.0]} for i in range(3)]
    return formation(satellites, 20.0, reconfigurations=list(reconfigurations), **other)


def test_only_the_named_satellite_has_another_reference_from_the_step_on() -> None:
    whole, changed = simulate(three()), simulate(three(change({"satellite": "sat2", "curve": CIRCLE})))
    before = slice(0, STEP)
    np.testing.assert_array_equal(changed.reference_position[before], whole.reference_position[before])
    np.testing.assert_array_equal(changed.reference_position[:, [0, 2]], whole.reference_position[:, [0, 2]])
    radius = np.linalg.norm(changed.reference_position[:, 1], axis=-1)
    np.testing.assert_allclose(radius[STEP:], 700.0, rtol=1e-12)
    # The arc length per revolution stays, so that the phases of all stay comparable.
    np.testing.assert_array_equal(changed.arc_length, whole.arc_length)


def test_a_target_is_what_the_satellite_flies_that_has_it_from_the_start() -> None:
    own = three().satellite(1).curve
    there = simulate(three().with_({"satellites[sat2].curve": CIRCLE, "satellites[sat2].scale": 1.0}))
    back = simulate(
        three().with_(
            {
                "satellites[sat2].curve": CIRCLE,
                "reconfigurations": [change({"satellite": "sat2", "curve": own.model_dump(), "scale": 1.0})],
            }
        )
    )
    straight = simulate(three())
    np.testing.assert_array_equal(back.reference_position[:STEP], there.reference_position[:STEP])
    np.testing.assert_array_equal(back.reference_position[STEP:], straight.reference_position[STEP:])


def test_a_point_becomes_an_orbit_with_the_nominal_rate_at_once() -> None:
    scenario = three(change({"satellite": "sat1", "curve": CIRCLE})).with_(
        {
            "satellites[sat1].curve": POINT,
            "satellites[sat1].arc_length": 0.0,
            "nominal_motion": {"period": 6000.0},
            "graph": {"kind": "none"},
        }
    )
    record = simulate(scenario)
    nominal = 2.0 * np.pi * 700.0 / 6000.0
    assert np.all(record.rate[: STEP + 1, 0] == 0.0)
    np.testing.assert_allclose(record.rate[STEP + 1 :, 0], nominal, rtol=1e-12)
    speed = np.linalg.norm(record.reference_velocity[STEP:, 0], axis=-1)
    np.testing.assert_allclose(speed, nominal, rtol=1e-12)


@pytest.mark.parametrize("memory", ["plan", "checkpoint"])
@pytest.mark.parametrize("rejoin_at", [AT, 8.0])
def test_a_satellite_that_rejoins_flies_by_the_targets_in_force(memory: str, rejoin_at: float) -> None:
    lost = {
        "kind": "satellite_lost",
        "satellite": "sat2",
        "at": 3.0,
        "rejoin_at": rejoin_at,
        "memory": memory,
    }
    again = change({"satellite": "sat2", "phase_offset": 50.0}, at=6.0)
    scenario = three(
        change({"satellite": "sat2", "curve": CIRCLE}), again, faults=[lost], checkpoint_period=1.0
    )
    record, back = simulate(scenario), int(rejoin_at / 0.5)
    radius = np.linalg.norm(record.reference_position[back:, 1], axis=-1)
    np.testing.assert_allclose(radius, 700.0, rtol=1e-12)
    # The phase that it publishes has the offset that came meanwhile.
    jump = np.diff(record.arc_length[:, 1])[max(back, 12)]
    assert np.isfinite(record.arc_length[back:, 1]).all()
    assert (abs(jump + 50.0) < 10.0) == (rejoin_at < 6.0)


def test_a_target_stands_above_a_parameter_set_before_and_below_one_set_after() -> None:
    events = {
        STEP: [ParameterChanged(0, "curve.radius", (800.0,))],
        STEP + 4: [ParameterChanged(0, "curve.radius", (900.0,))],
    }
    scenario = three(change({"satellite": "sat1", "curve": CIRCLE})).with_(
        {"satellites[sat1].curve": {"kind": "circle", "radius": 600.0}}
    )
    radius = np.linalg.norm(simulate(scenario, events=events).reference_position[:, 0], axis=-1)
    np.testing.assert_allclose(radius[:STEP], 600.0, rtol=1e-12)
    np.testing.assert_allclose(radius[STEP : STEP + 4], 700.0, rtol=1e-12)
    np.testing.assert_allclose(radius[STEP + 4 :], 900.0, rtol=1e-12)


def test_a_target_leaves_what_was_set_of_the_fields_that_it_does_not_give() -> None:
    events: dict[int, list[Any]] = {
        4: [ParameterChanged(0, "phase.offset", (100.0,)), ParameterChanged(0, "curve.radius", (800.0,))],
        12: [TargetsChanged({0: TargetSpec()}, "cancelled", whole=True)],
        14: [ParameterChanged(0, "curve.radius", (900.0,))],
        16: [TargetsChanged({0: TargetSpec(curve=CircleSpec(radius=700.0))}, "by an action")],
        18: [ParameterChanged(0, "curve.radius", (900.0,))],
        20: [TargetsChanged({0: TargetSpec(curve=CircleSpec(radius=700.0))}, "the same again")],
    }
    start = three().with_({"satellites[sat1].curve": {"kind": "circle", "radius": 600.0}})
    record = simulate(start.with_({"reconfigurations": [SCALED]}), events=events)
    radius = np.linalg.norm(record.reference_position[:, 0], axis=-1)
    flown = [
        (0, 4, 600.0),
        (4, 14, 800.0),
        (14, 16, 900.0),
        (16, 18, 700.0),
        (18, 20, 900.0),
        (20, 24, 700.0),
    ]
    for first, after, expected in flown:
        np.testing.assert_allclose(radius[first:after], expected, rtol=1e-12)
    # The published phase leads by the offset from step 4 on, whatever target comes.
    jumps = np.abs(np.diff(record.arc_length[:, 0]))
    assert jumps[4] > 80.0
    assert jumps[6:].max() < 20.0
    speed = np.linalg.norm(record.reference_velocity[:, 0], axis=-1) / record.rate[:-1, 0]
    # Metres along the curve per metre of generalised arc length.
    np.testing.assert_allclose(speed[4:STEP], 800.0 / 600.0, rtol=1e-9)
    np.testing.assert_allclose(speed[STEP:12], 1.5, rtol=1e-9)
    np.testing.assert_allclose(speed[12:14], 800.0 / 600.0, rtol=1e-9)


def test_fields_left_out_are_as_before_and_a_cancel_brings_back_the_former_ones() -> None:
    plan = three(
        change({"satellite": "sat1", "curve": CIRCLE, "scale": 2.0}),
        change({"satellite": "sat1", "phase_offset": 5.0}, at=5.0),
        change({"satellite": "sat1", "curve": POINT}, at=6.0),
    ).membership_plan()
    manager = MembershipManager(plan)
    seen = {}
    for step in range(20):
        manager.begin(step)
        manager.close()
        seen[step] = dict(manager.formation.targets)
    assert seen[STEP - 1] == {}
    circle = TargetSpec(curve=CircleSpec(radius=700.0), scale=2.0)
    both, phase = frozenset({"curve", "scale"}), frozenset({"phase_offset"})
    assert seen[STEP][0] == Target(circle, STEP, both)
    assert seen[10][0] == Target(circle.model_copy(update={"phase_offset": 5.0}), 10, phase)
    # The scale was that of the circle.
    assert seen[12][0].spec == TargetSpec(curve=FixedPointSpec(position=(0.0, 700.0, 0.0)), phase_offset=5.0)
    former = present_targets(seen[STEP], {0: None, 1: None})
    manager.begin(20)
    manager.schedule(TargetsChanged(former, "cancelled", whole=True))
    manager.close()
    assert manager.formation.targets[0] == Target(circle, 20, both | phase)
    assert manager.formation.targets[1] == Target(TargetSpec(), 20)


def test_targets_of_the_next_step_are_those_planned_for_it_and_those_scheduled_after_them() -> None:
    planned = change({"satellite": "sat1", "curve": CIRCLE}, {"satellite": "sat2", "scale": 2.0})
    manager = MembershipManager(three(planned).membership_plan())
    manager.begin(STEP - 1)
    assert manager.next_targets == {}
    manager.close()
    phase = frozenset({"scale", "phase_offset"})
    circle = Target(TargetSpec(curve=CircleSpec(radius=700.0)), STEP, frozenset({"curve"}))
    assert manager.next_targets == {0: circle, 1: Target(TargetSpec(scale=2.0), STEP, frozenset({"scale"}))}
    assert manager.schedule(TargetsChanged({1: TargetSpec(phase_offset=5.0)}, "asked for")) == STEP
    both = {0: circle, 1: Target(TargetSpec(scale=2.0, phase_offset=5.0), STEP, phase)}
    assert manager.next_targets == both
    assert manager.formation.targets == {}
    manager.begin(STEP)
    assert manager.next_targets == both
    manager.close()
    assert manager.formation.targets == manager.next_targets == both


def test_what_a_bag_has_beside_the_plan_is_flown_again() -> None:
    plan = three(change({"satellite": "sat1", "curve": CIRCLE})).membership_plan()
    own = TargetSpec(curve=CircleSpec(radius=700.0))
    other = TargetSpec(phase_offset=3.0)

    def status(version: int, step: int, **targets: tuple[TargetSpec, int, str]) -> SimpleNamespace:
        carried = [
            SimpleNamespace(satellite=satellite, since=since, target=spec.to_text(), fields=[name])
            for satellite, (spec, since, name) in targets.items()
        ]
        edges = np.nonzero(plan.graph.adjacency)
        return SimpleNamespace(
            version=version,
            step=step,
            lost=[],
            rejoined=[],
            rejoin_checkpoints=[],
            targets=carried,
            edge_receivers=edges[0].tolist(),
            edge_senders=edges[1].tolist(),
            reason="by an action",
        )

    statuses = [
        status(1, STEP, sat1=(own, STEP, "curve")),
        status(2, 15, sat1=(own, STEP, "curve"), sat3=(other, 15, "phase_offset")),
        status(3, 20, sat1=(TargetSpec(), 20, "curve"), sat3=(other, 15, "phase_offset")),
    ]

    def changed(index: int, spec: TargetSpec, name: str) -> TargetsChanged:
        return TargetsChanged({index: spec}, "by an action", whole=True, fields={index: frozenset({name})})

    found = happened(statuses, [], plan)
    assert found == {
        15: [changed(2, other, "phase_offset")],
        20: [changed(0, TargetSpec(), "curve")],
    }
    assert target_of(own.to_text()) == own


def test_progress_counts_distance_delta_v_and_the_steps_within_the_tolerance() -> None:
    plan = compile_scenario(three())
    targets = {1: TargetSpec(curve=FixedPointSpec(position=(0.0, 700.0, 0.0)))}
    progress = ReconfigurationProgress(plan, targets, 10, Arrival(tolerance=1.0, hold=2, timeout=50))
    position, applied = np.zeros((3, 3)), np.full((3, 3), 0.1)
    alive = np.array([True, True, True])
    progress.update(9, position, applied, [0.0], alive)
    assert np.isnan(progress.distance[0])
    progress.update(10, position, applied, [0.0], alive)
    assert progress.distance.tolist() == [700.0]
    assert progress.delta_v.tolist() == [0.0]
    position[1, 1] = 525.0
    progress.update(11, position, applied, [0.0], alive)
    assert progress.fraction == pytest.approx(0.75)
    assert progress.delta_v[0] == pytest.approx(0.1 * np.sqrt(3.0) * 0.5)
    position[1, 1] = 699.5
    for step, reached in [(12, False), (13, False), (14, True)]:
        progress.update(step, position, applied, [0.0], alive)
        assert progress.reached is reached
    progress.update(60, position, applied, [0.0], np.array([True, False, True]))
    assert progress.timed_out
    assert not progress.reached
    assert np.isnan(progress.distance[0])


def test_within_the_tolerance_is_all_of_the_way() -> None:
    plan = compile_scenario(three())
    point = FixedPointSpec(position=(0.0, 700.0, 0.0))
    progress = ReconfigurationProgress(plan, dict.fromkeys((0, 1), TargetSpec(curve=point)), 10, SOON)
    alive, applied = np.ones(3, dtype=np.bool_), np.zeros((3, 3))
    for step, first, second, fraction in [
        (10, 100.0, 1e-3, 0.0),
        (11, 25.0, 0.5, 0.75),
        (12, 0.1, 0.01, 1.0),
    ]:
        position = np.array([[0.0, 700.0 - first, 0.0], [0.0, 700.0 + second, 0.0], [0.0, 0.0, 0.0]])
        progress.update(step, position, applied, [0.0, 0.0], alive)
        assert progress.fraction == pytest.approx(fraction)
        assert progress.reached is (fraction == 1.0)


def test_a_target_is_checked_with_the_curve_and_the_scale_that_are_flown() -> None:
    small, huge = {"satellite": "sat1", "scale": 1e-14}, {"kind": "circle", "radius": 9e14}
    data = json.loads(three().with_({"satellites[sat1].curve": POINT}).to_json())
    changes = [change(small, at=6.0), change({"satellite": "sat1", "curve": CIRCLE})]
    with pytest.raises(ScenarioError) as refused:
        parse_scenario(json.dumps({**data, "reconfigurations": changes}), "test.yaml")
    (problem,) = refused.value.problems
    assert problem.field.startswith("reconfigurations[0].targets[0]")
    assert "generalised arc length" in problem.sentence
    # A point has no period, so that the scale does not matter.
    plan = compile_scenario(parse_scenario(json.dumps(data), "test.yaml")).reconfiguration
    assert requested_targets(plan, ["sat1"], ["{scale: 1e-14}"], {}) == {0: TargetSpec(scale=1e-14)}
    present = {0: Target(TargetSpec(curve=CircleSpec(radius=700.0)), 3)}
    with pytest.raises(ValueError, match="generalised arc length"):
        requested_targets(plan, ["sat1"], ["{scale: 1e-14}"], present)
    # Its period stays that of the scenario's orbit.
    wide = {"limits": {"distance": 1e15}}
    assert three(change({"satellite": "sat2", "curve": huge}), **wide).reconfigurations
    with pytest.raises(ValueError, match="generalised arc length"):
        three(change({"satellite": "sat2", "curve": huge, "scale": 1.0}), **wide)


@pytest.mark.parametrize(
    ("entry", "field", "sentence"),
    [
        (change({"satellite": "sat2", "curve": CIRCLE}, at=0.0), "at", "greater than 0"),
        (change({"satellite": "sat2", "curve": CIRCLE}, at=1e-12), "at", "is the first step"),
        (change({"satellite": "sat2", "curve": CIRCLE}, at=20.0), "at", "not earlier than the flight's end"),
        (
            change({"satellite": "sat4", "curve": CIRCLE}),
            "targets[0]",
            "there is no satellite sat4; there are",
        ),
        (change({"satellite": "sat2"}), "targets[0]", "nothing changes for sat2: give a curve"),
        (change(), "targets", "at least 1"),
        (change(*[{"satellite": "sat2", "scale": 2.0}] * 2), "", "sat2 has two targets"),
        (change({"satellite": "sat2", "scale": 1e-14}), "targets[0]", "generalised arc length"),
        (change({"satellite": "sat2", "curve": {"kind": "circle"}}), "radius", "is missing"),
        (
            change({"satellite": "sat2", "curve": {"kind": "fixed_point", "position": [1e15, 0.0, 0.0]}}),
            "targets[0]",
            "sat2 leads 1e+15 m from the chief, beyond the limit of 1e+07 m (limits.distance)",
        ),
    ],
)
def test_what_is_no_reconfiguration_is_refused_in_a_sentence(
    entry: dict[str, Any], field: str, sentence: str
) -> None:
    data = {**json.loads(three().to_json()), "reconfigurations": [entry]}
    with pytest.raises(ScenarioError) as refused:
        parse_scenario(json.dumps(data), "test.yaml")
    (problem,) = refused.value.problems
    assert problem.field.startswith("reconfigurations[0]")
    assert field in problem.field
    assert sentence in problem.sentence


@pytest.mark.parametrize(
    ("satellites", "texts", "sentence"),
    [
        ([], [], "no satellites"),
        (["sat1"], [], "1 satellites and 0 targets"),
        (["sat9"], ["{scale: 2.0}"], "there is no satellite sat9"),
        (["sat1"], ["{scale: -2.0}"], "the target of sat1: scale"),
        (["sat1"], ["{scale: ["], "the target of sat1"),
        (["sat1"], ["{curve: {kind: inertial_point, position: [1.0, 2.0, 3.0]}}"], "an inertial_point"),
        (["sat1"], ["{curve: {kind: circle, radius: 6.0e6, centre: [0.0, 6.0e6, 0.0]}}"], "beyond the limit"),
        (["sat1"], ["7"], "has to be fields with values"),
        (["sat1"], ["{}"], "the target of sat1: nothing changes for sat1"),
        (["sat1"], ["{curve: {}}"], "the target of sat1: curve: needs a `kind:`, one of circle, "),
        (
            ["sat1"],
            ["{curve: {kind: circle, radiu: 1.0}}"],
            "curve.radiu: there is no such field; did you mean radius?",
        ),
        (["sat1"], ["{satellite: sat2, scale: 2.0}"], "a field satellite"),
        (["sat1"], ["{colour: red}"], "colour"),
        (["sat1"], ["x" * 10_001], "10001 characters"),
        (["sat1", "sat1"], ["{scale: 2.0}"] * 2, "sat1 has two targets"),
    ],
)
def test_what_cannot_be_asked_for_in_flight_is_refused_in_a_sentence(
    satellites: list[str], texts: list[str], sentence: str
) -> None:
    plan = compile_scenario(three()).reconfiguration
    with pytest.raises(ValueError, match=r"\w") as refused:
        requested_targets(plan, satellites, texts, {})
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_is_asked_for_in_flight_is_a_target_as_in_a_scenario() -> None:
    plan = compile_scenario(three()).reconfiguration
    found = requested_targets(
        plan, ["sat3", "sat1"], ["{curve: {kind: circle, radius: 7e2}}", '{"scale": 2}'], {}
    )
    assert found == {2: TargetSpec(curve=CircleSpec(radius=700.0)), 0: TargetSpec(scale=2.0)}


def test_a_shorter_flight_leaves_out_what_lies_beyond_its_end_and_the_digest_counts_the_rest() -> None:
    longer = three(change({"satellite": "sat2", "curve": CIRCLE}))
    shorter = longer.with_({"timing.duration": 3.0})
    assert shorter.reconfigurations == ()
    assert shorter.digest() == three().with_({"timing.duration": 3.0}).digest()
    assert longer.digest() != three().digest()
