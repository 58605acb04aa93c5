# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who takes part: losses, returns and commands, decided step by step without a wire."""

from typing import Any

import pytest

from formations import formation
from satform.consensus.graph import NoneSpec
from satform.membership.formation import SatelliteRejoined, TopologyChanged
from satform.membership.membership_manager import Change, Loss, MembershipManager
from satform.scenario import Scenario

# A step is 0.5 s: lost from step 10 on, and back at step 20.
LOST = {"kind": "satellite_lost", "satellite": "sat2", "at": 5.0}
LOST_AND_BACK = {**LOST, "rejoin_at": 10.0, "memory": "plan"}


def three(**other: Any) -> Scenario:
    return formation([{} for _ in range(3)], 20.0, **{"graph": {"kind": "line"}, **other})


def at_step(step: int, *faults: dict[str, Any], **options: Any) -> MembershipManager:
    """A formation whose states of a step have been told, all having commanded in those before."""
    membership = MembershipManager(three(faults=list(faults)).membership_plan(), **options)
    for number in range(step + 1):
        membership.begin(number)
        membership.close()
        if number < step:
            command(membership, *membership.flying)
    return membership


def command(membership: MembershipManager, *satellites: int) -> None:
    for satellite in satellites:
        membership.record_command(satellite)


def next_step(membership: MembershipManager) -> tuple[Change | None, Change | None]:
    """What changes as the next step begins, and as its states are published."""
    begun = membership.begin(membership.step + 1)
    return begun, membership.close()


def test_the_flight_waits_for_everyone_who_flies_or_watches() -> None:
    membership = MembershipManager(three().membership_plan(), ["recorder"])
    for name in ("sat3", "recorder", "sat1"):
        membership.note_ready(name)
    assert membership.unready == ["sat2"]
    membership.note_ready("sat2")
    assert membership.unready == []


def test_a_step_is_complete_once_all_have_commanded_and_the_next_one_begins_anew() -> None:
    membership = at_step(3)
    command(membership, 2, 0)
    assert not membership.complete
    assert membership.missing == ["sat2"]
    command(membership, 0)
    assert not membership.complete
    command(membership, 1)
    assert membership.complete
    assert next_step(membership) == (None, None)
    assert membership.not_commanded == [0, 1, 2]


def test_what_happens_before_the_states_are_told_takes_effect_in_the_same_step() -> None:
    membership = at_step(3)
    assert membership.next_step == 4
    membership.begin(4)
    assert membership.open
    assert membership.next_step == 4
    assert membership.schedule(TopologyChanged(NoneSpec().build(3), "quiet")) == 4
    assert membership.close() == Change((), ())
    assert membership.formation.reason == "quiet"
    assert membership.schedule(TopologyChanged(NoneSpec().build(3), "quieter")) == 5


def test_lost_before_it_has_commanded_it_is_lost_at_once() -> None:
    membership = at_step(3)
    command(membership, 0, 2)
    assert membership.lose(1, "gone") == Loss(Change((1,), ()))
    assert membership.complete
    assert (membership.flying, membership.lost) == ([0, 2], [1])
    assert (membership.formation.step, membership.formation.reason) == (3, "gone")


def test_lost_after_it_has_commanded_it_is_lost_from_the_next_step_on() -> None:
    membership = at_step(3)
    command(membership, 1)
    assert membership.lose(1, "gone") == Loss()
    # Told twice, as by the end of its process and by its silence.
    assert membership.lose(1, "gone") == Loss()
    assert membership.flying == [0, 1, 2]
    command(membership, 0, 2)
    assert membership.complete
    assert next_step(membership) == (None, Change((1,), ()))
    assert (membership.formation.number, membership.formation.step) == (1, 4)
    assert membership.not_commanded == [0, 2]


def test_lost_before_its_first_command_it_ends_a_flight_in_lockstep_only() -> None:
    assert at_step(0).lose(1, "gone") == Loss(end="gone, before its first command")
    assert at_step(0, lockstep=False).lose(1, "gone") == Loss(Change((1,), ()))


def test_the_last_satellite_s_loss_ends_the_flight() -> None:
    membership = at_step(3)
    assert membership.lose(0, "gone").end == ""
    assert membership.lose(2, "gone").end == ""
    assert membership.lose(1, "gone too") == Loss(Change((1,), ()), "gone too; no satellite is left")


def test_a_lost_satellite_that_offers_to_come_back_does_so_at_the_next_step() -> None:
    membership = at_step(3)
    membership.lose(1, "gone")
    membership.request_rejoin(1, 2)
    assert membership.flying == [0, 2]
    assert next_step(membership) == (None, Change((), (SatelliteRejoined(1, 2),)))
    assert membership.not_commanded == [0, 1, 2]


def test_who_knows_only_its_flight_plan_has_no_checkpoint() -> None:
    membership = at_step(3)
    membership.lose(1, "gone")
    membership.request_rejoin(1, -1)
    assert next_step(membership)[1] == Change((), (SatelliteRejoined(1, None),))


def test_offered_twice_it_comes_back_once_from_the_checkpoint_that_it_named_last() -> None:
    membership = at_step(3)
    membership.lose(1, "gone")
    membership.request_rejoin(1, 1)
    membership.request_rejoin(1, 3)
    assert next_step(membership)[1] == Change((), (SatelliteRejoined(1, 3),))
    assert membership.formation.number == 2


def test_lost_once_more_before_its_return_it_stays_lost() -> None:
    membership = at_step(3)
    membership.lose(1, "gone")
    membership.request_rejoin(1, 1)
    membership.request_rejoin(1, 3)
    assert membership.lose(1, "gone again") == Loss()
    assert next_step(membership) == (None, None)
    assert membership.lost == [1]


def test_an_offer_of_one_who_flies_means_nothing() -> None:
    membership = at_step(3)
    membership.request_rejoin(1, 2)
    command(membership, 1)
    membership.request_rejoin(1, 2)
    assert next_step(membership) == (None, None)


def test_lost_together_with_the_last_that_had_commanded_nobody_is_left() -> None:
    membership = at_step(3)
    command(membership, 0)
    assert membership.lose(0, "gone") == Loss()
    assert membership.lose(1, "gone").end == ""
    assert membership.lose(2, "gone").end == ""
    assert membership.complete
    assert not membership.is_empty
    assert next_step(membership) == (None, Change((0,), ()))
    assert membership.is_empty


def test_dead_again_before_its_loss_takes_effect_it_does_not_come_back() -> None:
    membership = at_step(3)
    command(membership, 1)
    membership.lose(1, "gone")
    membership.request_rejoin(1, 2)
    membership.lose(1, "gone again")
    assert next_step(membership) == (None, Change((1,), ()))
    command(membership, 0, 2)
    assert next_step(membership) == (None, None)


def test_started_anew_before_its_loss_takes_effect_it_is_lost_first_and_then_back() -> None:
    membership = at_step(3)
    command(membership, 1)
    membership.lose(1, "gone")
    membership.request_rejoin(1, 2)
    assert next_step(membership) == (None, Change((1,), ()))
    command(membership, 0, 2)
    assert next_step(membership) == (None, Change((), (SatelliteRejoined(1, 2),)))


def test_lost_by_plan_and_back_in_the_same_step() -> None:
    """Its process died and was started anew just before the step at which the scenario kills it."""
    membership = at_step(9, LOST)
    command(membership, 1)
    membership.lose(1, "gone")
    membership.request_rejoin(1, 8)
    assert next_step(membership) == (Change((1,), ()), Change((), (SatelliteRejoined(1, 8),)))
    assert (membership.formation.number, membership.formation.step) == (2, 10)
    assert membership.not_commanded == [0, 1, 2]


def test_a_planned_loss_takes_effect_as_its_step_begins_and_a_planned_return_is_awaited() -> None:
    membership = at_step(9, LOST_AND_BACK)
    assert next_step(membership) == (Change((1,), ()), None)
    for step in range(11, 20):
        command(membership, 0, 2)
        membership.begin(step)
        assert membership.rejoins_ready
        assert membership.close() is None
    membership.begin(20)
    assert not membership.rejoins_ready
    assert membership.missing == ["sat2"]
    # What the scenario says of its memory counts, not what it happens to have.
    membership.request_rejoin(1, 15)
    assert membership.rejoins_ready
    assert membership.close() == Change((), (SatelliteRejoined(1, None),))
    assert membership.missing == ["sat1", "sat2", "sat3"]


@pytest.mark.parametrize(
    ("offered", "taken"), [(6, 6), (7, None), (9, None), (10, None), (11, 11), (12, 12), (13, None)]
)
def test_a_checkpoint_counts_only_if_it_was_flown_before_or_between_losses(
    offered: int, taken: int | None
) -> None:
    membership = at_step(6)
    membership.lose(1, "no answer")
    for step in range(7, 11):
        membership.begin(step)
        if step == 10:
            membership.request_rejoin(1, -1)
        membership.close()
    for step in range(11, 13):
        membership.begin(step)
        membership.close()
    membership.lose(1, "no answer")
    membership.begin(13)
    membership.request_rejoin(1, offered)
    assert membership.close() == Change((), (SatelliteRejoined(1, taken),))


@pytest.mark.parametrize(("offered", "taken"), [(10, 10), (8, 8), (-1, None)])
def test_a_planned_return_is_from_the_checkpoint_that_there_is(offered: int, taken: int | None) -> None:
    membership = MembershipManager(
        three(faults=[{**LOST_AND_BACK, "memory": "checkpoint"}], checkpoint_period=2.5).membership_plan()
    )
    for step in range(20):
        membership.begin(step)
        membership.close()
    membership.begin(20)
    assert membership.awaited == {1: SatelliteRejoined(1, 10)}
    membership.request_rejoin(1, offered)
    assert membership.close() == Change((), (SatelliteRejoined(1, taken),))


def test_an_offer_well_before_the_planned_return_is_kept_until_then() -> None:
    membership = at_step(12, LOST_AND_BACK)
    membership.request_rejoin(1, 10)
    for step in range(13, 20):
        assert (membership.begin(step), membership.close()) == (None, None)
    membership.begin(20)
    assert membership.rejoins_ready
    assert membership.close() == Change((), (SatelliteRejoined(1, None),))


def test_an_awaited_satellite_that_dies_again_is_awaited_still() -> None:
    membership = at_step(12, LOST_AND_BACK)
    membership.request_rejoin(1, 10)
    membership.lose(1, "gone again")
    for step in range(13, 21):
        membership.begin(step)
        if step < 20:
            membership.close()
    assert not membership.rejoins_ready
    membership.request_rejoin(1, -1)
    assert membership.rejoins_ready


def test_after_its_planned_return_a_satellite_comes_back_whenever_it_can() -> None:
    membership = at_step(19, LOST_AND_BACK)
    membership.request_rejoin(1, -1)
    next_step(membership)
    assert membership.flying == [0, 1, 2]
    membership.lose(1, "gone")
    membership.request_rejoin(1, -1)
    assert next_step(membership)[1] == Change((), (SatelliteRejoined(1, None),))


def test_what_is_lost_already_is_not_lost_anew_when_the_scenario_s_time_comes() -> None:
    change = {"at": 5.0, "remove": [["sat1", "sat2"]]}
    membership = MembershipManager(three(faults=[LOST], graph_schedule=[change]).membership_plan())
    for step in range(10):
        membership.begin(step)
        membership.close()
        if step == 4:
            membership.lose(1, "gone")
    assert membership.begin(10) == Change((), ())
    assert membership.formation.reason == "the scenario changes the graph"


@pytest.mark.parametrize(("step", "taken"), [(38, False), (39, True)])
def test_after_the_last_step_nothing_takes_effect_any_more(step: int, taken: bool) -> None:
    membership = at_step(step)
    assert membership.last_step_taken is taken
    assert not membership.over


def test_the_flight_is_over_when_the_states_after_the_last_step_are_told() -> None:
    membership = at_step(39)
    membership.begin(40)
    assert not membership.over
    membership.close()
    assert membership.over
    assert membership.missing == []


@pytest.mark.parametrize(("stored", "used"), [(3, 3), (4, None)])
def test_a_checkpoint_that_follows_a_command_which_did_not_arrive_is_none(
    stored: int, used: int | None
) -> None:
    # In step 3 it commands and stores a checkpoint of step 4, but only the others' commands arrive.
    membership = at_step(3)
    command(membership, 0, 2)
    membership.lose(1, "gone")
    membership.request_rejoin(1, stored)
    assert next_step(membership) == (None, Change((), (SatelliteRejoined(1, used),)))


def test_who_has_commanded_and_is_lost_is_lost_at_once_when_the_others_wait_for_its_message_in_vain() -> None:
    membership = at_step(3)
    command(membership, 1)
    assert membership.lose(1, "gone") == Loss()
    assert membership.about_to_be_lost == [1]
    assert membership.lose_now() == Loss(Change((1,), ()))
    assert membership.commanded == set()
    assert membership.not_commanded == [0, 2]
    assert membership.lose_now() == Loss()
