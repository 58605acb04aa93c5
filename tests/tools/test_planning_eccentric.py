# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of approaches about eccentric chiefs, by relative-motion models, and Sun angles at arrival."""

import math

import brahe
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plan_output import planned
from satform.orbits.chief import mean_anomaly
from satform_tools.cli import main as cli

MU, RADIUS, J2 = 3.986004418e14, 6378136.3, 1.08262668e-3


def two_body_difference(states, burns, until, j2, push, duration):
    """Position of a deputy in the chief's LVLH frame after held burns or impulses, by inertial integration.

    Args:
        states: inertial position and velocity of the chief, and of the deputy as motion in LVLH, m and m/s.
        burns: times and velocity changes in LVLH.
        until: time of the position, s.
        j2: oblateness; 0 for two-body motion.
        push: constant acceleration of the deputy in LVLH, m/s^2.
        duration: of each burn, s; 0 for impulses.
    """

    def gravity(position):
        radius = np.linalg.norm(position)
        lift = 5.0 * (position[2] / radius) ** 2
        oblate = 1.5 * j2 * MU * RADIUS**2 / radius**5 * position * (np.array([1.0, 1.0, 3.0]) - lift)
        return -MU * position / radius**3 - oblate

    def axes(chief):
        radial = chief[:3] / np.linalg.norm(chief[:3])
        momentum = np.cross(chief[:3], chief[3:])
        normal = momentum / np.linalg.norm(momentum)
        return np.array([radial, np.cross(normal, radial), normal])

    def turning(chief):
        """Angular velocity of LVLH, which J2 tilts about the radial direction."""
        momentum = np.linalg.norm(np.cross(chief[:3], chief[3:]))
        radius = np.linalg.norm(chief[:3])
        frame = axes(chief)
        tilt = radius * (frame[2] @ gravity(chief[:3])) / momentum
        return frame.T @ np.array([tilt, 0.0, momentum / radius**2])

    def flow(both, seconds, command):
        def rate(_time, now):
            chief, deputy = now[:6], now[6:]
            pushed = gravity(deputy[:3]) + axes(chief).T @ command
            return np.concatenate((chief[3:], gravity(chief[:3]), deputy[3:], pushed))

        if seconds <= 0.0:
            return both
        return solve_ivp(rate, (0.0, seconds), both, method="DOP853", rtol=1e-13, atol=1e-6).y[:, -1]

    chief, own = states
    frame = axes(chief)
    apart = frame.T @ own[:3]
    moving = frame.T @ own[3:] + np.cross(turning(chief), apart)
    both, time = np.concatenate((chief, chief + np.concatenate((apart, moving)))), 0.0
    for begin, change in burns:
        if begin + duration > until:
            break
        both = flow(both, begin - time, push)
        if duration:
            both = flow(both, duration, push + change / duration)
        else:
            both[9:] += axes(both[:6]).T @ change
        time = begin + duration
    both = flow(both, until - time, push)
    frame, apart = axes(both[:6]), both[6:9] - both[:3]
    drifting = both[9:] - both[3:6] - np.cross(turning(both[:6]), apart)
    return frame @ apart, frame @ drifting


SECOND_ORDER = 5.0 * 345.0**2 / 1.1e7
"""What a model of first order errs by at the start's distance, m."""


@pytest.mark.parametrize(
    ("model", "j2", "step", "least", "most"),
    [
        ("yamanaka_ankersen", 0.0, 0.0, 0.0, SECOND_ORDER),
        ("yamanaka_ankersen", 0.0, 30.0, 0.0, SECOND_ORDER),
        ("j2_elements", J2, 30.0, 0.0, SECOND_ORDER),
        ("yamanaka_ankersen", J2, 30.0, 0.1, 10.0),
        ("cw", 0.0, 0.0, 1000.0, 2000.0),
    ],
)
def test_an_approach_about_an_eccentric_chief_meets_its_points_under_inertial_gravity(
    model, j2, step, least, most, capsys
):
    eccentricity, axis, anomaly = 0.3, 1.1e7, 40.0
    period = 2.0 * math.pi * math.sqrt(axis**3 / MU)
    mean = mean_anomaly(math.radians(anomaly), eccentricity)
    elements = np.array([axis, eccentricity, math.radians(50.0), 0.0, math.radians(70.0), mean])
    chief = np.asarray(brahe.state_koe_to_eci(elements, brahe.AngleFormat.RADIANS))
    orbit = ("--eccentricity", "0.3", "--true-anomaly", "40", "--inclination", "50", "--perigee", "70")
    plan = planned(
        capsys,
        *("approach", "--model", model, "--period", repr(period), *(orbit if model != "cw" else ())),
        *("--start", "150,-300,80,0.05,-0.1,0.02", "--acceleration", "2e-6,-3e-6,1e-6"),
        *("--point", "40,-100,30,2400,pass", "--point", "0,-50,0,1800"),
        *(("--step", str(step)) if step else ()),
    )
    burns = [(burn["time"] - 0.5 * step, np.array(burn["velocity_change"])) for burn in plan["impulses"]]
    states, push = (chief, np.array([150.0, -300.0, 80.0, 0.05, -0.1, 0.02])), np.array([2e-6, -3e-6, 1e-6])
    misses = []
    for time, place in ((2400.0, [40.0, -100.0, 30.0]), (4200.0, [0.0, -50.0, 0.0])):
        before = [burn for burn in burns if burn[0] < time]
        found, _ = two_body_difference(states, before, time, j2, push, step)
        misses.append(float(np.linalg.norm(found - place)))
    _, left = two_body_difference(states, burns, 4200.0 + step, j2, push, step)
    assert least <= max(misses) < most
    if most == SECOND_ORDER:
        assert np.linalg.norm(left) < 2e-5


BY_ELEMENTS = ("--model", "j2_elements", "--inclination", "50")


def test_an_eccentric_chief_is_refused_where_the_model_does_not_know_it(capsys) -> None:
    task = ("plan", "approach", "--start", "0,-100,0", "--point", "0,0,0,600", "--period", "6000")
    for options, words in (
        (("--eccentricity", "0.1"), "--model cw is about a circular orbit"),
        (("--model", "yamanaka_ankersen", "--eccentricity", "1.0"), "--eccentricity 1: takes 0 to below 1"),
        (("--model", "j2_elements"), "leaves the node undefined"),
        (("--model", "j2_elements", "--inclination", "190"), "--inclination 190: takes 0 to 180"),
        ((*BY_ELEMENTS, "--inclination", "nan"), "--inclination nan: takes 0 to 180 deg"),
        ((*BY_ELEMENTS, "--true-anomaly", "inf"), "--true-anomaly inf: takes -360 to 360 deg"),
        ((*BY_ELEMENTS, "--perigee", "1e300"), "--perigee 1e+300: takes -360 to 360 deg"),
        (
            (*BY_ELEMENTS, "--eccentricity", "0.9999999"),
            "--eccentricity 0.9999999: the chief's perigee has a radius of",
        ),
        ((*BY_ELEMENTS, "--period", "10"), "--period 10: the chief's perigee has a radius of"),
    ):
        assert cli.main([*task, *options]) == 2
        assert words in capsys.readouterr().err


SUNLIT = ("approach", "--start", "0,-100,0", "--date", "2025-03-21T00:00", "--longitude", "5")


@pytest.mark.parametrize(
    ("options", "found"),
    [
        (("--period", "6000"), "found 6000 s, 0 and 0 deg"),
        (("--model", "yamanaka_ankersen", "--eccentricity", "0.1"), "found 86164.0905 s, 0.1 and 0 deg"),
        (("--model", "j2_elements", "--inclination", "5"), "found 86164.0905 s, 0 and 5 deg"),
        (("--longitude", "nan"), "--longitude nan: takes -360 to 360"),
    ],
)
def test_a_sun_angle_is_given_at_a_geostationary_chief_alone(options, found, capsys) -> None:
    assert cli.main(["plan", *SUNLIT, "--point", "0,-50,0,600", *options]) == 2
    said = capsys.readouterr().err
    assert "--longitude" in said
    assert found in said


def test_a_sun_angle_is_the_angle_between_the_last_point_and_the_sun(capsys) -> None:
    angles = [
        planned(capsys, *SUNLIT, "--point", point)["light_angle"] for point in ("0,-50,0,600", "0,50,0,600")
    ]
    assert sum(angles) == pytest.approx(math.pi, abs=1e-9)
    circular = (*SUNLIT, "--point", "0,-50,0,600", "--model", "yamanaka_ankersen")
    assert planned(capsys, *circular)["light_angle"] == pytest.approx(angles[0], abs=1e-12)
    # The chief's own place lies in no direction from it.
    assert planned(capsys, *SUNLIT, "--point", "0,0,0,600")["light_angle"] is None
    assert cli.main(["plan", *SUNLIT, "--point", "0,0,0,600"]) == 0
    assert "Sun angle at the chief on arrival: none, as the tour ends at the chief" in capsys.readouterr().out
