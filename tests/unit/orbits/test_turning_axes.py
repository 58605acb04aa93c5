# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Points at rest in inertial axes and in axes that point at the Sun: brahe's Sun, closed forms, a flight."""

import math
from datetime import UTC, datetime
from typing import Any

import brahe
import numpy as np
import pytest

from flights import shipped
from satform.flight.chief_motion import chief_motion
from satform.flight.compile import compile_scenario
from satform.flight.online_parameters import OnlineParameters
from satform.flight.satellite import Satellite
from satform.flight.simulate import simulate
from satform.numeric import stacking
from satform.orbits.chief import KeplerianChief
from satform.orbits.curve import FixedPoint
from satform.orbits.inertial_motion import ChiefMotion, unperturbed
from satform.orbits.path_reference import Reference
from satform.orbits.turning_axes import AxesByStep, TurningPointPath, axes_by_step

DATE = datetime(2025, 3, 21, tzinfo=UTC)
STEP = 20.0
PROBA3 = KeplerianChief(36943.0e3, 0.8111, 1.03, 2.67, 3.28, 2.0)
CIRCULAR = KeplerianChief(7.0e6, 0.0, 0.9, 0.4, 0.0, 0.0)
STILL = np.zeros(())


def motion_of(chief: KeplerianChief, steps: int, step: float = STEP) -> ChiefMotion:
    return ChiefMotion(DATE, unperturbed(chief, step * np.arange(steps + 1)))


def sun_from(position: np.ndarray, seconds: float) -> np.ndarray:
    """Unit vector from a place to brahe's Sun, computed without the project's functions of dates."""
    epoch = brahe.Epoch.from_datetime(2025, 3, 21, 0, 0, 0.0, 0.0, brahe.TimeSystem.UTC) + seconds
    towards = brahe.sun_position(epoch) - position
    return towards / np.linalg.norm(towards)


def path_of(axes: AxesByStep, position: tuple[float, float, float]) -> TurningPointPath:
    return TurningPointPath(FixedPoint(np.array(position), np.zeros(())), np.asarray(1.0), axes=axes)


def at(path: Any, step: int) -> Reference:
    return path.at_step(STILL, STILL, STILL, STEP, step)


def test_a_baseline_along_the_axes_of_the_sun_points_at_brahe_s_sun_from_the_chief() -> None:
    motion = motion_of(PROBA3, 30)
    path = path_of(axes_by_step("sun", motion, STEP), (150.0, 0.0, 0.0))
    for step in (0, 11, 29):
        frame = stacking.item(motion.frames, step)
        baseline = frame.vector_to_inertial(at(path, step).position)
        assert baseline == pytest.approx(150.0 * sun_from(motion.position[step], step * STEP), abs=1e-9)
        across = frame.vector_to_inertial(stacking.item(axes_by_step("sun", motion, STEP).matrix, step)[:, 2])
        assert across @ baseline == pytest.approx(0.0, abs=1e-9)
        assert across[2] > 0.0


def test_a_point_of_inertial_axes_circles_the_chief_backwards_once_an_orbit() -> None:
    rate = CIRCULAR.mean_motion
    motion = motion_of(CIRCULAR, 40)
    start = tuple((100.0 * motion.frames.radial[0] + 7.0 * motion.frames.normal[0]).tolist())
    path = path_of(axes_by_step("inertial", motion, STEP), start)
    for step in (0, 1, 39):
        angle, found = rate * step * STEP, at(path, step)
        assert found.position == pytest.approx([100 * math.cos(angle), -100 * math.sin(angle), 7.0], abs=1e-7)
        turned = [-100 * rate * math.sin(angle), -100 * rate * math.cos(angle), 0.0]
        assert found.velocity == pytest.approx(turned, abs=1e-9)
        # The mean of the acceleration over the step is the one at its middle times sinc of half the angle.
        middle, half = angle + 0.5 * rate * STEP, 0.5 * rate * STEP
        size = -100.0 * rate**2 * math.sin(half) / half
        inward = [size * math.cos(middle), -size * math.sin(middle), 0.0]
        assert found.acceleration == pytest.approx(inward, abs=1e-12)


@pytest.mark.parametrize("name", ["inertial", "sun"])
def test_position_velocity_and_acceleration_of_a_point_belong_together(name: Any) -> None:
    path = path_of(axes_by_step(name, motion_of(PROBA3, 20), STEP), (150.0, -40.0, 25.0))
    for step in (0, 18):
        now, then = at(path, step), at(path, step + 1)
        carried = now.position + STEP * now.velocity + 0.5 * STEP**2 * now.acceleration
        assert carried == pytest.approx(then.position, abs=1e-7)
        assert now.velocity + STEP * now.acceleration == pytest.approx(then.velocity, abs=1e-12)
    at_zero = path.reference(STILL, STILL, STILL)
    assert np.array_equal(at_zero.position, at(path, 0).position)
    assert np.array_equal(at(path, 400).position, at(path, 19).position)


def test_stacked_paths_have_the_bits_of_each_alone() -> None:
    axes = axes_by_step("sun", motion_of(PROBA3, 5), STEP)
    paths = [path_of(axes, (150.0, 0.0, 0.0)), path_of(axes, (25.0, 3.0, -8.0))]
    both = stacking.stack(paths)
    together = both.at_step(np.zeros(2), np.zeros(2), np.zeros(2), STEP, 3)
    for row, path in enumerate(paths):
        alone = at(path, 3)
        assert np.array_equal(together.position[row], alone.position)
        assert np.array_equal(together.velocity[row], alone.velocity)
        assert np.array_equal(together.acceleration[row], alone.acceleration)


def test_the_baseline_that_is_flown_points_at_the_sun_in_inertial_space() -> None:
    changes = [f"satellites.1.{field}=null" for field in ("sensor", "filter", "thruster")]
    changes += ["satellites.1.position_error=[0, 0, 0]", "timing.duration=1600.0", "expect=[]"]
    # Sunlight on different bodies is a disturbance that no feed-forward knows.
    changes += ["dynamics.solar_pressure=false"]
    scenario = shipped("proba3_coronagraph", *changes)
    record, motion = simulate(scenario), chief_motion(scenario, scenario.timing.steps)
    assert motion is not None
    places, _ = motion.of_satellites(record.position, record.velocity)
    for step in (1, 40, 80):
        baseline = places[step, 1] - places[step, 0]
        wanted = 150.0 * sun_from(places[step, 0], step * STEP)
        assert np.linalg.norm(baseline - wanted) < 2e-6


def test_a_point_moved_in_flight_is_flown_from_the_next_step_on() -> None:
    plan = compile_scenario(shipped("proba3_coronagraph", "timing.duration=200.0", "expect=[]"))
    satellite = Satellite(plan.satellite(1))
    before = at(satellite.plan.path, 4).position
    OnlineParameters(plan.parameters(1)).set(satellite, "curve.position", [75.0, 0.0, 0.0])
    assert at(satellite.plan.path, 4).position == pytest.approx(0.5 * before, abs=1e-12)


def test_a_picture_has_the_point_where_it_is_in_lvlh_at_the_start() -> None:
    plan = compile_scenario(shipped("proba3_coronagraph", "timing.duration=200.0", "expect=[]"))
    shown = plan.scene.curves[1].point(STILL).position
    assert np.array_equal(shown, at(plan.satellite(1).path, 0).position)


def test_a_flight_of_more_steps_than_axes_are_computed_for_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"flown for at most 200000 control periods, and this flight has 400000"
    ):
        shipped("proba3_coronagraph", "timing={step: 20.0, duration: 8.0e6}", "expect=[]")


def test_without_a_date_there_are_no_other_axes_than_lvlh() -> None:
    with pytest.raises(ValueError, match=r"curve of occulter: an inertial_point needs .* found cw"):
        shipped("proba3_coronagraph", "dynamics={kind: cw}")


def test_no_satellite_points_at_one_whose_place_its_arc_length_does_not_tell() -> None:
    pointing = "{pointing: {kind: satellite_pointing, target: occulter}}"
    with pytest.raises(ValueError, match=r"it cannot point at occulter, whose curve is an inertial_point"):
        shipped("proba3_coronagraph", f"satellites.0.attitude={pointing}", "graph={kind: complete}")
