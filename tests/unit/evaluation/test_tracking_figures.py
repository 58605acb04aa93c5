# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every figure by which a run is judged, on a flight small enough to be worked out by hand."""

import dataclasses
import functools
import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from flights import shortened
from satform.common.spec import specs
from satform.control.protocol import FlightSetting
from satform.evaluation.arc_lengths import (
    ArcLengthMean,
    ArcLengthRate,
    ArcLengthSettling,
    ArcLengthSpread,
    arc_length_spread,
)
from satform.evaluation.control_effort import Control, DeltaV, DeltaVPerOrbit
from satform.evaluation.evaluate import figures_of, judge
from satform.evaluation.event_reducers import LastOutside
from satform.evaluation.tracking import (
    Distance,
    ReachingTime,
    SettlingTime,
    SlidingVariable,
    TrackingError,
    TrackingErrorAt,
    TrackingErrorRms,
)
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES
from satform.scenario import Timing
from satform.scenario.expectation import Expectation

STEP = 0.5
TIMING = Timing(step=STEP, duration=2.0)
NAMES = {"sat1", "sat2"}
SETTING = FlightSetting(math.tau / 1.6, STEP)


def along(*lengths: list[float], direction: tuple[float, float, float] = (0.6, 0.0, 0.8)) -> np.ndarray:
    """Vectors of given lengths, a row a moment and a column a satellite."""
    return np.array(lengths)[..., None] * np.array(direction)


@functools.cache
def flight() -> FlightRecord:
    """Four steps of two satellites, whose errors shrink while their phases come together."""
    flown = simulate(shortened("triangle", 2.0))
    blank = {name: np.full_like(getattr(flown, name)[:, :2], np.nan) for name in QUANTITIES}
    reference = np.zeros((4, 2, 3))
    reference[:, 1] = 100.0, 0.0, 0.0
    acceleration = along([4, 1], [3, 2], [2, 3], [1, 6], direction=(0.0, -0.8, 0.6))
    measured = {
        "position": along([8, 4], [4, 6], [2, 1], [1, 2], [5, 9]) + np.array([[0.0] * 3, [100.0, 0.0, 0.0]]),
        "reference_position": reference,
        "acceleration": acceleration,
        "applied_acceleration": acceleration,
        "arc_length": np.array([[0.0, 100.0], [20.0, 90.0], [45.0, 55.0], [51.0, 50.0], [60.5, 60.0]]),
        "rate": np.array([[10.0, 10.0], [40.0, -5.0], [30.0, 12.0], [21.0, 18.0], [20.5, 19.75]]),
        "sliding_variable": np.array(
            [
                [[3.0, -7.0, 1.0], [2.0, 0.0, 0.5]],
                [[-0.2, 0.5, 4.0], [2.0, 1.0, 0.5]],
                [[0.1, 5.0, 0.3], [-0.3, 0.1, 0.2]],
                [[0.9, 0.2, 0.1], [0.1, -0.1, 0.1]],
            ]
        ),
    }
    return dataclasses.replace(flown, satellites=("sat1", "sat2"), step=STEP, **{**blank, **measured})


def cut(steps: int) -> FlightRecord:
    """The same flight as a bag that ends early holds it."""
    full = flight()
    shorter = {
        name: getattr(full, name)[: len(getattr(full, name)) - full.steps + steps] for name in QUANTITIES
    }
    return dataclasses.replace(full, **shorter)


CASES: list[tuple[Expectation, float]] = [
    (TrackingError(below=0), 8.0),
    (TrackingError(below=0, after=0.5), 6.0),
    (TrackingError(below=0, after=0.5, satellites=("sat1",)), 4.0),
    (TrackingError(below=0, after=1.0, before=1.4), 2.0),
    (TrackingError(below=0, after=0.1, before=0.4), math.nan),
    (TrackingErrorAt(below=0, at=0.5), 6.0),
    (TrackingErrorAt(below=0, at=1.0, satellites=("sat2",)), 1.0),
    (TrackingErrorAt(below=0), 2.0),
    (TrackingErrorAt(below=0, at=2.0), 2.0),
    (TrackingErrorRms(below=0), math.sqrt((64 + 16 + 4 + 1 + 16 + 36 + 1 + 4) / 8)),
    (TrackingErrorRms(below=0, after=1.0, satellites=("sat1",)), math.sqrt((4 + 1) / 2)),
    (SlidingVariable(below=0), 7.0),
    (SlidingVariable(below=0, after=1.0), 5.0),
    (SlidingVariable(below=0, satellites=("sat2",), after=1.5), 0.1),
    (ReachingTime(below=0, axis="x", level=0.3), 1.0),
    (ReachingTime(below=0, axis="x", level=0.3, satellites=("sat1",)), 0.5),
    (ReachingTime(below=0, axis="z", level=0.5, satellites=("sat2",)), 0.0),
    (ReachingTime(below=0, axis="y", level=0.01), math.nan),
    (Control(below=0), 2.75),
    (Control(below=0, statistic="maximum"), 6.0),
    (Control(below=0, satellites=("sat1",), after=1.0), 1.5),
    (Control(below=0, statistic="maximum", before=1.0), 4.0),
    (Control(below=0, after=1.6), math.nan),
    (DeltaV(below=0), 6.0),
    (DeltaV(below=0, satellites=("sat1",)), 5.0),
    (DeltaV(below=0, after=1.0, satellites=("sat1",)), 1.5),
    (DeltaV(below=0, after=1.6), math.nan),
    # A revolution lasts 1.6 s here.
    (DeltaVPerOrbit(below=0), 6.0 / 1.25),
    (DeltaVPerOrbit(below=0, satellites=("sat1",)), 5.0 / 1.25),
    (DeltaVPerOrbit(below=0, after=1.0), 4.5 / 0.625),
    (DeltaVPerOrbit(below=0, after=1.6), math.nan),
    (SettlingTime(below=0, level=2.5), 1.0),
    (SettlingTime(below=0, level=4.5, satellites=("sat1",)), 0.5),
    (SettlingTime(below=0, level=8.5), 0.0),
    (SettlingTime(below=0, level=1.5), math.nan),
    (ArcLengthSpread(below=0), 0.5),
    (ArcLengthSpread(below=0, at=0.0), 100.0),
    (ArcLengthSpread(below=0, at=1.01), 10.0),
    (ArcLengthSettling(below=0, fraction=0.1), 1.0),
    (ArcLengthSettling(below=0), 1.5),
    (ArcLengthSettling(below=0, fraction=1e-3), math.nan),
    (ArcLengthMean(below=0, nominal_rate=5.0), 60.25 - 5.0 * 2.0),
    (ArcLengthMean(below=0, nominal_rate=5.0, at=0.5), 55.0 - 5.0 * 0.5),
    (ArcLengthRate(below=0, nominal_rate=20.0), 0.5),
    (ArcLengthRate(below=0, nominal_rate=20.0, at=0.5), 25.0),
    (ArcLengthRate(below=0, nominal_rate=20.0, at=0.5, satellites=("sat1",)), 20.0),
]
"""Expectations whose bounds do not matter, and the figures that they have to give."""


@pytest.mark.parametrize(
    ("expectation", "figure"), CASES, ids=[f"{case.describe()}-{i}" for i, (case, _) in enumerate(CASES)]
)
def test_a_figure_is_the_one_worked_out_by_hand(expectation: Expectation, figure: float) -> None:
    (found,) = figures_of([expectation], flight(), None, SETTING)
    assert found == pytest.approx(figure, rel=1e-14, nan_ok=True)


def test_every_figure_of_these_modules_is_worked_out_by_hand() -> None:
    tested = {type(expectation) for expectation, _ in CASES} | {Distance}
    modules = tuple(f"satform.evaluation.{name}" for name in ("arc_lengths", "control_effort", "tracking"))
    assert {spec for spec in specs("satform.metrics").values() if spec.__module__ in modules} == tested


def pair(statistic: str, **other: Any) -> Distance:
    return Distance(below=0, satellites=("sat1", "sat2"), statistic=statistic, **other)


def test_distances_are_those_between_the_two_satellites() -> None:
    # Apart by 100 m along x and by the difference of the errors along (0.6, 0, 0.8).
    expected = [math.hypot(100 + 0.6 * more, 0.8 * more) for more in (-4, 2, -1, 1, 4)]
    assert pair("minimum").measure(flight()) == pytest.approx(min(expected), rel=1e-14)
    assert pair("maximum").measure(flight()) == pytest.approx(max(expected), rel=1e-14)
    assert pair("maximum", before=1.0).measure(flight()) == pytest.approx(max(expected[:3]), rel=1e-14)
    assert math.isnan(pair("maximum", after=1.6, before=1.9).measure(flight()))


def test_the_spread_is_between_the_outermost_at_every_state() -> None:
    assert arc_length_spread(flight()).tolist() == [100.0, 70.0, 10.0, 1.0, 0.5]


def test_a_stretch_of_states_includes_both_of_its_ends_in_spite_of_rounding() -> None:
    tenths = dataclasses.replace(flight(), step=0.1)
    # Three times 0.1 s is a little more than 0.3 s.
    assert SlidingVariable(below=0, after=0.3, before=0.3 + 1e-12).measure(tenths) == 0.9
    assert TrackingError(below=0, after=0.2, before=0.3).measure(tenths) == pytest.approx(2.0)


@pytest.mark.parametrize(("statistic", "figure"), [("mean", 2.5), ("maximum", 3.0)])
def test_a_command_that_is_held_from_the_end_of_a_stretch_on_is_not_part_of_it(
    statistic: str, figure: float
) -> None:
    tenths = dataclasses.replace(flight(), step=0.1)
    # What is held from 0.3 s on, once by a little more and once by a little less than three times 0.1 s.
    for end in (0.3, 0.3 + 1e-12):
        held = Control(below=0, statistic=statistic, after=0.2, before=end)
        assert held.measure(tenths) == pytest.approx(figure)


def test_one_metre_per_second_squared_for_ten_seconds_is_ten_metres_per_second() -> None:
    """Of a flight of 15 s, so that the command goes on after the stretch."""
    full = flight()
    steady = {name: np.repeat(getattr(full, name)[:1], 15, axis=0) for name in QUANTITIES}
    steady["acceleration"] = steady["applied_acceleration"] = along(*[[1, 1]] * 15, direction=(0.0, 1.0, 0.0))
    longer = {
        name: np.repeat(getattr(full, name)[:1], 16, axis=0)
        for name in QUANTITIES
        if len(getattr(full, name)) > full.steps
    }
    even = dataclasses.replace(full, step=1.0, **{**steady, **longer})
    assert DeltaV(below=0, before=10.0).measure(even) == 10.0
    assert DeltaV(below=0, after=5.0, before=10.0).measure(even) == 5.0
    assert DeltaV(below=0).measure(even) == 15.0
    assert Control(below=0, before=10.0).measure(even) == 1.0


@pytest.mark.parametrize(
    "expectation",
    [
        TrackingErrorAt(below=10, at=1.5),
        ArcLengthSpread(below=1000, at=1.5),
        ArcLengthMean(below=1000, at=1.5, nominal_rate=0.0),
        ArcLengthRate(below=1000, at=1.5, nominal_rate=0.0),
        TrackingError(below=10, before=1.5),
        TrackingError(below=10, after=1.5),
        DeltaV(below=10, before=1.5),
        pair("maximum", before=1.5),
    ],
    ids=lambda expectation: expectation.describe(),
)
def test_a_moment_that_a_short_record_does_not_hold_gives_no_figure_and_is_not_met(
    expectation: Expectation,
) -> None:
    assert not math.isnan(expectation.measure(flight()))
    verdict = judge([expectation], cut(2))[0]
    assert math.isnan(verdict.figure)
    assert not verdict.met


@pytest.mark.parametrize(
    "expectation", [case for case, _ in CASES if not hasattr(case, "at")], ids=lambda case: case.describe()
)
def test_a_record_without_a_step_gives_no_figure_of_what_is_decided_in_steps(
    expectation: Expectation,
) -> None:
    figure = expectation.measure(cut(0))
    assert math.isnan(figure) or isinstance(expectation, ArcLengthSettling)


def test_a_record_without_a_step_still_has_its_first_state() -> None:
    assert ArcLengthSpread(below=0).measure(cut(0)) == 100.0
    assert math.isnan(TrackingErrorAt(below=0).measure(cut(0)))


def test_a_value_is_met_within_its_tolerance_and_not_beyond() -> None:
    spread = {"at": 1.0, "value": 9.5}
    assert judge([ArcLengthSpread(**spread, absolute=0.5)], flight())[0].met
    assert not judge([ArcLengthSpread(**spread, absolute=0.49)], flight())[0].met
    assert judge([ArcLengthSpread(**spread, relative=0.06)], flight())[0].met
    assert not judge([ArcLengthSpread(**spread, relative=0.05)], flight())[0].met


def test_a_negative_value_has_a_relative_tolerance_too() -> None:
    assert judge([ArcLengthMean(at=0.5, nominal_rate=200.0, value=-44.0, relative=0.03)], flight())[0].met
    assert not judge([ArcLengthMean(at=0.5, nominal_rate=200.0, value=-44.0, relative=0.02)], flight())[0].met


def test_bounds_include_themselves_and_both_have_to_hold() -> None:
    assert judge([ArcLengthSpread(at=1.0, below=10.0)], flight())[0].met
    assert judge([ArcLengthSpread(at=1.0, above=10.0)], flight())[0].met
    assert judge([ArcLengthSpread(at=1.0, above=9.0, below=11.0)], flight())[0].met
    assert not judge([ArcLengthSpread(at=1.0, above=11.0, below=12.0)], flight())[0].met
    assert not judge([ArcLengthSpread(at=1.0, above=1.0, below=9.0)], flight())[0].met


@pytest.mark.parametrize(
    ("expectation", "needed"),
    [
        (ArcLengthSpread(below=1), 2.0),
        (ArcLengthSpread(below=1, at=0.5), 0.5),
        # What is decided in the step that begins at a time is there only when that step has been flown.
        (TrackingErrorAt(below=1, at=0.5), 1.0),
        (TrackingErrorAt(below=1, at=2.0), 2.0),
        (Control(below=1, after=0.5), 2.0),
        (Control(below=1, after=0.5, before=1.5), 1.5),
        (TrackingError(value=1, relative=0.1, before=1.0), 1.5),
        (TrackingError(value=1, relative=0.1, before=2.0), 2.0),
        # What has happened within the time that is allowed does not happen again later.
        (ReachingTime(value=0.8, absolute=0.2, axis="x", level=0.3), 1.5),
        (SettlingTime(below=1, level=1.0), 1.5),
        (SettlingTime(above=1, level=1.0), 2.0),
        (ArcLengthSettling(below=0.5, above=0.1), 1.0),
        # A bound over a stretch holds over every part of it, but a value may come at its end.
        (TrackingError(below=1), 1.0),
        (TrackingError(below=1, after=0.5), 1.5),
        (TrackingError(above=1), 2.0),
        (TrackingError(value=1, relative=0.1), 2.0),
        (Control(below=1, statistic="maximum"), 1.0),
        (Control(above=1, statistic="minimum"), 1.0),
        (Control(above=1, statistic="maximum"), 2.0),
        (DeltaV(below=1), 2.0),
        (DeltaV(value=0, absolute=0), 1.0),
    ],
)
def test_an_expectation_needs_a_flight_that_has_its_figure(expectation: Expectation, needed: float) -> None:
    assert expectation.needs(TIMING.duration, TIMING.step) == needed


@pytest.mark.parametrize("expectation", [case for case, _ in CASES], ids=lambda case: case.describe())
@pytest.mark.parametrize("bound", ["below", "above", "value"])
def test_what_the_whole_flight_meets_is_not_missed_by_a_shorter_one_that_is_judged(
    expectation: Expectation, bound: str
) -> None:
    (figure,) = figures_of([expectation], flight(), None, SETTING)
    if math.isnan(figure):
        return
    exact: dict[str, float | None] = {"below": None, "above": None, "value": None, bound: figure}
    met = expectation.model_copy(update={**exact, "absolute": 0.0 if bound == "value" else None})
    assert judge([met], flight(), setting=SETTING)[0].met
    for steps in range(1, flight().steps):
        if met.needs(TIMING.duration, STEP) <= steps * STEP:
            assert judge([met], cut(steps), setting=SETTING)[0].met, f"missed after {steps} steps"


@pytest.mark.parametrize("figure", [math.nan, math.inf, -math.inf])
def test_a_figure_that_is_not_finite_meets_nothing(figure: float) -> None:
    assert not ArcLengthSpread(above=1.0).verdict(figure).met
    assert not ArcLengthSpread(below=1.0).verdict(figure).met


def lost(place: int, steps: slice) -> FlightRecord:
    """The same flight with a satellite that does not fly in some steps."""
    full = flight()
    changed = {
        name: getattr(full, name).copy() for name in ("acceleration", "reference_position", "arc_length")
    }
    changed["sliding_variable"] = full.sliding_variable.copy()
    changed["acceleration"][steps, place] = 0.0
    for name in ("reference_position", "arc_length", "sliding_variable"):
        changed[name][steps, place] = np.nan
    return dataclasses.replace(full, **changed)


@pytest.mark.parametrize(
    "expectation",
    [
        Control(below=10, after=1.0, satellites=("sat2",)),
        Control(below=10, after=1.0, statistic="maximum", satellites=("sat1", "sat2")),
        DeltaV(below=10, after=1.0, satellites=("sat2",)),
        TrackingError(below=10, after=1.0, satellites=("sat1", "sat2")),
        TrackingErrorAt(below=10, at=1.0, satellites=("sat1", "sat2")),
        SlidingVariable(below=10, after=1.0, satellites=("sat1", "sat2")),
        ArcLengthRate(below=1000, at=1.0, nominal_rate=20.0, satellites=("sat1", "sat2")),
        ArcLengthSpread(below=1000, at=1.0, satellites=("sat1", "sat2")),
        ArcLengthSpread(below=1000, at=1.0),
    ],
    ids=lambda case: case.describe(),
)
def test_a_satellite_that_does_not_fly_does_not_meet_what_is_asked_of_it(expectation: Expectation) -> None:
    assert judge([expectation], flight())[0].met
    assert not judge([expectation], lost(1, slice(2, 4)))[0].met


def test_a_satellite_that_does_not_fly_has_no_part_in_a_mean() -> None:
    # Of 4, 3, 2, 1 m/s^2 the first two are left.
    assert Control(below=9, satellites=("sat1",)).measure(lost(0, slice(2, 4))) == 3.5


def test_a_series_settles_only_where_it_has_numbers() -> None:
    series = np.array([[9.0, 9.0, 1.0], [1.0, 1.0, 1.0], [math.nan, 1.0, 1.0], [1.0, 1.0, math.nan]])
    outside = LastOutside()
    outside.add(~(series <= 2.0))
    assert outside.settled().tolist() == pytest.approx([3.0, 1.0, math.nan], nan_ok=True)


def test_a_verdict_says_what_was_measured_in_which_unit_and_what_is_allowed() -> None:
    verdict = judge([ArcLengthSpread(at=1.0, value=9.5, relative=0.06, below=11.0)], flight())[0]
    assert verdict.label == "arc-length spread at 1 s"
    assert (verdict.unit, verdict.figure) == ("m", 10.0)
    assert verdict.allowed == "9.5 ± 6 % and ≤ 11"
    assert judge([TrackingError(below=1.0, label="how far off")], flight())[0].label == "how far off"
    named = judge([TrackingError(above=1.0, after=0.5, before=1.0, satellites=("sat2",))], flight())[0]
    assert named.label == "largest tracking error after 0.5 s before 1 s, sat2"
    assert named.allowed == "≥ 1"


def test_a_run_is_judged_by_every_expectation_in_order() -> None:
    expectations = (ArcLengthSpread(below=1.0), DeltaV(below=1.0), Control(above=2.0))
    assert [verdict.met for verdict in judge(expectations, flight())] == [True, False, True]
    assert judge((), flight()) == []


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"value": 1.0}, "exactly one of relative or absolute"),
        ({"value": 1.0, "relative": 0.1, "absolute": 0.1}, "exactly one of relative or absolute"),
        ({"relative": 0.1}, "a tolerance needs a value"),
        ({"absolute": 0.1, "below": 3.0}, "a tolerance needs a value"),
        ({"value": 1.0, "relative": -0.1}, "greater than or equal to 0"),
        ({"value": 1.0, "relative": 0.1, "regression": True, "source": "a paper"}, "not both"),
        ({"below": 1.0, "regression": True}, "a regression figure is a value with its tolerance"),
        ({"value": 1.0, "relative": 0.1, "above": 0.0, "regression": True}, "a bound needs a source"),
    ],
)
def test_an_expectation_that_says_nothing_definite_is_refused(fields: dict, sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        ArcLengthSpread(**fields)


@pytest.mark.parametrize(
    ("expectation", "sentence"),
    [
        (TrackingError(below=1, satellites=("sat1", "sat9")), "no satellite sat9; there are sat1, sat2"),
        (pair("minimum", after=2.0), "after 2 s is not earlier than the stretch's end at 2 s"),
        (Control(below=1, before=2.5), "before 2.5 s is later than the flight's end at 2 s"),
        (Control(below=1, after=1.0, before=0.5), "after 1 s is not earlier than the stretch's end at 0.5 s"),
        (ArcLengthSpread(below=1, at=2.001), "at 2.001 s is later than the flight's end at 2 s"),
        (TrackingErrorAt(below=1, satellites=("one",)), "no satellite one"),
        (SettlingTime(below=1, level=1.0, satellites=("one",)), "no satellite one"),
        (ArcLengthSpread(below=1, at=0.0), "at 0 s the figure is what the scenario itself says"),
        (TrackingErrorAt(below=1, at=0.2), "at 0.2 s the figure is what the scenario itself says"),
        (ArcLengthSpread(below=1, satellites=("sat1",)), "a spread is of two satellites or more; found sat1"),
        (
            Distance(below=1, satellites=("sat1", "sat1"), statistic="minimum"),
            "a distance is between two different satellites; found sat1 twice",
        ),
    ],
)
def test_what_cannot_be_measured_in_a_scenario_is_complained_about(
    expectation: Expectation, sentence: str
) -> None:
    complaints = expectation.complaints(NAMES, TIMING)
    assert len(complaints) == 1
    assert sentence in complaints[0]


def test_two_things_wrong_are_two_complaints() -> None:
    expectation = TrackingErrorAt(below=1, at=3.0, satellites=("one",))
    assert len(expectation.complaints(NAMES, TIMING)) == 2


@pytest.mark.parametrize(
    "expectation",
    [case for case, _ in CASES if getattr(case, "at", None) != 0.0] + [pair("minimum")],
    ids=lambda case: case.describe(),
)
def test_what_can_be_measured_is_not_complained_about(expectation: Expectation) -> None:
    assert expectation.complaints(NAMES, TIMING) == []


def test_the_end_of_the_flight_may_be_named_with_a_rounding_error() -> None:
    assert ArcLengthSpread(below=1, at=2.0 * (1 + 1e-12)).complaints(NAMES, TIMING) == []
    assert Control(below=1, before=2.0 * (1 + 1e-12)).complaints(NAMES, TIMING) == []
    assert ArcLengthSpread(below=1, at=2.0 * (1 + 1e-12)).measure(flight()) == 0.5
