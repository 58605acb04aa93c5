# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight ends at the first step with a quantity that is not finite or beyond its limit, and says which."""

import json
import math
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from satform_msgs.msg import Command

from flights import shortened
from satform.common.exit_codes import EXIT_ENDED_EARLY
from satform.control.protocol import Motion
from satform.evaluation.evaluate import judge
from satform.flight.compile import limit_plan
from satform.flight.limits import QUANTITIES, LimitCheck, Violation
from satform.flight.satellite import Satellite
from satform.flight.satellite_step import Decision
from satform.flight.simulate import simulate
from satform.orbits.path_reference import Reference
from satform.record.archive import RECORD, load_record
from satform.record.early_end import EarlyEnd
from satform.scenario import Scenario, ScenarioError
from satform_tools.cli import main as cli
from satform_tools.run import output_folders

EARTH_RADIUS = 6378137.0
GRAVITATIONAL_PARAMETER = 3.986004418e14
UNSTABLE = "satellite_defaults.controller.reaching_gain=5.0"
"""With steps of 0.5 s a reaching gain is unstable above 4 1/s: a step overshoots by more than the error."""


def first_beyond(series: Any, limit: float) -> tuple[int, int]:
    """The first row of (K, N, 3) in which a vector is longer than a limit, and its column."""
    rows, columns = np.nonzero(np.linalg.norm(series, axis=-1) > limit)
    return int(rows[0]), int(columns[0])


@pytest.mark.parametrize(
    ("limit", "series", "quantity", "of_the_truth"),
    [
        ("distance", "position", "position", True),
        ("speed", "velocity", "velocity", True),
        ("acceleration", "acceleration", "commanded acceleration", False),
    ],
)
@pytest.mark.parametrize("together", [True, False], ids=["stacked", "one by one"])
def test_a_flight_ends_at_the_first_step_beyond_a_limit(
    limit: str, series: str, quantity: str, of_the_truth: bool, together: bool
) -> None:
    names = ("distance", "speed", "acceleration")
    none = [f"limits.{name}=1e15" for name in names]
    free = simulate(shortened("triangle", 10.0, UNSTABLE, *none))
    assert free.early_end is None
    lengths = np.linalg.norm(getattr(free, series), axis=-1)
    bound = float(f"{1.01 * lengths[:8].max():.3g}")
    step, satellite = first_beyond(getattr(free, series), bound)
    assert step >= 8
    scenario = shortened("triangle", 10.0, UNSTABLE, *none, f"limits.{limit}={bound}")
    record = simulate(scenario, stacked=together)
    end = record.early_end
    assert end is not None
    assert (end.step, end.time, end.satellite) == (step, 0.5 * step, f"sat{satellite + 1}")
    assert (end.quantity, end.limit) == (quantity, bound)
    assert end.value == pytest.approx(lengths[step, satellite], rel=1e-12)
    assert "unstable at these gains" in end.cause
    # What is beyond the limit is no part of the record; what came before has the same bits.
    assert record.steps == step - of_the_truth
    assert record.differences(free.first(record.steps)) == [
        f"end of the flight: {end.sentence}; and its last step"
    ]


def test_a_satellite_that_falls_ends_the_flight_when_it_hits_the_ground() -> None:
    """Kepler: from its apogee at the chief's place a satellite that is too slow falls to the ground."""
    step, slower = 5.0, 700.0
    scenario = shortened(
        "triangle",
        3000.0,
        f"timing.step={step}",
        "dynamics={kind: inertial, gravity: {degree: 0, order: 0}}",
        "satellite_defaults.controller={kind: coast}",
        "satellites=[{name: faller, curve: {kind: fixed_point, position: [0, 0, 0]}, "
        f"velocity_error: [0, -{slower}, 0]}}]",
        "nominal_motion={rate: 0.0}",
    )
    rate = 2.0 * math.pi / 6000.0
    radius = (GRAVITATIONAL_PARAMETER / rate**2) ** (1.0 / 3.0)
    speed = radius * rate - slower
    axis = 1.0 / (2.0 / radius - speed**2 / GRAVITATIONAL_PARAMETER)
    eccentricity = radius / axis - 1.0
    # Eccentric anomaly on the ground, counted from the apogee.
    anomaly = math.pi - math.acos((1.0 - EARTH_RADIUS / axis) / eccentricity)
    fall = (anomaly + eccentricity * math.sin(anomaly)) * math.sqrt(axis**3 / GRAVITATIONAL_PARAMETER)
    end = simulate(scenario).early_end
    assert end is not None
    assert (end.satellite, end.quantity, end.step) == ("faller", "altitude", math.ceil(fall / step))
    assert -step * speed < end.value < 0.0
    assert "below the limit of 0 m" in end.sentence
    higher = simulate(
        scenario.model_copy(update={"limits": scenario.limits.model_copy(update={"altitude": 3e5})})
    )
    assert higher.early_end is not None
    assert higher.early_end.step < end.step


def test_a_filter_without_a_covariance_is_named_and_no_control_law() -> None:
    """Variances of 1e24 m^2 and 1e-18 m^2 in one matrix leave no digit of the smaller one."""
    record = simulate(
        shortened(
            "gnss_differential_pair",
            100.0,
            "satellite_defaults.navigation.initial_position_error=1e12",
            "satellites.1.sensors.1.position_noise=1e-9",
        )
    )
    end = record.early_end
    assert end is not None
    assert (end.satellite in ("chief", "deputy"), end.quantity) == (True, "estimated position")
    assert "a filter that diverges or whose covariance is lost" in end.sentence


def test_a_satellite_in_the_middle_of_the_earth_does_not_fly_at_all() -> None:
    at_the_centre = "satellites.0.position_error=[-7136635, 0, 0]"
    record = simulate(
        shortened("triangle", 10.0, "satellite_defaults.controller={kind: coast}", at_the_centre)
    )
    assert record.steps == 0
    assert record.early_end is not None
    assert (record.early_end.quantity, record.early_end.step) == ("altitude", 0)


def test_the_altitude_is_not_asked_for_on_a_printed_orbit_below_the_ground() -> None:
    assert simulate(shortened("triangle_printed", 1.0)).early_end is None


def test_a_lowest_altitude_above_the_chief_s_orbit_is_refused_with_its_field() -> None:
    with pytest.raises(
        ScenarioError, match=r"limits\.altitude: no flight can stay above 900000 m"
    ) as refused:
        shortened("triangle", 10.0, "limits.altitude=9e5")
    assert "758498 m high" in str(refused.value)


class Broken:
    """Computes in one step what is not finite, in the place of one quantity of one satellite."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, step: int, spoil: Any) -> None:
        act = Satellite.act

        def spoilt(satellite: Satellite, *given: Any) -> Decision:
            begin = satellite.state.step
            decision = act(satellite, *given)
            return spoil(decision) if begin == step else decision

        monkeypatch.setattr(Satellite, "act", spoilt)


def test_a_command_that_is_not_finite_ends_the_flight_before_it_is_flown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def spoil(decision: Decision) -> Decision:
        acceleration = decision.acceleration.copy()
        acceleration[1, 2] = np.nan
        return replace(decision, acceleration=acceleration)

    scenario = shortened("triangle", 10.0)
    whole = simulate(scenario)
    Broken(monkeypatch, 7, spoil)
    record = simulate(scenario)
    assert record.steps == 7
    assert np.isfinite(record.position).all()
    assert record.position.tobytes() == whole.position[:8].tobytes()
    end = record.early_end
    assert end is not None
    assert (end.satellite, end.quantity, end.step) == ("sat2", "commanded acceleration", 7)
    assert math.isnan(end.value)
    assert "is not finite at step 7 (3.5 s)" in end.sentence


def test_a_law_that_divides_by_zero_ends_the_flight_with_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def spoil(decision: Decision) -> Decision:
        raise ZeroDivisionError("float division by zero")

    Broken(monkeypatch, 7, spoil)
    record = simulate(shortened("triangle", 10.0))
    assert record.steps == 7
    assert record.early_end is not None
    assert record.early_end.sentence == (
        "commanded acceleration of sat1 is not finite at step 7 (3.5 s); likely cause: a control law that "
        "divides by zero or overflows here"
    )


def decision(**spoilt: Any) -> tuple[Decision, Any]:
    """What two stacked satellites compute, and announce, of which something is replaced."""
    one = (
        {name: np.ones((2, 3)) for name in (*"prvabst", "pe", "ve")} | {"announced": np.ones((2, 2))} | spoilt
    )
    computed = Decision(
        acceleration=one["a"],
        reference=Reference(position=one["p"], velocity=one["v"], acceleration=one["r"]),
        sliding_variable=one["s"],
        motion=Motion(one["pe"], one["ve"]),
        wheel_torque=one["t"],
    )
    return computed, one["announced"]


NAMES = ("pe", "ve", "p", "v", "r", "s", "a", "t", "announced")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize(("number", "name"), list(enumerate(NAMES, start=1)))
def test_everything_that_a_satellite_computes_is_checked(number: int, name: str, value: float) -> None:
    check = LimitCheck(limit_plan(shortened("triangle", 10.0)))
    width = 2 if name == "announced" else 3
    values = np.ones((2, width))
    values[1, -1] = value
    assert check.of_decision(*decision()) == {}
    (row, violation), *others = check.of_decision(*decision(**{name: values})).items()
    assert (row, violation.number, others) == (1, number, [])
    assert math.isnan(violation.value) if not math.isfinite(value) else violation.value == value


def test_a_command_message_numbers_the_quantities_as_the_library_does() -> None:
    constants = {
        "ESTIMATED_POSITION": "estimated position",
        "ESTIMATED_VELOCITY": "estimated velocity",
        "REFERENCE_POSITION": "reference position",
        "REFERENCE_VELOCITY": "reference velocity",
        "REFERENCE_ACCELERATION": "reference acceleration",
        "SLIDING_VARIABLE": "sliding variable",
        "COMMANDED_ACCELERATION": "commanded acceleration",
        "COMMANDED_WHEEL_TORQUE": "commanded wheel torque",
        "ANNOUNCEMENT": "announced phase or motion",
    }
    assert Command.NONE == 0
    numbers = {getattr(Command, constant): name for constant, name in constants.items()}
    assert numbers == {number: quantity.name for number, quantity in enumerate(QUANTITIES, start=1)}


def test_of_several_violations_in_one_step_the_first_satellites_counts() -> None:
    check = LimitCheck(limit_plan(shortened("triangle", 10.0)))
    end = check.computed_end({2: Violation(1, math.nan), 1: Violation(7, 2e4)}, 12)
    assert end is not None
    assert (end.satellite, end.quantity, end.step, end.time) == ("sat2", "commanded acceleration", 12, 6.0)
    assert check.computed_end({}, 12) is None


EXPECT = (
    "expect=[{kind: control, below: 1e9, source: a test}, "
    "{kind: distance, satellites: [sat1, sat2], statistic: minimum, above: 1.0, before: 3.0, "
    "source: a test}, "
    "{kind: arc_length_spread, at: 3.5, below: 1e9, source: a test}, "
    "{kind: arc_length_spread, at: 5.0, below: 1e9, source: a test}]"
)


def test_of_a_flight_that_ended_early_only_those_figures_are_judged_that_it_has() -> None:
    scenario = shortened("triangle", 500.0, UNSTABLE, EXPECT)
    record = simulate(scenario)
    assert record.steps == 9
    verdicts = judge(scenario.expect, record)
    assert [verdict.met for verdict in verdicts] == [False, True, True, False]
    assert [math.isnan(verdict.figure) for verdict in verdicts] == [True, False, False, True]


def test_a_diverging_flight_in_one_process_ends_with_4_and_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    options = [word for change in (UNSTABLE, "timing.duration=500.0", EXPECT) for word in ("--set", change)]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        code = cli.main(["run", "triangle", "--mode", "inprocess", "--out", str(run), *options])
    assert code == EXIT_ENDED_EARLY == 4
    assert caught == []
    printed = capsys.readouterr()
    assert "RuntimeWarning" not in printed.err
    assert "ENDED EARLY after step 9 of 1000: commanded acceleration of sat1 is" in printed.out
    assert "2 of 4 expectations missed" in printed.out
    result = json.loads((run / output_folders.RESULT).read_text())
    assert (result["exit_code"], result["steps"], result["complete"], result["judged"]) == (4, 9, False, True)
    kept = load_record(run / RECORD)
    assert kept.digest() == result["state_hash"]
    assert kept.early_end is not None
    assert result["early_end"] == kept.early_end.data()
    assert cli.main(["report", str(run), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["early_end"] == result["early_end"]
    assert [entry["met"] for entry in told["expectations"]] == [False, True, True, False]
    assert "Ended early after step 9 of 1000" in Path(told["report"]).read_text()


def test_a_flight_that_ends_at_its_first_step_has_no_figures(tmp_path: Path) -> None:
    run = tmp_path / "run"
    changes = ("limits.distance=1.0", "timing.duration=500.0", EXPECT)
    options = [word for change in changes for word in ("--set", change)]
    assert cli.main(["run", "triangle", "--mode", "inprocess", "--out", str(run), *options]) == 4
    result = json.loads((run / output_folders.RESULT).read_text())
    assert (result["steps"], result["summary"], result["state_hash"]) == (0, None, None)
    assert [verdict["met"] for verdict in result["expectations"]] == [False] * 4


def test_an_early_end_survives_json_with_a_value_that_is_not_a_number() -> None:
    end = EarlyEnd("sat1", "position", 3, 1.5, math.nan, 1e7, "m", "a test")
    text = json.dumps({**end.data(), "value": None})
    assert EarlyEnd.of(json.loads(text)).sentence == end.sentence
    assert end.sentence == "position of sat1 is not finite at step 3 (1.5 s); likely cause: a test"


def test_the_check_reads_the_limits_of_the_scenario() -> None:
    assert Scenario.model_fields["limits"].default.altitude == 0.0
    end = LimitCheck(limit_plan(shortened("triangle", 10.0, "limits.acceleration=2.5"))).computed_end(
        {0: Violation(7, 3.0)}, 0
    )
    assert end is not None
    assert end.limit == 2.5
