# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What goes wrong: each fault bends just what it is about, from its first step to its last."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from flights import satellite_of
from formations import formation
from satform.communication.neighbour_buffer import Received
from satform.communication.receiver import ReceiverModel
from satform.consensus.graph import LineSpec
from satform.control.protocol import Motion
from satform.equipment.random_streams import THRUSTER_STREAM
from satform.equipment.thruster import ERRORS_PER_STEP, ThrusterSpec
from satform.flight.compile import link_plan
from satform.flight.plant import Thrusters
from satform.flight.simulate import simulate
from satform.membership.faults import (
    ByzantineSpec,
    ClockOffsetSpec,
    FaultSchedule,
    FrozenSensorSpec,
    SatelliteLostSpec,
    StuckThrusterSpec,
    WeakThrusterSpec,
    step_at,
)
from satform.membership.formation import Formation
from satform.numeric.elementwise import Array
from satform.numeric.seeded_numbers import SeededNormals
from satform.numeric.stacking import stack
from satform.scenario import Scenario

STEP = 0.5
NAMES = ("sat1", "sat2", "sat3")
RATE = 2.0
ERRORS = SeededNormals(1, THRUSTER_STREAM, [0, 1, 2], ERRORS_PER_STEP)


def faults(*specs: Any) -> FaultSchedule:
    return FaultSchedule.of(specs, NAMES, STEP)


def fired(broken: FaultSchedule, command: Array, step: int, thrusters: Thrusters | None = None) -> Array:
    """What exact thrusters of three satellites apply under faults."""
    exact = thrusters or Thrusters([0, 1, 2], stack([ThrusterSpec(dry_mass=10.0).build(STEP)] * 3), ERRORS)
    return exact.fire(command, step, broken.of_thrusters(exact.members, step))


@pytest.mark.parametrize(
    ("time", "step", "number"),
    [(0.0, 0.5, 0), (0.5, 0.5, 1), (0.6, 0.5, 2), (0.1 * 3, 0.1, 3), (0.3, 0.1, 3), (86400.0, 0.1, 864_000)],
)
def test_a_moment_s_step_is_the_first_that_does_not_begin_before_it(
    time: float, step: float, number: int
) -> None:
    assert step_at(time, step) == number


def test_a_weak_thruster_gives_its_part_while_the_fault_lasts() -> None:
    broken = faults(WeakThrusterSpec(satellite="sat2", at=1.0, until=2.0, factor=0.25))
    given = np.arange(9.0).reshape(3, 3)
    for step in range(6):
        found = fired(broken, given, step)
        factor = 0.25 if step in {2, 3} else 1.0
        assert np.array_equal(found, given * np.array([1.0, factor, 1.0])[:, None])
    assert np.array_equal(given, np.arange(9.0).reshape(3, 3))


def test_a_stuck_thruster_goes_on_as_in_the_step_before() -> None:
    broken = faults(StuckThrusterSpec(satellite="sat1", at=1.0, until=3.0))
    thrusters = Thrusters([0, 1, 2], stack([ThrusterSpec(dry_mass=10.0).build(STEP)] * 3), ERRORS)
    for step in range(8):
        given = np.full((3, 3), float(step))
        found = fired(broken, given, step, thrusters)
        assert np.all(found[0] == (1.0 if 2 <= step < 6 else step))
        assert np.all(found[1:] == step)


def test_a_sensor_that_freezes_gives_its_reading_again_and_again() -> None:
    broken = faults(FrozenSensorSpec(satellite="sat3", at=1.0, until=3.0))
    held: dict[int, tuple[Array, Array]] = {}
    for step in range(8):
        position, velocity = broken.reading(
            np.full((3, 3), float(step)), np.full((3, 3), -float(step)), step, held
        )
        frozen = 2.0 if 2 <= step < 6 else step
        assert np.all(position[2] == frozen)
        assert np.all(velocity[2] == -frozen)
        assert np.all(position[:2] == step)


def test_a_wrong_clock_is_ahead_by_its_offset_while_the_fault_lasts() -> None:
    broken = faults(
        ClockOffsetSpec(satellite="sat1", at=1.0, until=2.0, offset=3.0),
        ClockOffsetSpec(satellite="sat1", at=1.5, offset=0.25),
    )
    assert broken.any_clock
    assert [broken.clock(0, step) for step in range(6)] == [0.0, 0.0, 3.0, 3.25, 0.25, 0.25]
    assert broken.clock(1, 3) == 0.0


def test_a_liar_adds_to_what_it_says_and_more_and_more_when_it_drifts() -> None:
    broken = faults(
        ByzantineSpec(satellite="sat2", at=1.0, until=3.0, arc_length=100.0, drift=2.0, rate=-1.0)
    )
    assert broken.is_byzantine(1)
    assert not broken.is_byzantine(0)
    for step in range(8):
        found = broken.corrupt(1, np.array([10.0, 5.0]), step)
        lie = [100.0 + 2.0 * (step - 2) * STEP, -1.0] if 2 <= step < 6 else [0.0, 0.0]
        assert (found - [10.0, 5.0]).tolist() == lie


@pytest.mark.parametrize(
    ("spec", "fields", "sentence"),
    [
        (SatelliteLostSpec, {"at": 0.0}, "a satellite that never flies is left out instead"),
        (SatelliteLostSpec, {"at": 5.0, "rejoin_at": 4.0}, "rejoin_at 4 s is earlier than at 5 s"),
        (WeakThrusterSpec, {"at": 5.0, "until": 5.0, "factor": 0.5}, "until 5 s is not later than at 5 s"),
        (WeakThrusterSpec, {"at": 5.0, "factor": -0.5}, "greater than or equal to 0"),
        (ClockOffsetSpec, {"at": 5.0, "offset": 1e7}, "less than or equal to 1000000"),
    ],
)
def test_a_fault_that_cannot_be_is_refused(spec: Any, fields: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        spec(satellite="sat1", **fields)


def two(neighbour_values: str = "extrapolate", **other: Any) -> Scenario:
    return formation(
        [{}, {}],
        10.0,
        graph={"kind": "line"},
        consensus={"neighbour_values": neighbour_values},
        **other,
    )


def perceived(scenario: Scenario, listener: int, values: tuple[float, float], step: int) -> float:
    """Phase that a satellite takes its neighbour to have, from the pull that it feels."""
    ears = ReceiverModel(link_plan(scenario), np.asarray(listener), [[1 - listener]])
    satellite = satellite_of(scenario, listener)
    satellite.join(step)
    formation_now = Formation.of(scenario.membership_plan())
    told = ears.receive(step, np.array([values]), np.array([step * STEP]), np.ones(1), formation_now)
    own = satellite.state.arc_length
    satellite.act(Motion(np.array([1000.0, 0.0, 0.0]), np.zeros(3)), told)
    gains = scenario.consensus
    pull = (satellite.state.rate - RATE) / STEP
    return float(own + pull / gains.coupling_gain)


@pytest.mark.parametrize(("liar_of_time", "sign"), [("sat2", -1.0), ("sat1", 1.0)])
def test_a_wrong_clock_shifts_the_phase_that_is_perceived_by_the_rate_times_its_offset(
    liar_of_time: str, sign: float
) -> None:
    # A word from a clock that is ahead seems younger than it is, so that it is carried on too little.
    wrong = two(faults=[{"kind": "clock_offset", "satellite": liar_of_time, "at": 0.0, "offset": 7.0}])
    values = (50.0, RATE)
    right = perceived(two(), 0, values, 10)
    assert right == pytest.approx(50.0, abs=1e-9)
    assert perceived(wrong, 0, values, 10) - right == pytest.approx(sign * RATE * 7.0, abs=1e-9)


def test_two_clocks_that_are_wrong_alike_are_right_for_each_other() -> None:
    alike = [{"kind": "clock_offset", "satellite": name, "at": 0.0, "offset": 7.0} for name in NAMES[:2]]
    assert perceived(two(faults=alike), 0, (50.0, RATE), 10) == pytest.approx(50.0, abs=1e-9)


def test_a_wrong_clock_does_not_matter_to_satellites_that_hold_values() -> None:
    wrong = [{"kind": "clock_offset", "satellite": "sat2", "at": 0.0, "offset": 7.0}]
    assert simulate(two("hold", faults=wrong)).differences(simulate(two("hold"))) == []


@pytest.mark.parametrize("links", [None, {}])
def test_a_word_of_a_clock_that_is_far_behind_counts_as_too_old_whatever_the_links(links: Any) -> None:
    late = [{"kind": "clock_offset", "satellite": "sat2", "at": 0.0, "offset": -100.0}]
    pulled = [{"arc_length": 0.0}, {"arc_length": 500.0}]
    record = simulate(formation(pulled, 10.0, graph={"kind": "line"}, faults=late, links=links))
    assert np.all(record.rate[:, 0] == RATE)
    # To the other one its words come from the future, and count.
    assert record.rate[-1, 1] < RATE


def test_a_lie_is_heard_by_the_neighbours_and_is_on_record_but_changes_nothing_in_the_liar() -> None:
    lie = [{"kind": "byzantine", "satellite": "sat1", "at": 2.0, "arc_length": 300.0}]
    single = {"kind": "matrix", "rows": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}
    honest, lied = (simulate(formation([{}, {}, {}], 10.0, graph=single, faults=told)) for told in ([], lie))
    assert np.array_equal(lied.position[:, 0], honest.position[:, 0])
    assert (lied.arc_length - honest.arc_length)[:, 0].tolist() == [0.0] * 4 + [300.0] * 17
    assert np.array_equal(lied.arc_length[:5, 1], honest.arc_length[:5, 1])
    gain = 2.5e-3
    assert lied.rate[5, 1] - honest.rate[5, 1] == pytest.approx(gain * 300.0 * STEP, rel=1e-12)


def test_what_breaks_in_the_equipment_of_one_satellite_is_felt_by_that_one_alone() -> None:
    def flown(*broken: dict[str, Any]) -> Any:
        each = {"position_error": [3.0, -2.0, 1.0], "sensor": {}, "thruster": {"dry_mass": 100.0}}
        return simulate(formation([each, each], 20.0, graph={"kind": "none"}, faults=list(broken)))

    whole = flown()
    for kind, more in (("weak_thruster", {"factor": 0.0}), ("stuck_thruster", {}), ("frozen_sensor", {})):
        broken = flown({"kind": kind, "satellite": "sat2", "at": 5.0, **more})
        assert np.array_equal(broken.position[:, 0], whole.position[:, 0])
        assert np.array_equal(broken.position[:11, 1], whole.position[:11, 1])
        assert not np.array_equal(broken.position[12:, 1], whole.position[12:, 1])


def test_line_graph_of_two_is_what_the_tests_above_take_it_for() -> None:
    assert LineSpec().build(2).neighbours(0) == (1,)


def test_post_from_a_wrong_clock_is_never_called_complete() -> None:
    assert not Received.whole(np.zeros((1, 2)), np.zeros(1)).shifted(np.array([5.0])).complete
