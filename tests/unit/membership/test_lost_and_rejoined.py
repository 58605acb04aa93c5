# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellites that are lost, come back, are adjusted in flight, and hear over links: in process."""

from typing import Any

import numpy as np
import pytest

from flights import SCENARIOS, begun, satellite_of, shipped
from formations import RATE, formation
from satform.communication.channel_model import LinkSpec
from satform.evaluation.arc_lengths import ArcLengthRate, ArcLengthSpread
from satform.evaluation.evaluate import judge
from satform.evaluation.presence import RejoinTime, StepsAbsent
from satform.evaluation.tracking import SettlingTime, TrackingError
from satform.flight.satellite import Satellite
from satform.flight.simulate import simulate
from satform.membership.formation import ParameterChanged, Plan, SatelliteLost, SatelliteRejoined
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

pytestmark = pytest.mark.unmeasured

STEP = 0.5
LOST = {"kind": "satellite_lost", "satellite": "sat2", "at": 5.0}


def three(**other: Any) -> Scenario:
    satellites = [{"arc_length": 100.0 * i, "position_error": [2.0 * i, 1.0, -1.0]} for i in range(3)]
    return formation(satellites, 20.0, **other)


def test_a_lost_satellite_is_heard_once_more_and_then_silent() -> None:
    whole, lost = simulate(three()), simulate(three(faults=[LOST]))
    # Its last word was said for the step in which it is lost, and moves its neighbours in that step.
    assert np.array_equal(lost.arc_length[:11], whole.arc_length[:11])
    assert np.array_equal(lost.rate[:12, [0, 2]], whole.rate[:12, [0, 2]])
    assert not np.array_equal(lost.rate[12, [0, 2]], whole.rate[12, [0, 2]])
    assert np.isnan(lost.arc_length[11:, 1]).all()


def test_a_lost_satellite_drifts_on_without_commands_and_decides_nothing() -> None:
    lost = simulate(three(faults=[LOST]))
    assert np.all(lost.acceleration[10:, 1] == 0.0)
    assert np.isfinite(lost.position).all()
    for name in ("reference_position", "reference_velocity", "reference_acceleration", "sliding_variable"):
        series = getattr(lost, name)
        assert np.isnan(series[10:, 1]).all()
        assert np.isfinite(series[:10, 1]).all()
        assert np.isfinite(series[:, [0, 2]]).all()
    assert lost.absent.tolist() == [[False, step >= 10, False] for step in range(40)]


def test_the_word_of_a_lost_satellite_counts_until_it_is_dropped() -> None:
    rates = {}
    for bound in (3.0, 60.0):
        law = {"neighbour_values": "extrapolate", "neighbour_timeout": bound}
        rates[bound] = simulate(three(faults=[LOST], consensus=law)).rate[:, [0, 2]]
    # The last word is of 5 s, so that at 8 s it is as old as it may be.
    assert np.array_equal(rates[3.0][:18], rates[60.0][:18])
    assert not np.array_equal(rates[3.0][18], rates[60.0][18])


def test_a_formation_without_its_lost_member_agrees_as_one_that_never_had_it() -> None:
    law = {"neighbour_timeout": 0.5}
    without = {"kind": "matrix", "rows": [[0, 0, 1], [0, 0, 0], [1, 0, 0]]}
    first = {"kind": "satellite_lost", "satellite": "sat2", "at": 1e-3}
    lost = simulate(three(faults=[first], consensus=law))
    single = simulate(three(graph=without, graph_schedule=[], consensus=law))
    # Both start together a step or two later, and end in the same agreement of the other two.
    assert np.ptp(lost.arc_length[-1, [0, 2]]) == pytest.approx(
        np.ptp(single.arc_length[-1, [0, 2]]), rel=0.05
    )


def test_with_its_plan_alone_a_satellite_comes_back_where_its_plan_has_it() -> None:
    back = simulate(three(faults=[{**LOST, "rejoin_at": 10.0, "memory": "plan"}]))
    assert back.arc_length[20, 1] == pytest.approx(100.0 + RATE * 10.0, rel=1e-12)
    assert back.rate[20, 1] == RATE
    assert back.absent[:, 1].tolist() == [10 <= step < 20 for step in range(40)]


def test_with_its_checkpoint_it_comes_back_where_its_last_rate_has_carried_it() -> None:
    whole = simulate(three())
    back = simulate(three(faults=[{**LOST, "rejoin_at": 10.0}], checkpoint_period=2.0))
    # The last checkpoint before 5 s is that of 4 s.
    expected = whole.arc_length[8, 1] + 6.0 * whole.rate[8, 1]
    assert back.arc_length[20, 1] == pytest.approx(expected, rel=1e-12)


def test_before_the_first_checkpoint_the_plan_is_all_there_is() -> None:
    fault = {**LOST, "rejoin_at": 10.0}
    early, plan = (
        simulate(three(faults=[{**fault, "memory": memory}], checkpoint_period=7.0))
        for memory in ("checkpoint", "plan")
    )
    assert early.differences(plan) == []


def test_a_satellite_may_be_lost_twice() -> None:
    twice = [{**LOST, "rejoin_at": 10.0}, {**LOST, "at": 12.0, "rejoin_at": 15.0}]
    record = simulate(three(faults=twice, checkpoint_period=2.0))
    assert np.flatnonzero(record.absent[:, 1]).tolist() == [*range(10, 20), *range(24, 30)]


def undisturbed(scenario: Scenario, at: int, flight: FlightRecord | None = None) -> list[str]:
    """Differences that a loss and return of everyone at a checkpoint's own step make."""
    count = len(scenario.satellites)
    events: Plan = {
        at: [
            *(SatelliteLost(place, "tested") for place in range(count)),
            *(SatelliteRejoined(place, at) for place in range(count)),
        ]
    }
    return simulate(scenario, events=events).differences(flight or simulate(scenario))


def takes_time(link: LinkSpec) -> bool:
    """Whether messages over a link arrive later than in the step in which they are sent."""
    return link.delay > 0.0 or (link.channel is not None and link.channel.light_time)


def test_light_time_delays_a_message_and_a_channel_without_it_does_not() -> None:
    radio = {"kind": "radio", "frequency": 2.2e9, "power": 10.0, "rate": 1e3}
    differing = []
    for light_time in (True, False):
        links = {"default": {"channel": {**radio, "light_time": light_time}}}
        differing.append(bool(undisturbed(three(links=links, checkpoint_period=4.0), 16)))
    assert differing == [True, False]


@pytest.mark.parametrize("file", sorted(SCENARIOS.glob("*.yaml")), ids=lambda file: file.stem)
def test_a_return_at_the_checkpoint_s_own_step_changes_no_bit_of_any_shipped_scenario(file: Any) -> None:
    whole = shipped(file.stem)
    late = whole.links is not None and takes_time(whole.links.default)
    # Long enough for the first words to arrive where they take their time.
    interval = 32 if late else 5
    scenario, flight = begun(file.stem, interval)
    filters = [whole.satellite(index).navigation for index in range(len(whole.satellites))]
    exchange = any(own is not None and own.exchange != "none" for own in filters)
    # What was under way to a satellite is lost with it, and in the step of a loss no estimate is exchanged.
    assert bool(undisturbed(scenario, 2 * interval, flight)) == (late or exchange)


MORE = {
    "lqi": {"kind": "lqi"},
    "feedback_linearisation": {"kind": "feedback_linearisation"},
    "relative_elements": {"kind": "relative_elements"},
    "mean_relative_elements": {"kind": "mean_relative_elements"},
    "coast": {"kind": "coast"},
    "observer": {"kind": "observer", "law": {"kind": "lqi"}, "initial_position_error": [5.0, -3.0, 1.0]},
}


@pytest.mark.parametrize("kind", sorted(MORE))
def test_a_return_at_the_checkpoint_s_own_step_changes_no_bit_of_any_controller(kind: str) -> None:
    each = {"controller": MORE[kind], "position_error": [3.0, -2.0, 1.0]}
    scenario = formation([each, {**each, "arc_length": 50.0}], 12.0, checkpoint_period=4.0)
    assert undisturbed(scenario, 16) == []


@pytest.mark.parametrize("graph", ["complete", "ring", "star"])
def test_links_and_a_changing_graph_give_the_same_bits_one_by_one_and_as_one(graph: str) -> None:
    scenario = three(
        graph={"kind": graph},
        seed=7,
        links={
            "default": {"loss": 0.3, "delay": 1.0, "jitter": 1.0, "duplication": 0.2, "reordering": 0.2},
            "edges": [{"sender": "sat1", "receiver": "sat2", "delay": 3.0}],
        },
        graph_schedule=[
            {"at": 5.0, "graph": {"kind": "line"}},
            {"at": 8.0, "add": [["sat1", "sat3"]], "remove": [["sat2", "sat1"]]},
            {"at": 12.0, "graph": {"kind": "none"}},
            {"at": 15.0, "graph": {"kind": "complete"}},
        ],
        faults=[{"kind": "clock_offset", "satellite": "sat1", "at": 3.0, "offset": 2.0}],
        consensus={"neighbour_values": "extrapolate"},
    )
    assert simulate(scenario, stacked=True).differences(simulate(scenario, stacked=False)) == []


def test_links_that_do_nothing_change_no_bit() -> None:
    assert simulate(three(links={})).differences(simulate(three())) == []


def test_events_that_happened_give_the_bits_of_events_that_were_planned() -> None:
    fault = {**LOST, "rejoin_at": 10.0, "memory": "plan"}
    happened = {10: [SatelliteLost(1, "its process ended")], 20: [SatelliteRejoined(1, None)]}
    assert simulate(three(faults=[fault])).differences(simulate(three(), events=happened)) == []


def test_a_return_of_one_who_flies_changes_no_bit() -> None:
    events: Plan = {10: [SatelliteRejoined(1, None)]}
    assert simulate(three(), events=events).differences(simulate(three())) == []


def joined() -> Satellite:
    """Of three, the second at its step 20, which has heard nobody and done nothing."""
    satellite = satellite_of(three(), 1)
    satellite.join(20)
    return satellite


def test_a_satellite_that_joins_has_its_arc_length_carried_on_at_its_rate() -> None:
    satellite = joined()
    assert satellite.state.step == 20
    assert satellite.state.arc_length == pytest.approx(100.0 + 20 * STEP * RATE)
    said = satellite.announce()
    assert (float(said.time), float(said.rate)) == (10.0, RATE)
    assert said.arc_length == satellite.state.arc_length


def test_joining_at_the_step_that_comes_next_changes_nothing() -> None:
    satellite = satellite_of(three(), 1)
    before = satellite.state
    satellite.join(0)
    assert satellite.state is before


def adjusted(name: str, *value: float, **other: Any) -> FlightRecord:
    return simulate(three(**other), events={10: [ParameterChanged(1, name, value)]})


def test_an_orbit_changed_in_flight_is_flown_from_that_step_on_and_a_lap_stays_a_lap() -> None:
    period = 40.0
    smaller = simulate(
        formation([{}], 60.0, nominal_motion={"period": period}),
        events={10: [ParameterChanged(0, "curve.radius", (250.0,))]},
    )
    angle = np.arctan2(smaller.reference_position[:, 0, 1], smaller.reference_position[:, 0, 0])
    radius = np.linalg.norm(smaller.reference_position[:, 0], axis=-1)
    assert radius[9] == pytest.approx(1000.0)
    assert radius[10:] == pytest.approx(250.0)
    # The angle goes on as if nothing had happened: once round in the same period.
    turned = np.unwrap(angle)
    assert turned == pytest.approx(2.0 * np.pi * smaller.time[:-1] / period, abs=1e-9)
    assert np.ptp(smaller.rate) < 1e-9


def test_a_phase_changed_in_flight_is_where_the_formation_agrees_on_from_then_on() -> None:
    satellites = [{"arc_length": 0.0} for _ in range(2)]
    record = simulate(
        formation(satellites, 400.0), events={10: [ParameterChanged(1, "phase.offset", (300.0,))]}
    )
    places = np.unwrap(np.arctan2(record.position[..., 1], record.position[..., 0]), axis=0)[-1] * 1000.0
    assert places[1] - places[0] == pytest.approx(300.0, abs=0.05)


def test_a_gain_changed_in_flight_acts_from_that_step_on() -> None:
    whole, changed = simulate(three()), adjusted("controller.proportional_gain", 0.05)
    assert np.array_equal(changed.acceleration[:10], whole.acceleration[:10])
    assert not np.array_equal(changed.acceleration[10, 1], whole.acceleration[10, 1])
    assert np.array_equal(changed.acceleration[:, [0, 2]], whole.acceleration[:, [0, 2]])


def test_a_value_per_axis_is_changed_on_each_axis() -> None:
    one = adjusted("controller.proportional_gain", 0.05)
    three_alike = adjusted("controller.proportional_gain", 0.05, 0.05, 0.05)
    assert one.differences(three_alike) == []


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("controller.gains", (1.0,), "there is no such field"),
        ("controller", (1.0,), "there is no such parameter"),
        ("thrust.gain", (1.0,), "there is no such parameter"),
        ("controller.proportional_gain.x", (1.0,), "there is no such field"),
        ("controller.proportional_gain", (-1.0,), "greater than 0"),
        ("controller.proportional_gain", (1.0, 2.0), "required"),
        ("curve.radius", (0.0,), "greater than 0"),
    ],
)
def test_what_cannot_be_changed_is_said_in_words(name: str, value: tuple[float, ...], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        adjusted(name, *value)


def test_a_figure_leaves_a_lost_satellite_out_of_the_steps_in_which_it_does_not_fly() -> None:
    lost = simulate(three(faults=[LOST]))
    single = TrackingError(below=1.0, after=10.0, satellites=("sat1", "sat3"))
    assert TrackingError(below=1.0, after=10.0).measure(lost) == single.measure(lost)
    others = lost.arc_length[-1, [0, 2]]
    assert ArcLengthSpread(below=1.0).measure(lost) == pytest.approx(np.ptp(others))
    assert ArcLengthRate(below=1.0, nominal_rate=RATE).measure(lost) == pytest.approx(
        np.abs(lost.rate[-1, [0, 2]] - RATE).max()
    )


def test_a_figure_of_the_lost_satellite_alone_is_nobody_s_and_missed() -> None:
    lost = simulate(three(faults=[LOST]))
    for expectation in (
        TrackingError(below=1e9, after=10.0, satellites=("sat2",)),
        SettlingTime(below=1e9, level=1e9, satellites=("sat2",)),
        ArcLengthRate(below=1e9, nominal_rate=0.0, satellites=("sat2",)),
    ):
        verdict = judge([expectation], lost)[0]
        assert np.isnan(verdict.figure)
        assert not verdict.met
    assert not np.isnan(TrackingError(below=1.0, before=4.0, satellites=("sat2",)).measure(lost))


def test_a_satellite_that_breaks_off_into_no_numbers_is_not_taken_for_a_lost_one() -> None:
    lost = simulate(three(faults=[LOST]))
    lost.reference_position[30, 0] = np.nan
    assert not lost.absent[30, 0]
    assert np.isnan(TrackingError(below=1.0, after=10.0).measure(lost))


def test_steps_absent_are_those_from_the_loss_to_the_return() -> None:
    back = simulate(three(faults=[{**LOST, "rejoin_at": 10.0, "memory": "plan"}]))
    assert StepsAbsent(below=1).measure(back) == 10.0
    assert StepsAbsent(below=1, satellites=("sat1",)).measure(back) == 0.0
    assert StepsAbsent(below=1, after=8.0, before=20.0).measure(back) == 4.0
    assert StepsAbsent(below=1).measure(simulate(three())) == 0.0


def test_the_time_to_rejoin_counts_from_the_return_to_the_end_of_the_last_disagreement() -> None:
    back = simulate(three(faults=[{**LOST, "rejoin_at": 10.0, "memory": "plan"}]))
    spread = np.ptp(back.arc_length, axis=1)
    within = float(spread[31])
    assert np.all(np.diff(spread[20:]) < 0.0)
    assert RejoinTime(below=1, satellite="sat2", within=within).measure(back) == 5.5
    for never in (
        RejoinTime(below=1, satellite="sat2", within=1e-6),
        RejoinTime(below=1, satellite="sat1", within=1e6),
    ):
        assert np.isnan(never.measure(back))
    gone = simulate(three(faults=[LOST]))
    assert np.isnan(RejoinTime(below=1, satellite="sat2", within=1e6).measure(gone))
    assert RejoinTime(below=1, satellite="nobody", within=1.0).complaints({"sat1"}, three().timing)
