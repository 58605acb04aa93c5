# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of integration that no flight comes to an end with, or that an iteration does not converge over."""

import math

import pytest

from flights import shortened
from satform.dynamics.collocation import Collocation
from satform.dynamics.integrators import TABLEAUS, FixedStep
from satform.dynamics.protocol import DynamicsSetting
from satform.dynamics.truth_models import InertialDynamicsSpec
from satform.orbits.earth import GRAVITATIONAL_PARAMETER
from satform.scenario import ScenarioError

INERTIAL = "dynamics={{kind: inertial, integrator: {{kind: {}}}}}"
FORMULA = "dynamics={{kind: formula, acceleration: ['0', '0', '0'], maximum_step: {}}}"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            INERTIAL.format("collocation, maximum_step: 1e15"),
            r"dynamics\.integrator\.maximum_step: 1e\+15 s is too long for collocation, .* at most 6000 s",
        ),
        (
            INERTIAL.format("collocation, thrust_step: 1e-310"),
            r"dynamics\.integrator\.thrust_step: sub-steps of at most 1e-310 s .* at least 5e-07 s",
        ),
        (
            INERTIAL.format("collocation, maximum_step: 1e-310"),
            r"dynamics\.integrator\.maximum_step: sub-steps",
        ),
        (INERTIAL.format("rk4, maximum_step: 1e-12"), r"dynamics\.integrator\.maximum_step: sub-steps"),
        (
            "dynamics={kind: cw_perturbed, integrator: {maximum_step: 1e-310}}",
            r"dynamics\.integrator\.maximum_step: sub-steps",
        ),
        (
            "dynamics={kind: velocity_dependent, maximum_step: 1e-310}",
            r"dynamics\.maximum_step: sub-steps of at most 1e-310 s are inf in a control period of 0.5 s",
        ),
        (FORMULA.format("1e-12"), r"dynamics\.maximum_step: sub-steps of at most 1e-12 s are 5e\+11"),
    ],
)
def test_steps_that_no_flight_comes_to_an_end_with_are_refused_at_their_field(change: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        shortened("triangle", 60.0, change)


def test_sub_steps_of_an_attitude_are_refused_likewise() -> None:
    with pytest.raises(
        ScenarioError, match=r"satellites.*attitude of sat1: maximum_step: sub-steps of at most"
    ):
        shortened("formation_pointing", 60.0, "satellites.sat1.attitude.maximum_step=1e-310")


def test_a_million_sub_steps_of_a_control_period_are_not_refused() -> None:
    assert shortened("triangle", 60.0, FORMULA.format("5e-7")).dynamics.kind == "formula"


@pytest.mark.parametrize("eccentricity", [0.0, 0.9])
def test_the_longest_step_of_collocation_is_a_revolution_at_the_radius_of_the_perigee(
    eccentricity: float,
) -> None:
    radius = 7e6
    rate = math.sqrt(GRAVITATIONAL_PARAMETER / (radius / (1.0 - eccentricity)) ** 3)
    longest = math.tau * math.sqrt(radius**3 / GRAVITATIONAL_PARAMETER)
    setting = DynamicsSetting(rate, 1.0, 1)
    for step, fields in (
        (60000.0, [("integrator", "maximum_step")]),
        (1.001 * longest, [("integrator", "maximum_step")]),
        (0.999 * longest, []),
    ):
        spec = InertialDynamicsSpec.model_validate(
            {
                "chief": {"eccentricity": eccentricity},
                "integrator": {"kind": "collocation", "maximum_step": step},
            }
        )
        assert [field for field, _ in spec.complaints(setting)] == fields


def test_a_long_step_extends_over_a_bounded_number_of_control_periods() -> None:
    thrust = FixedStep(TABLEAUS["rk8"](), 45.0)
    assert Collocation(1200.0, thrust).division(1.0) == (1200, 1)
    assert Collocation(1e15, thrust).division(1.0) == (10_000, 1)
    assert Collocation(1200.0, thrust).division(1e-9) == (10_000, 1)
