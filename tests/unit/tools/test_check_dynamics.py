# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What `check` and `show` say of the chief's orbit, of CW's error and of the integrator's."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from flights import shipped
from satform.dynamics.integration_error import integration_error
from satform.dynamics.integrators import TABLEAUS, Adaptive, FixedStep
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.truth_models import InertialDynamicsSpec
from satform.flight.simulate import simulate
from satform.orbits.chief import KeplerianChief
from satform.scenario import Scenario, ScenarioError, parse_scenario
from satform_tools import check
from satform_tools.check.linearisation import expected_errors, oblateness_effect
from satform_tools.describe import orbit
from satform_tools.describe import scenario as describe_scenario

TEXT = """\
name: pair
title: One satellite about a chief
text: small
orbit: {semi_major_axis: 7.0e6}
timing: {step: 10.0, duration: 600.0}
dynamics: {kind: cw}
graph: {kind: none}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {period: 5828.516}
satellite_defaults:
  path_parameter: angle
  controller: {kind: sliding_mode, proportional_gain: 0.01, switching_gain: 0.1, reaching_gain: 0.1}
satellites:
  - name: sat1
    curve: {kind: ellipse, first_axis: [0, 100, 0], second_axis: [50, 0, 0]}
"""
MU = 3.986004418e14
GRAVITY = 3.986004415e14
"""Of the truth models, EGM2008, m^3/s^2."""


def scenario(*changes: str) -> Scenario:
    return parse_scenario(TEXT, "pair.yaml", changes)


def sized(size: float) -> str:
    return (
        f"satellites.0.curve={{kind: ellipse, first_axis: [0, {size}, 0], second_axis: [{0.5 * size}, 0, 0]}}"
    )


def said(about: str, *changes: str) -> list[str]:
    return [warning for warning in check.warnings(scenario(*changes)) if about in warning]


@pytest.mark.parametrize(("size", "error"), [(100.0, 0.0168), (1e4, 168.0), (2e5, 67.7e3)])
def test_the_expected_error_of_cw_is_that_of_the_scenarios_own_distance(size: float, error: float) -> None:
    (found,) = expected_errors(scenario(sized(size)))
    assert found.distance == pytest.approx(size)
    assert found.error == pytest.approx(error, rel=0.02)
    (shown,) = describe_scenario.describe(scenario(sized(size)))["cw_errors"]
    assert shown["error"] == found.error


def test_check_warns_of_a_wide_formation_under_a_linear_truth_only() -> None:
    assert not said("first order", sized(1e3))
    (warning,) = said("first order", sized(1e4))
    assert "168 m in one revolution" in warning
    assert said("first order", sized(1e4), "dynamics={kind: linear_j2}")
    assert not said("first order", sized(1e4), "dynamics={kind: inertial}")
    assert not said("first order", sized(1e4), "dynamics={kind: cw_perturbed}")
    assert said("first order", sized(1e4), "dynamics={kind: cw_perturbed, chief_motion: circular}")


def test_check_warns_of_an_eccentric_chief() -> None:
    changes = ("orbit.semi_major_axis=8.0e6", sized(400.0), "nominal_motion.period=7121.08")
    assert not said("eccentricity", *changes, "dynamics={kind: inertial, chief: {eccentricity: 1.0e-4}}")
    (warning,) = said("eccentricity", *changes, "dynamics={kind: inertial, chief: {eccentricity: 0.05}}")
    assert "with this eccentricity of 0.05" in warning
    assert "are the model of controller kind sliding_mode; " in warning
    # What is left of the error with the eccentricity known is of second order: 15/4 pi d^2/a about a circle.
    (entry,) = expected_errors(scenario(*changes, "dynamics={kind: inertial, chief: {eccentricity: 0.05}}"))
    assert entry.fitting_model() == "yamanaka_ankersen"
    second_order = 15.0 / 4.0 * math.pi * 400.0**2 / 8.0e6
    assert entry.eccentric_error == pytest.approx(second_order, rel=0.4)
    assert entry.error > 100.0 * entry.eccentric_error
    assert f"for timed_burns, errs by up to {entry.eccentric_error:.3g} m" in warning
    # Not of an observer: all laws on its estimate take the chief for circular.
    kinds = ("model_predictive with model: yamanaka_ankersen", "periodic_lqr")
    laws = ", ".join(f"controller kind {kind}" for kind in kinds)
    assert f"the model yamanaka_ankersen, of {laws}, of filters, and of the burns of plan approach" in warning


def test_check_warns_of_an_eccentric_orbit_under_a_linear_truth() -> None:
    elements = "kind: keplerian, semi_major_axis: 7.4e+6, inclination: 1, mean_anomaly: 0, epoch: 2024-01-01"
    start = "satellites.0.start={kind: relative_elements, mean_longitude: 100}"
    circular = f"orbit={{chief: {{{elements}}}}}"
    eccentric = f"orbit={{chief: {{{elements}, eccentricity: 0.05}}}}"
    assert not said("eccentricity", circular, start)
    (warning,) = said("eccentricity", eccentric, start)
    assert (
        "cw is about a circular chief orbit, and that of orbit.chief has an eccentricity of 0.05" in warning
    )
    assert "a start up to 0.1 of the distance" in warning
    # What a law takes for a circle is named where the truth is an ellipse.
    (warning,) = said("eccentricity", eccentric, start, "dynamics={kind: inertial}")
    assert warning.startswith("orbit.chief: the CW equations")


def test_check_does_not_warn_of_an_eccentric_chief_with_a_law_that_knows_it() -> None:
    changes = ("orbit.semi_major_axis=8.0e6", "dynamics={kind: inertial, chief: {eccentricity: 0.05}}")
    changes += ("nominal_motion.period=7121.08", "satellite_defaults.controller={kind: periodic_lqr}")
    assert not said("eccentric", *changes, sized(400.0))
    assert not said("yamanaka_ankersen", *changes, sized(400.0))
    (warning,) = said("yamanaka_ankersen is of first order", *changes, sized(1e5))
    assert "km" not in warning
    circular = "satellite_defaults.controller={kind: periodic_lqr, model: cw}"
    assert said("the model of controller kind periodic_lqr", *changes, sized(400.0), circular)
    assert not said("circular chief", *changes, sized(400.0), "satellite_defaults.controller={kind: coast}")


def test_check_warns_of_an_eccentric_chief_with_control_of_mean_elements() -> None:
    """Its mean elements hold for any eccentricity; where it thrusts and how much are of a circle."""
    changes = ("orbit.semi_major_axis=8.0e6", sized(400.0), "nominal_motion.period=7121.08")
    changes += ("satellite_defaults.controller={kind: mean_relative_elements}",)
    chief = "chief: {inclination: 1.0, eccentricity: %s}"
    (warning,) = said("eccentricity", *changes, f"dynamics={{kind: inertial, {chief % 0.05}}}")
    assert "are the model of controller kind mean_relative_elements; " in warning
    assert not said("eccentricity", *changes, f"dynamics={{kind: inertial, {chief % 1e-4}}}")


def test_show_says_which_model_fits(capsys: pytest.CaptureFixture[str]) -> None:
    eccentric = ("orbit.semi_major_axis=8.0e6", "dynamics={kind: inertial, chief: {eccentricity: 0.1}}")
    for changes, fitting in (
        ((), "cw"),
        (eccentric, "yamanaka_ankersen"),
        ((sized(2e5),), "none that is linear"),
    ):
        orbit.print_cw_errors(orbit.cw_errors(scenario(*changes)))
        assert f"model that fits to 1 % of the distance: {fitting}\n" in capsys.readouterr().out


def test_a_test_stand_without_an_orbit_has_no_error_of_cw() -> None:
    assert expected_errors(scenario("dynamics={kind: velocity_dependent}")) == []


@pytest.mark.parametrize("kind", ["cw", "linear_j2", "cw_perturbed", "inertial", "velocity_dependent"])
def test_a_period_below_the_earths_surface_is_refused_under_every_model(kind: str) -> None:
    dynamics = f"dynamics={{kind: {kind}}}"
    with pytest.raises(ScenarioError) as caught:
        scenario("orbit={period: 100.0}", dynamics)
    (problem,) = caught.value.problems
    assert problem.field == "orbit"
    # Kepler's third law at the equatorial radius of WGS 84.
    shortest = math.tau * math.sqrt(6378137.0**3 / MU)
    assert f"a period above {shortest:.1f} s" in problem.sentence
    assert "allow_below_surface" in problem.sentence
    assert scenario(f"orbit={{period: {shortest + 1.0}}}", dynamics)


def test_a_source_that_prints_such_a_period_is_named_so_where_the_model_has_no_earth() -> None:
    assert scenario("orbit={period: 100.0, allow_below_surface: true}").orbit.altitude < 0.0
    for kind in ("linear_j2", "cw_perturbed", "inertial"):
        with pytest.raises(ScenarioError, match="lies inside the Earth"):
            scenario("orbit={period: 100.0, allow_below_surface: true}", f"dynamics={{kind: {kind}}}")


@pytest.mark.parametrize("kind", ["cw_perturbed", "inertial"])
def test_a_perigee_inside_the_earth_is_refused_with_its_field(kind: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario(f"dynamics={{kind: {kind}, chief: {{eccentricity: 0.1}}}}")
    (problem,) = caught.value.problems
    assert problem.field == "dynamics.chief.eccentricity"
    assert "perigee of 6300.0 km" in problem.sentence


def test_bodies_that_do_not_fit_the_satellites_are_refused_with_their_field() -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario("dynamics={kind: inertial, satellite_bodies: [{}, {}]}")
    assert caught.value.problems[0].field == "dynamics.satellite_bodies"


def test_show_says_perigee_and_apogee_of_an_eccentric_chief() -> None:
    found = describe_scenario.describe(
        scenario("orbit.semi_major_axis=8.0e6", "dynamics={kind: inertial, chief: {eccentricity: 0.1}}")
    )["orbit"]
    assert found["perigee_altitude"] == pytest.approx(7.2e6 - 6378137.0, abs=1.0)
    assert found["apogee_altitude"] == pytest.approx(8.8e6 - 6378137.0, abs=1.0)
    assert "eccentricity" not in describe_scenario.describe(scenario("dynamics={kind: inertial}"))["orbit"]


def on_kepler_orbit(position: np.ndarray, velocity: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Positions on an elliptic orbit by the f and g functions (Battin, ch. 4), shape (n, 3)."""
    radius, squared = math.hypot(*position), math.fsum(velocity * velocity)
    axis = 1.0 / (2.0 / radius - squared / GRAVITY)
    rate, ascent = math.sqrt(GRAVITY / axis**3), math.fsum(position * velocity) / math.sqrt(GRAVITY * axis)
    found = []
    for time in times:
        angle = brentq(
            lambda e, mean=rate * time: (
                e - (1.0 - radius / axis) * math.sin(e) + ascent * (1.0 - math.cos(e)) - mean
            ),
            rate * time - 4.0,
            rate * time + 4.0,
            xtol=1e-15,
            rtol=1e-15,
        )
        f, g = 1.0 - axis / radius * (1.0 - math.cos(angle)), time - (angle - math.sin(angle)) / rate
        found.append(f * position + g * velocity)
    return np.array(found)


@pytest.mark.parametrize(
    ("kind", "step", "axis", "eccentricity"),
    [("rk8", 600.0, 3.0e7, 0.7), ("rk4", 60.0, 7.0e6, 0.0), ("rk4", 10.0, 7.0e6, 0.0)],
)
def test_the_integrators_error_is_that_of_a_flight(
    kind: str, step: float, axis: float, eccentricity: float
) -> None:
    rate = math.sqrt(GRAVITY / axis**3)
    steps = round(math.tau / rate / step)
    spec = InertialDynamicsSpec.model_validate(
        {
            "gravity": {"degree": 0},
            "chief": {"eccentricity": eccentricity, "argument_of_latitude": 0.3},
            "integrator": {"kind": kind, "maximum_step": step},
        }
    )
    dynamics = spec.build(DynamicsSetting(rate, step, 1))
    state = dynamics.start(np.array([[0.0, 2000.0, 0.0]]), np.zeros((1, 3)))
    begin = state.motion.copy()

    times = step * np.arange(1, steps + 1)
    truth = np.stack([on_kepler_orbit(*begin[:, row], times) for row in (0, 1)], axis=1)
    flown = np.empty_like(truth)
    for index in range(steps):
        state = dynamics.advance(state, np.zeros((1, 3)), index)
        flown[index] = state.motion[0]
    error = flown - truth
    expected = integration_error(
        FixedStep(TABLEAUS[kind](), step),
        step,
        KeplerianChief.from_mean_motion(rate, eccentricity, 0.3),
        np.array([0.0, 2000.0, 0.0]),
        math.tau / rate,
    )
    assert expected.inertial == pytest.approx(np.linalg.norm(error, axis=-1).max(), rel=0.1)
    relative = np.linalg.norm(error[:, 1] - error[:, 0], axis=-1).max()
    assert expected.relative == pytest.approx(relative, rel=0.1)


def test_a_loose_tolerance_is_seen_too() -> None:
    chief, at = KeplerianChief.from_mean_motion(math.sqrt(MU / 7.0e6**3)), np.array([0.0, 2000.0, 0.0])
    tight, loose = (integration_error(Adaptive(one, 1e-6), 60.0, chief, at, 5800.0) for one in (1e-12, 1e-4))
    assert tight.inertial < 1e-2
    assert loose.inertial > 1.0


def test_check_warns_of_a_step_that_is_too_long_and_says_which_is_enough() -> None:
    long = ("timing.step=600.0", "timing.duration=6000.0", "orbit.semi_major_axis=3.0e7")
    truth = "dynamics={{kind: {}, gravity: {{degree: 2}}, chief: {{eccentricity: 0.7}}, integrator: {}}}"
    for kind in ("inertial", "cw_perturbed"):
        (warning,) = said("integrator", *long, truth.format(kind, "{kind: rk8, maximum_step: 600.0}"))
        enough = float(warning.split("maximum_step of ")[1].split(" s")[0])
        assert not said("integrator", *long, truth.format(kind, f"{{kind: rk8, maximum_step: {enough}}}"))
    assert not said("integrator", "dynamics={kind: inertial}")
    assert not said("integrator")


def test_what_j2_adds_is_that_of_free_motion_under_it() -> None:
    """Two satellites without control for an orbit under J2, less the same without it."""
    changes = [
        "orbit.semi_major_axis=8.0e6",
        "timing={step: 60.0, duration: 7080.0}",
        "satellite_defaults.controller={kind: coast}",
        "satellite_defaults.curve={kind: fixed_point, position: [0, 200, 0]}",
        "satellites.0.curve={kind: fixed_point, position: [0, 200, 0]}",
    ]
    ends = []
    for degree in (2, 0):
        chief = "chief: {eccentricity: 0.05, inclination: 1.1, argument_of_perigee: 0.4}"
        dynamics = f"dynamics={{kind: inertial, gravity: {{degree: {degree}, order: 0}}, {chief}}}"
        one = scenario(*changes, dynamics)
        ends.append(simulate(one).position[:, 0])
        (entry,) = expected_errors(one)
        if degree == 2:
            # The plan is at rest in LVLH, and not on the ellipse that is looked at.
            assert entry.start[:3] == (0.0, 200.0, 0.0)
            found = oblateness_effect(one, replace(entry, start=(0.0, 200.0, 0.0, 0.0, 0.0, 0.0)))
        else:
            assert oblateness_effect(one, entry) == 0.0
    expected = float(np.max(np.linalg.norm(ends[0] - ends[1], axis=-1)))
    assert found == pytest.approx(expected, rel=0.05)
    assert expected > 0.1


def test_check_warns_of_long_steps_by_collocation_that_are_too_long() -> None:
    truth = "dynamics={{kind: inertial, gravity: {{degree: {}}}, integrator: {{kind: collocation, {}}}}}"
    assert not said("integrator", truth.format(20, "maximum_step: 1200"))
    (warning,) = said("too few nodes for gravity of degree 20", truth.format(20, "maximum_step: 3600"))
    enough = float(warning.split("maximum_step of ")[1].split(" is")[0])
    assert 2000.0 < enough < 2500.0
    assert not said("integrator", truth.format(20, f"maximum_step: {enough}"))


def test_check_proposes_collocation_where_everybody_coasts_for_days() -> None:
    days = ("timing.step=600.0", "timing.duration=864000.0", "satellite_defaults.controller={kind: coast}")
    (warning,) = said("no satellite has a command", *days, "dynamics={kind: inertial}")
    assert "for 10 days; collocation integrates many control periods at once" in warning
    assert not said("no satellite", *days, "dynamics={kind: inertial, integrator: {kind: collocation}}")
    assert not said("no satellite", *days, "dynamics={kind: inertial, gravity: {degree: 0}}")
    assert not said("no satellite", *days, "dynamics={kind: cw}")
    assert not said("no satellite", *days[:2], "dynamics={kind: inertial}")


def test_check_warns_of_a_filter_about_a_circular_chief_where_it_is_eccentric() -> None:
    name = "eccentric_navigation"
    part = "are the model of the filter; with this eccentricity of 0.5 the CW motion of circular"
    assert [part in warning for warning in check.warnings(shipped(name))].count(True) == 1
    knowing = shipped(name, "satellites.0.filter.model=yamanaka_ankersen")
    assert not any("are the model of" in warning for warning in check.warnings(knowing))


def test_a_filter_whose_model_does_not_know_the_chief_is_refused_at_its_field() -> None:
    with pytest.raises(ScenarioError, match=r"satellites\[1\]\.filter.*needs the plane of the chief's orbit"):
        shipped("noisy_navigation", "satellites.1.filter.model=j2_elements")
