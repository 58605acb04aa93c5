# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of collision risk and of the shape of a formation, on flights whose figures have closed forms."""

import math
from dataclasses import replace
from typing import Any

import brahe
import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.linalg import null_space
from scipy.stats import multivariate_normal, ncx2

from flight_arrays import Flight
from flights import SCENARIOS
from random_flights import one_flight, reduced
from satform.control.protocol import FlightSetting
from satform.control.relative_elements import RelativeElements, motion_from_elements
from satform.dynamics.free_drift import least_free_distances
from satform.evaluation import collision
from satform.evaluation.collision import CollisionProbability, PassiveSafety, RadialNormalDistance
from satform.evaluation.control_effort import DeltaVPerOrbit
from satform.evaluation.evaluate import figures_of
from satform.evaluation.formation_shape import TetrahedronQuality, TetrahedronQualityAt
from satform.evaluation.passes import PassTime
from satform.orbits.chief import KeplerianChief
from satform.record.reducer import FlightShape
from satform.scenario import Timing, parse_scenario
from satform.scenario.expectation import Expectation
from scenario_problems import broken, problems

STEP, STEPS = 10.0, 60
TIMES = STEP * np.arange(STEPS + 1)
MEAN_MOTION = math.tau / 5600.0
BOUND: dict[str, Any] = {"below": 0.0, "source": "none"}
TIMING = Timing(step=STEP, duration=STEP * STEPS)


def flight_of(**motions: tuple[np.ndarray, np.ndarray]) -> Flight:
    """A flight with these positions and velocities, shape (K + 1, 3) each; all else is random."""
    random = one_flight(np.random.default_rng(1), STEPS, tuple(motions), STEP, turning=False)
    flown = {
        "position": np.stack([position for position, _ in motions.values()], axis=1),
        "velocity": np.stack([velocity for _, velocity in motions.values()], axis=1),
    }
    return Flight(random.names, STEP, {**random.arrays, **flown}, MEAN_MOTION)


def at_rest(*position: float) -> tuple[np.ndarray, np.ndarray]:
    return np.broadcast_to(position, (STEPS + 1, 3)).astype(float), np.zeros((STEPS + 1, 3))


def straight(start: tuple[float, ...], velocity: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    return np.array(start) + TIMES[:, None] * np.array(velocity), np.broadcast_to(velocity, (STEPS + 1, 3))


def free(*elements: float) -> tuple[np.ndarray, np.ndarray]:
    """The free motion with these relative elements, m."""
    drifted = np.tile(np.array(elements, dtype=float), (STEPS + 1, 1))
    drifted[:, 1] -= 1.5 * MEAN_MOTION * TIMES * drifted[:, 0]
    rate = np.full(STEPS + 1, MEAN_MOTION)
    motion = motion_from_elements(RelativeElements.from_array(drifted), rate, MEAN_MOTION * TIMES)
    return motion.position, motion.velocity


def figure(expectation: Expectation, flight: Flight, setting: FlightSetting | None = None) -> float:
    return figures_of([expectation], flight.record, None, setting or flight.setting)[0]


def round_probability(miss: float, deviation: float, radius: float) -> float:
    return float(ncx2.cdf((radius / deviation) ** 2, 2, (miss / deviation) ** 2))


# Passes 40 m above the other one at 303.7 s, between two steps.
PASSING = straight((40.0, -3037.0, 0.0), (0.0, 10.0, 0.0))


def test_collision_probability_of_a_pass_with_a_given_covariance() -> None:
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=PASSING)
    wide = CollisionProbability(combined_radius=15.0, standard_deviation=(30.0, 30.0, 30.0), **BOUND)
    assert figure(PassTime(satellites=("a", "b"), **BOUND), flight) == pytest.approx(303.7)
    assert figure(wide, flight) == pytest.approx(round_probability(40.0, 30.0, 15.0), rel=1e-9)
    # What is along the relative velocity does not matter, and a matrix says as much as its diagonal.
    rows = ((900.0, 0.0, 0.0), (0.0, 1e8, 0.0), (0.0, 0.0, 900.0))
    matrix = CollisionProbability(combined_radius=15.0, covariance=rows, **BOUND)
    assert figure(matrix, flight) == pytest.approx(figure(wide, flight), rel=1e-9)


def test_collision_probability_is_the_largest_of_the_pairs() -> None:
    slow = straight((25.0, 0.0, 0.0), (0.0, 1e-6, 0.0))
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=PASSING, c=slow)
    every = CollisionProbability(combined_radius=15.0, standard_deviation=30.0, **BOUND)
    # b passes c at 15 m, and a at 40 m; a and c stay 25 m apart.
    assert figure(every, flight) == pytest.approx(round_probability(15.0, 30.0, 15.0), rel=1e-6)
    two = every.model_copy(update={"satellites": ("c", "a")})
    assert figure(two, flight) == pytest.approx(round_probability(25.0, 30.0, 15.0), rel=1e-6)


def test_without_relative_motion_in_inertial_space_there_is_no_encounter_and_no_figure() -> None:
    flight = flight_of(
        a=at_rest(0.0, 0.0, 0.0), b=PASSING, c=at_rest(0.0, 0.0, 25.0), d=at_rest(25.0, 0.0, 0.0)
    )
    every = CollisionProbability(combined_radius=15.0, standard_deviation=30.0, **BOUND)
    assert math.isnan(figure(every, flight))
    passing = every.model_copy(update={"satellites": ("a", "b")})
    assert not math.isnan(figure(passing, flight))
    # What is at rest beside the orbit's normal in LVLH moves as the frame turns.
    turning = figure(every.model_copy(update={"satellites": ("a", "d")}), flight)
    assert turning == pytest.approx(round_probability(25.0, 30.0, 15.0), rel=1e-9)
    assert math.isnan(
        figures_of([every.model_copy(update={"satellites": ("a", "b")})], flight.record, None)[0]
    )


@pytest.mark.parametrize("eccentricity", [0.0, 0.6])
def test_the_encounter_plane_of_a_slow_pass_is_across_the_velocity_in_inertial_space(
    eccentricity: float,
) -> None:
    # 40 m ahead with 5 cm/s along the normal at 300 s: the frame turns as fast as the satellite passes.
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=straight((0.0, 40.0, -15.0), (0.0, 0.0, 0.05)))
    axis = math.cbrt(brahe.GM_EARTH / MEAN_MOTION**2)
    elements = np.array([axis, eccentricity, 0.9, 0.3, 0.2, 5.5])
    chief = KeplerianChief(*elements.tolist())
    deviations = (35.0, 25.0, 6.0)
    spec = CollisionProbability(combined_radius=15.0, standard_deviation=deviations, **BOUND)
    found = figure(spec, flight, FlightSetting(MEAN_MOTION, STEP, chief=chief if eccentricity else None))
    # The same encounter from the inertial states of both bodies, by brahe, and its plane by their difference.
    elements[5] += MEAN_MOTION * 300.0
    reference = brahe.state_koe_to_eci(elements, brahe.AngleFormat.RADIANS)
    other = brahe.state_rtn_to_eci(reference, np.array([0.0, 40.0, 0.0, 0.0, 0.0, 0.05]))
    separation, velocity = np.split(other - reference, 2)
    plane = null_space(velocity[None]).T
    turned = brahe.rotation_rtn_to_eci(reference)
    covariance = plane @ turned @ np.diag(np.square(deviations)) @ turned.T @ plane.T
    density = multivariate_normal(-plane @ separation, covariance)
    expected, _ = dblquad(
        lambda angle, radius: radius * density.pdf([radius * math.cos(angle), radius * math.sin(angle)]),
        *(0.0, 15.0, 0.0, math.tau),
        epsrel=1e-8,
    )
    assert found == pytest.approx(expected, rel=1e-6)


def test_passive_safety_that_would_take_hours_is_refused() -> None:
    timing = Timing(step=1.0, duration=1e6)
    names = {f"sat{number}" for number in range(10)}
    (sentence,) = PassiveSafety(orbits=10.0, every=1, **BOUND).complaints(names, timing)
    assert "45 pairs is 5.4e+10 samples, and at most 5e+08 are computed: give every at least 109" in sentence
    assert PassiveSafety(orbits=10.0, every=109, **BOUND).complaints(names, timing) == []


def test_passive_safety_about_an_eccentric_chief_computes_no_circular_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=PASSING)
    chief = KeplerianChief(2.0e7, 0.6, 1.0, 0.0, 0.0, 3.0)
    monkeypatch.setattr(collision, "least_free_distance", None)
    setting = FlightSetting(chief.mean_motion, STEP, chief=chief)
    assert math.isfinite(figure(PassiveSafety(orbits=0.2, every=20, **BOUND), flight, setting))


def test_before_the_pass_the_separation_counts_with_its_full_length() -> None:
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=straight((30.0, -340.0, 0.0), (0.0, 1.0, 0.0)))
    early = CollisionProbability(combined_radius=15.0, standard_deviation=30.0, before=300.0, **BOUND)
    # At 300 s it is still 40 m behind.
    assert figure(early, flight) == pytest.approx(round_probability(50.0, 30.0, 15.0), rel=1e-9)


def test_covariance_of_the_filters_at_the_pass() -> None:
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=PASSING)
    estimates = np.zeros((STEPS, 2, 6, 6))
    # The step in which the pass is nearest is the one at 300 s.
    estimates[:, 0] = np.diag([100.0] * 3 + [1.0] * 3)
    estimates[:, 1] = np.diag([1.0] * 6)
    estimates[30, 1] = np.diag([800.0] * 3 + [1.0] * 3)
    known = replace(flight, arrays={**flight.arrays, "estimate_covariance": estimates})
    by_filters = CollisionProbability(combined_radius=15.0, **BOUND)
    assert figure(by_filters, known) == pytest.approx(round_probability(40.0, 30.0, 15.0), rel=1e-9)
    none = replace(flight, arrays={**flight.arrays, "estimate_covariance": np.zeros((0, 2, 6, 6))})
    assert math.isnan(figure(by_filters, none))
    # The state after the last step has the covariance of that step.
    after = CollisionProbability(combined_radius=15.0, after=STEP * STEPS, **BOUND)
    far = figure(after, known)
    assert far == pytest.approx(
        round_probability(math.hypot(40.0, 2963.0), math.sqrt(101.0), 15.0), abs=1e-12
    )


def test_radial_normal_distance_of_parallel_vectors_is_the_smaller_one() -> None:
    flight = flight_of(
        a=free(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        b=free(0.0, 500.0, 0.0, 300.0, 0.0, -200.0),
        c=free(0.0, 900.0, 0.0, -50.0, 0.0, 700.0),
    )
    every = RadialNormalDistance(**BOUND)
    assert figure(every, flight) == pytest.approx(50.0, rel=1e-9)
    assert figure(every.model_copy(update={"satellites": ("b", "a")}), flight) == pytest.approx(
        200.0, rel=1e-9
    )
    assert figure(every.model_copy(update={"satellites": ("b", "c")}), flight) == pytest.approx(
        350.0, rel=1e-9
    )


def test_passive_safety_sees_what_a_controlled_flight_does_not_show() -> None:
    # 30 m below and 2 km behind: it would pass below the other one in 7 revolutions.
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=free(-30.0, -2000.0, 0.0, 0.0, 0.0, 0.0))
    soon = PassiveSafety(orbits=2.0, **BOUND)
    later = PassiveSafety(orbits=8.0, every=7, **BOUND)
    flown = 1.5 * MEAN_MOTION * STEP * STEPS * 30.0
    # Two revolutions after the last state it is nearest.
    left = 2000.0 - flown - 6.0 * math.pi * 30.0
    assert figure(soon, flight) == pytest.approx(math.hypot(30.0, left), rel=1e-9)
    assert figure(later, flight) == pytest.approx(30.0, rel=1e-9)


def test_passive_safety_about_an_eccentric_chief_is_that_of_its_motion_however_the_flight_is_cut() -> None:
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=PASSING, c=free(-30.0, -2000.0, 0.0, 200.0, 0.0, 90.0))
    chief = KeplerianChief(2.0e7, 0.6, 1.0, 0.0, 0.0, 3.0)
    setting = FlightSetting(chief.mean_motion, STEP, chief=chief)
    expectation = PassiveSafety(orbits=0.7, every=9, **BOUND)
    position, velocity = (flight.arrays[name][::9] for name in ("position", "velocity"))
    pairs = [(0, 1), (0, 2), (1, 2)]
    apart, moving = (
        np.stack([own[:, one] - own[:, other] for one, other in pairs], axis=1)
        for own in (position, velocity)
    )
    expected = least_free_distances(chief, TIMES[::9], apart, moving, 0.7).min()
    assert figure(expectation, flight, setting) == expected
    reducer = expectation.reducer(FlightShape(flight.names, STEP, STEPS, (setting,)))
    assert reduced(reducer, [flight], [1, 7, 30, 31]).tolist() == [expected]
    assert figure(expectation, flight) != expected


def test_figures_of_an_orbit_need_the_chief() -> None:
    flight = flight_of(a=at_rest(0.0, 0.0, 0.0), b=PASSING)
    expectations = [
        RadialNormalDistance(**BOUND),
        PassiveSafety(orbits=0.1, **BOUND),
        DeltaVPerOrbit(**BOUND),
    ]
    assert np.isnan(figures_of(expectations, flight.record, None)).all()
    assert not np.isnan(figures_of(expectations[:2], flight.record, None, flight.setting)).any()


REGULAR = ((1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))


def test_tetrahedron_that_flattens_into_a_square() -> None:
    height = np.linspace(1.0, 0.0, STEPS + 1)[:, None] * np.array([0.0, 0.0, 1.0])
    corners = {
        name: (corner * np.array([1.0, 1.0, 0.0]) + corner[2] * height, np.zeros((STEPS + 1, 3)))
        for name, corner in zip("abcd", np.array(REGULAR), strict=True)
    }
    flight = flight_of(**corners)
    square = 1.0 + 4.0 / (math.sqrt(3.0) * ((4.0 * 2.0 + 2.0 * math.sqrt(8.0)) / 6.0) ** 2) * 2.0
    least = figure(TetrahedronQuality(**BOUND), flight)
    assert least == pytest.approx(square, rel=1e-12)
    assert figure(TetrahedronQualityAt(**BOUND), flight) == pytest.approx(square, rel=1e-12)
    assert figure(TetrahedronQuality(statistic="maximum", **BOUND), flight) == pytest.approx(3.0)
    mean = figure(TetrahedronQuality(statistic="mean", quality="volume", **BOUND), flight)
    heights = np.linspace(1.0, 0.0, STEPS + 1)
    sides = (2.0 * math.sqrt(8.0) + 4.0 * np.sqrt(4.0 + 4.0 * heights**2)) / 6.0
    ratios = 8.0 / 3.0 * heights / (sides**3 / (6.0 * math.sqrt(2.0)))
    assert mean == pytest.approx(ratios.mean(), rel=1e-12)
    assert figure(TetrahedronQualityAt(quality="robert_roux", **BOUND), flight) == 0.0
    # The mean side shrinks from 2.83 m to 2.28 m, and only the larger sizes count.
    larger = TetrahedronQuality(mean_sides=(2.5, 2.8, 3.0, 4.0), statistic="maximum", **BOUND)
    assert figure(larger, flight) == pytest.approx(3.0)
    assert figure(larger.model_copy(update={"statistic": "minimum"}), flight) == 0.0


def test_mean_sides_have_to_ascend() -> None:
    with pytest.raises(ValueError, match="mean_sides have to ascend"):
        TetrahedronQuality(mean_sides=(1.0, 3.0, 2.0, 4.0), **BOUND)


@pytest.mark.parametrize(
    ("expectation", "names", "sentence"),
    [
        (PassiveSafety(orbits=1.0, **BOUND), "a", "a pair is of two satellites; there is one"),
        (
            RadialNormalDistance(satellites=("a", "b", "a"), **BOUND),
            "ab",
            "a pair is of two different satellites; found a twice",
        ),
        (
            TetrahedronQuality(**BOUND),
            "abc",
            "a tetrahedron has four corners; there are 3 satellites: name four",
        ),
        (
            TetrahedronQualityAt(satellites=("a", "b", "c", "c"), **BOUND),
            "abc",
            "a tetrahedron is of four different satellites",
        ),
    ],
)
def test_what_has_no_pairs_or_no_four_corners_is_named(
    expectation: Expectation, names: str, sentence: str
) -> None:
    assert expectation.complaints(set(names), TIMING) == [sentence]


def test_pairs_of_too_many_satellites_are_refused() -> None:
    (sentence,) = RadialNormalDistance(**BOUND).complaints({f"sat{n}" for n in range(101)}, TIMING)
    assert sentence == "pairs of at most 100 satellites are judged; found 101: name some"


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        (
            {"standard_deviation": 1.0, "covariance": np.eye(3).tolist()},
            "give standard_deviation or covariance",
        ),
        (
            {"covariance": [[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]},
            "symmetric and positive definite",
        ),
        (
            {"covariance": [[1.0, 0.2, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]},
            "symmetric and positive definite",
        ),
    ],
)
def test_what_is_no_covariance_is_refused(fields: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        CollisionProbability(combined_radius=1.0, **fields, **BOUND)


def test_without_a_filter_a_covariance_has_to_be_given() -> None:
    (problem,) = broken(
        "expect:",
        "expect:\n  - {kind: collision_probability, combined_radius: 5.0, below: 1.0e-4, source: none}",
    )
    assert problem.field == "expect[0]"
    assert problem.sentence == (
        "sat1, sat2, sat3 have no filter, whose covariance would be used; "
        "give standard_deviation or covariance"
    )


def test_delta_v_per_orbit_is_not_made_of_a_part_of_a_revolution() -> None:
    (problem,) = broken(
        "expect:", "expect:\n  - {kind: delta_v_per_orbit, after: 9000.0, below: 1.0, source: none}"
    )
    assert problem.sentence == (
        "the stretch lasts 3000 s, less than one revolution of 6000 s; "
        "kind delta_v is for parts of a revolution"
    )


@pytest.mark.parametrize(
    ("kind", "eccentricity", "refused"),
    [
        ("radial_normal_distance", 0.02, True),
        ("radial_normal_distance", 0.01, False),
        ("passive_safety, orbits: 1.0", 0.02, False),
    ],
)
def test_an_eccentric_chief_is_refused_where_its_motion_is_not_that_of_the_figure(
    kind: str, eccentricity: float, *, refused: bool
) -> None:
    chief = f"dynamics: {{kind: inertial, chief: {{eccentricity: {eccentricity}}}}}"
    text = (SCENARIOS / "ei_separation.yaml").read_text().replace("dynamics: {kind: cw}", chief)
    text = f"{text[: text.index('expect:')]}expect:\n  - {{kind: {kind}, above: 1.0, source: none}}\n"
    if not refused:
        parse_scenario(text, "f.yaml")
        return
    (problem,) = problems(text)
    assert problem.sentence == (
        "the figure is that of a nearly circular chief, up to eccentricity 0.01; the chief's is 0.02"
    )
