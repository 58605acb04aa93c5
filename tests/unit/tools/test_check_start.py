# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What `check` says of a start and of times that cannot be flown as they are written."""

import re
from typing import Any

import pytest

from flights import shipped
from satform.flight.simulate import simulate
from satform.scenario import Scenario, ScenarioError, parse_scenario
from satform_tools import check

TWO_ON_A_CIRCLE = """
name: two
title: two
text: two
orbit: {period: 6000.0}
timing: {step: 10.0, duration: 1000.0}
dynamics: {kind: cw}
graph: {kind: complete}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {period: 6000.0}
satellite_defaults: {controller: {kind: feedback_linearisation}}
satellites:
  - {name: a, curve: {kind: circle, radius: 1000.0}}
  - {name: b, curve: {kind: circle, radius: 1000.0}, arc_length: ARC}
"""
LAP = 6283.185307179586


def two(arc_length: float, *changes: str) -> Scenario:
    return parse_scenario(TWO_ON_A_CIRCLE.replace("ARC", str(arc_length)), changes=changes)


def warnings(scenario: Scenario, about: str) -> list[str]:
    return [warning for warning in check.warnings(scenario) if about in warning]


@pytest.mark.parametrize("laps", [0, 1, -2])
def test_two_satellites_in_one_place_are_named_however_many_periods_their_phases_are_apart(laps: int) -> None:
    (said,) = warnings(two(laps * LAP), "start at the same position")
    assert said == "satellites: a and b start at the same position, (0, 1000, 0) m"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            "satellites.1.velocity_error=[3.0e4, 0.0, 0.0]",
            "velocity of b is 3e+04 m/s at step 0 (0 s)",
        ),
        ("satellites.1.position_error=[-1.0e6, 0.0, 0.0]", "altitude of b is -2."),
    ],
)
def test_a_start_beyond_a_limit_is_said_to_end_the_flight_at_once(change: str, said: str) -> None:
    beyond = two(0.5 * LAP, change)
    (found,) = warnings(beyond, "limits: ")
    assert said in found
    assert found.endswith("the flight ends before its first command")
    assert simulate(beyond).steps == 0
    assert not warnings(two(0.5 * LAP), "limits: ")


def test_satellites_that_exchange_nothing_may_share_a_place_to_be_compared() -> None:
    assert not warnings(two(0.0, "graph={kind: none}"), "start at the same position")


@pytest.mark.parametrize(
    ("arc_length", "nearer"), [(LAP, 0.0), (0.75 * LAP, -0.25 * LAP), (-1.9 * LAP, 0.1 * LAP)]
)
def test_a_phase_that_is_more_than_half_a_period_away_is_named_with_the_nearer_one(
    arc_length: float, nearer: float
) -> None:
    (said,) = warnings(two(arc_length), "phases of a and b")
    assert f"{abs(arc_length) / LAP:.4g} of a period of 6283.19 m" in said
    assert f"an arc_length of {nearer:.10g} m b" in said
    # What it proposes is nothing to be warned of.
    assert not warnings(two(nearer), "phases of a and b")


@pytest.mark.parametrize("changes", [(), ("satellites.1.phase_offset=4000.0",)])
def test_half_a_period_of_phase_is_as_far_as_phases_may_be_apart(changes: tuple[str, ...]) -> None:
    # A satellite that is to lead the others by as much as it does has their phase.
    assert not warnings(two(4000.0 if changes else 0.5 * LAP, *changes), "phases of a and b")


def test_a_start_within_the_safe_distance_is_named() -> None:
    (said, *_) = warnings(
        shipped("directed_triangle_close", "satellites.0.position_error=[5.0, 0.0, 0.0]"), "safe_distance"
    )
    assert said.startswith("satellites: sat1 starts ")
    assert not warnings(shipped("directed_triangle_close"), "safe_distance")


def test_satellites_that_follow_each_other_from_one_place_cannot_fly() -> None:
    with pytest.raises(ScenarioError, match="starts in the same place as sat2, which it follows"):
        shipped(
            "directed_triangle",
            "satellites.0.curve={kind: fixed_point, position: [1.0, 2.0, 3.0]}",
            "satellites.1.curve={kind: fixed_point, position: [0.0, 2.0, 3.0]}",
            "satellites.1.position_error=[1.0, 0.0, 0.0]",
            "satellites.0.position_error=[0.0, 0.0, 0.0]",
            "expect=[]",
        )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("satellites.1.curve={kind: circle, radius: 1.0e-200}", "semi-axes of 1e-200 and 1e-200 m"),
        ("satellites.1.scale=1.0e-300", "is 6.28319e+303 m of generalised arc length"),
        ("satellite_defaults.scale=1.0e-13", "a period of satellite a"),
    ],
)
def test_a_reference_that_is_no_finite_motion_cannot_fly(change: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(said)):
        two(100.0, change)


def test_a_wheel_that_starts_beyond_its_limit_is_named() -> None:
    fast = "satellite_defaults.attitude.wheel_speed=[0.0, 20.0, 0.0]"
    place = "satellites.0.attitude.wheel_speed=[0.0, 20.0, 0.0]"
    limited = shipped("attitude_limited_wheels")
    change = fast if limited.satellite_defaults.attitude is not None else place
    # Half a kg m^2 at 20 rad/s is 10 N m s of the wheel itself.
    (said,) = warnings(shipped("attitude_limited_wheels", change), "wheel_momentum_limit")
    assert "beyond its wheel_momentum_limit of 8 N m s" in said


SCHEDULED: dict[str, Any] = {
    "burns": "satellite_defaults.controller={kind: timed_burns, burns: "
    "[{time: TIME, velocity_change: [1, 0, 0]}]}",
    "start": "satellite_defaults.controller={kind: impulsive_guidance, start_time: TIME, waypoints: "
    "[{position: [0, 500, 0], duration: 200.0}]}",
    "waypoint": "satellite_defaults.controller={kind: impulsive_guidance, waypoints: "
    "[{position: [0, 500, 0], duration: TIME}]}",
    "graph": "graph_schedule=[{at: TIME, graph: {kind: none}}]",
    "target": "reconfigurations=[{at: TIME, targets: [{satellite: a, phase_offset: 1.0}]}]",
    "fault": "faults=[{kind: clock_offset, satellite: a, at: TIME, offset: 1.0}]",
    "until": "faults=[{kind: clock_offset, satellite: a, at: 10.0, until: TIME, offset: 1.0}]",
    "rejoin": "faults=[{kind: satellite_lost, satellite: a, at: 10.0, rejoin_at: TIME, memory: plan}]",
    "checkpoint": "checkpoint_period=TIME",
    "delay": "links={default: {delay: TIME}}",
    "period": "links={default: {period: TIME}}",
    "outage": "links={default: {outages: [{begin: TIME, end: 900.0}]}}",
    "expectation": "expect=[{kind: tracking_error_at, at: TIME, below: 1.0, source: test}]",
}


@pytest.mark.parametrize(
    ("what", "time", "said"),
    [
        ("burns", 123.0, "burns[0].time: 123 s is flown from 120 s to 130 s, its middle at 125 s"),
        ("burns", 120.0, "burns[0].time: 120 s is flown from 120 s to 130 s, its middle at 125 s"),
        ("start", 123.0, "controller.start_time: 123 s is rounded to 120 s"),
        ("waypoint", 127.0, "waypoints[0].duration: 127 s is rounded to 130 s"),
        (
            "graph",
            121.0,
            "graph_schedule[0].at: 121 s is between two steps; it takes effect at the next",
        ),
        ("target", 121.0, "reconfigurations[0].at: 121 s is between two steps; it takes effect at the next"),
        (
            "fault",
            121.0,
            "faults[0].at: 121 s is between two steps; it takes effect at the next one, at 130 s",
        ),
        ("rejoin", 121.0, "faults[0].rejoin_at: 121 s is between two steps; it takes effect at the next one"),
        ("until", 121.0, "faults[0].until: 121 s is between two steps"),
        ("checkpoint", 127.0, "checkpoint_period: 127 s is rounded to 130 s"),
        ("delay", 21.0, "links.default.delay: a delay of 21 s ends at the next step, after 30 s"),
        ("period", 27.0, "links.default.period: 27 s is rounded to 30 s"),
        ("outage", 121.0, "links.default.outages[0].begin: 121 s is between two steps"),
        ("expectation", 127.0, "expect[0].at: 127 s is evaluated at the step at 130 s"),
    ],
)
def test_a_time_that_is_rounded_to_steps_is_said_with_what_becomes_of_it(
    what: str, time: float, said: str
) -> None:
    found = warnings(two(100.0, SCHEDULED[what].replace("TIME", str(time))), said)
    assert len(found) == 1


@pytest.mark.parametrize("what", sorted(SCHEDULED))
def test_a_time_on_a_step_is_not_said_to_be_rounded(what: str) -> None:
    # Of a burn it is the middle that is on time.
    exact = two(100.0, SCHEDULED[what].replace("TIME", "125.0" if what == "burns" else "130.0"))
    rounded = ("between two steps", "is flown", "is rounded to", "next step", "is evaluated at")
    assert not [said for said in check.warnings(exact) if any(words in said for words in rounded)]


@pytest.mark.parametrize(
    ("what", "time", "said"),
    [
        ("burns", 1001.0, "burns[0].time: 1001 s is after the flight's end at 1000 s; it is never flown"),
        (
            "start",
            1000.0,
            "start_time: 1000 s is after the flight's end at 1000 s; the tour is not",
        ),
        ("start", 810.0, "waypoints[0]: is reached at 1010 s, after the flight's end at 1000 s"),
        # The burn that stops at the way-point is held over the step that begins there.
        ("waypoint", 1000.0, "waypoints[0]: is reached at 1000 s, after the flight's end at 1000 s"),
        ("until", 1010.0, "faults[0].until: 1010 s is after the flight's end at 1000 s"),
        (
            "checkpoint",
            1010.0,
            "checkpoint_period: 1010 s, but the flight lasts 1000 s: no",
        ),
        ("delay", 1000.0, "links.default.delay: 1000 s, but the flight lasts 1000 s: no message arrives"),
        (
            "period",
            1000.0,
            "links.default.period: 1000 s, but the flight lasts 1000 s: only",
        ),
    ],
)
def test_what_the_flight_ends_before_is_said(what: str, time: float, said: str) -> None:
    assert len(warnings(two(100.0, SCHEDULED[what].replace("TIME", str(time))), said)) == 1


def test_a_sensor_that_is_later_than_the_flight_is_said() -> None:
    late = two(100.0, "satellites.1.sensor={latency: 1000.0}")
    (said,) = warnings(late, "sensor.latency")
    assert said.endswith("b has its first measurement only")


def test_of_many_sentences_of_one_kind_the_first_are_said_and_the_others_counted() -> None:
    burns = ", ".join(f"{{time: {10.0 * burn}, velocity_change: [0, 0, 0]}}" for burn in range(20))
    many = two(100.0, f"satellite_defaults.controller={{kind: timed_burns, burns: [{burns}]}}")
    found = warnings(many, "")
    assert len(warnings(many, "its middle at")) == 8
    assert "timing: and 12 more like the last one" in found
