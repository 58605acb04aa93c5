# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A satellite that is restored in the middle of a flight flies on with the same bits."""

import io
from pathlib import Path

import numpy as np
import pytest

from flights import satellite_of, satellites_together, shortened
from satform.common.spec import specs
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import Motion
from satform.flight.checkpoint import restore, save
from satform.flight.satellite import Satellite
from satform.scenario import Scenario

NOBODY = Received.whole(np.zeros((0, 2)), np.zeros(0))
MEMORIES = {
    "adaptive_tracking": "{kind: adaptive_tracking, weight_rate: 1.0}",
    "lqi": "{kind: lqi}",
    "lqr": "{kind: lqr}",
    "feedback_linearisation": "{kind: feedback_linearisation}",
    "sliding_mode": "{kind: sliding_mode, proportional_gain: 0.01, switching_gain: 0.1, reaching_gain: 0.1}",
    "periodic_lqr": "{kind: periodic_lqr}",
    "relative_elements": "{kind: relative_elements}",
    "mean_relative_elements": "{kind: mean_relative_elements}",
    "coast": "{kind: coast}",
    "integral": "{kind: integral, law: {kind: observer, law: {kind: lqr}}, gain: 1.0e-6,"
    " integration_band: 5.0e3}",
    "observer": "{kind: observer, law: {kind: lqi}, initial_position_error: [5.0, -3.0, 1.0]}",
    "impulsive_guidance": "{kind: impulsive_guidance, waypoints: ["
    "{position: [0, -8e4, 0], duration: 20.0, arrival: pass},"
    " {position: [0, -5e4, 0], duration: 13.0}]}",
    "model_predictive": "{kind: model_predictive, horizon: 60.0, interval: 5.0,"
    " keep_out: [{kind: sphere, radius: 10.0}]}",
    "timed_burns": "{kind: timed_burns, burns: [{time: 10.0, velocity_change: [0, 1, 0]},"
    " {time: 24.0, velocity_change: [1, 0, 0]}]}",
}


def scenario_with(controller: str) -> Scenario:
    return shortened("trajectory_tracking", 60.0, f"satellites.0.controller={controller}")


def with_filter() -> Scenario:
    return shortened(
        "trajectory_tracking",
        60.0,
        "satellite_defaults={sensor: {position_noise: 1.0, velocity_noise: 0.01, update_period: 4.0,"
        " latency: 1.0},"
        " filter: {acceleration_density: 1.0e-3}}",
    )


def moments(count: int) -> list[Motion]:
    random = np.random.default_rng(5)
    return [Motion(1e4 * random.standard_normal(3), 10.0 * random.standard_normal(3)) for _ in range(count)]


def flown(satellite: Satellite, motions: list[Motion]) -> list[np.ndarray]:
    return [satellite.act(motion, NOBODY).acceleration for motion in motions]


@pytest.mark.parametrize("step", [0, 1, 15])
@pytest.mark.parametrize("kind", sorted(MEMORIES))
def test_a_restored_satellite_flies_on_with_the_same_bits(kind: str, step: int) -> None:
    scenario, motions = scenario_with(MEMORIES[kind]), moments(40)
    whole = satellite_of(scenario, 0)
    flown(whole, motions[:step])
    kept = save(whole)
    expected = flown(whole, motions[step:])
    restarted = satellite_of(scenario, 0)
    restore(restarted, kept)
    found = flown(restarted, motions[step:])
    assert np.array_equal(np.array(found), np.array(expected))
    assert save(restarted) == save(whole)


def test_every_controller_of_this_project_is_tried() -> None:
    ours = {
        kind for kind, spec in specs("satform.controllers").items() if spec.__module__.startswith("satform.")
    }
    assert ours == {*MEMORIES, "artificial_potential"}


def test_what_was_learnt_of_unknown_forces_is_restored_too() -> None:
    scenario, motions = shortened("directed_triangle", 2.0), moments(30)
    whole, restarted = satellite_of(scenario, 0), satellite_of(scenario, 0)

    def follow(satellite: Satellite, chosen: list[Motion]) -> list[np.ndarray]:
        said = Received.whole(np.array([[50.0, 20.0, 0.0, 0.0, 0.0, 0.0]]), np.zeros(1))
        return [satellite.act(motion, said).acceleration for motion in chosen]

    follow(whole, motions[:12])
    restore(restarted, save(whole))
    assert np.array_equal(follow(restarted, motions[12:]), follow(whole, motions[12:]))
    assert save(restarted) == save(whole)


def test_a_controller_with_memory_flies_differently_when_it_is_not_restored() -> None:
    scenario, motions = scenario_with(MEMORIES["lqi"]), moments(20)
    whole, fresh = satellite_of(scenario, 0), satellite_of(scenario, 0)
    flown(whole, motions[:10])
    assert not np.array_equal(flown(whole, motions[10:]), flown(fresh, motions[10:]))


def test_the_filter_s_memory_is_restored_too() -> None:
    scenario, motions = with_filter(), moments(30)

    def rarely_told(satellite: Satellite, steps: range) -> list[np.ndarray]:
        # A measurement in four steps, and each a step late.
        told = [max(0, 4 * ((step - 1) // 4)) for step in steps]
        return [satellite.act(motions[at], NOBODY, at).acceleration for at in told]

    whole, restarted = satellite_of(scenario, 0), satellite_of(scenario, 0)
    rarely_told(whole, range(12))
    assert whole.state.estimate is not None
    assert whole.state.estimate.commands
    restore(restarted, save(whole))
    assert np.array_equal(rarely_told(restarted, range(12, 30)), rarely_told(whole, range(12, 30)))


def test_several_satellites_flown_as_one_are_restored_together() -> None:
    scenario = shortened("triangle", 20.0, "satellite_defaults.controller={kind: lqi}")
    together, again = satellites_together(scenario, range(3)), satellites_together(scenario, range(3))
    random = np.random.default_rng(2)
    motions = [Motion(*(1e4 * random.standard_normal((2, 3, 3)))) for _ in range(20)]
    alone = Received.whole(np.zeros((3, 2, 2)), np.zeros((3, 2)), np.zeros((3, 2)))
    for motion in motions[:10]:
        together.act(motion, alone)
    restore(again, save(together))
    for motion in motions[10:]:
        assert np.array_equal(again.act(motion, alone).acceleration, together.act(motion, alone).acceleration)


def test_a_checkpoint_of_another_kind_of_satellite_is_refused_in_words() -> None:
    lqi, observer = (satellite_of(scenario_with(MEMORIES[kind]), 0) for kind in ("lqi", "observer"))
    flown(lqi, moments(3))
    with pytest.raises(ValueError, match=r"another kind of satellite: memory\.position is missing"):
        restore(observer, save(lqi))
    lqr = satellite_of(scenario_with(MEMORIES["lqr"]), 0)
    with pytest.raises(ValueError, match=r"it holds memory\.integral"):
        restore(lqr, save(lqi))
    several = satellites_together(
        shortened("triangle", 20.0, "satellite_defaults.controller={kind: lqi}"), range(3)
    )
    with pytest.raises(ValueError, match="of shape"):
        restore(several, save(lqi))


@pytest.mark.parametrize("data", [b"", b"nonsense", b"PK\x05\x06" + bytes(18)])
def test_bytes_that_are_no_checkpoint_are_refused_in_words(data: bytes) -> None:
    with pytest.raises(ValueError, match="checkpoint"):
        restore(satellite_of(scenario_with(MEMORIES["lqr"]), 0), data)


def test_a_pickled_object_is_never_opened(tmp_path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[object, ...]:
            return (Path.touch, (tmp_path / "sprung",))

    buffer = io.BytesIO()
    np.savez(buffer, step=np.array([Trap()], dtype=object))
    with pytest.raises(ValueError, match="no checkpoint"):
        restore(satellite_of(scenario_with(MEMORIES["lqr"]), 0), buffer.getvalue())
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize("step", [1, 15])
@pytest.mark.parametrize("kind", ["filter", *sorted(MEMORIES)])
def test_a_satellite_that_leaves_a_stack_flies_on_with_the_same_bits(kind: str, step: int) -> None:
    scenario = with_filter() if kind == "filter" else scenario_with(MEMORIES[kind])
    others, motions = moments(80)[40:], moments(40)
    nobody = Received.whole(np.zeros((2, 0, 2)), np.zeros((2, 0)))
    together = satellites_together(scenario, [0, 0])
    for own, other in zip(motions[:step], others[:step], strict=True):
        position, velocity = (own.position, other.position), (own.velocity, other.velocity)
        together.act(Motion(np.stack(position), np.stack(velocity)), nobody)

    single = satellite_of(scenario, 0)
    flown(single, motions[:step])
    leaver = together.single(0, single.plan, 0)

    restore(satellite_of(scenario, 0), save(leaver))
    np.testing.assert_array_equal(flown(leaver, motions[step:]), flown(single, motions[step:]))
