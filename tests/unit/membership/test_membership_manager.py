# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who takes part: losses, returns and commands, decided step by step without a wire."""

from typing import Any

import pytest
from test_simulate import formation

from satform.consensus.graph import NoneSpec
from satform.membership.manager import Change, Loss, Muster
from satform.membership.state import Back, Rewired
from satform.scenario import Scenario

# A step is 0.5 s: lost from step 10 on, and back at step 20.
LOST = {"kind": "satellite_lost", "satellite": "sat2", "at": 5.0}
LOST_AND_BACK = {**LOST, "back": 10.0, "memory": "plan"}


def three(**other: Any) -> Scenario:
    return formation([{} for _ in range(3)], 20.0, **{"graph": {"kind": "line"}, **other})


def at_step(step: int, *faults: dict[str, Any], **options: Any) -> Muster:
    """A formation whose states of a step have been told, all having commanded in those before."""
    muster = Muster(three(faults=list(faults)).membership_plan(), **options)
    for number in range(step + 1):
        muster.begin(number)
        muster.close()
        if number < step:
            command(muster, *muster.flying)
    return muster


def command(muster: Muster, *satellites: int) -> None:
    for satellite in satellites:
        muster.answer(satellite)


def next_step(muster: Muster) -> tuple[Change | None, Change | None]:
    """What changes as the next step begins, and as its states are told."""
    begun = muster.begin(muster.step + 1)
    return begun, muster.close()


def test_the_flight_waits_for_everyone_who_flies_or_watches() -> None:
    muster = Muster(three().membership_plan(), ["recorder"])
    for name in ("sat3", "recorder", "sat1"):
        muster.is_ready(name)
    assert muster.unready == ["sat2"]
    muster.is_ready("sat2")
    assert muster.unready == []


def test_a_step_is_complete_once_all_have_commanded_and_the_next_one_begins_anew() -> None:
    muster = at_step(3)
    command(muster, 2, 0)
    assert not muster.complete
    assert muster.missing == ["sat2"]
    command(muster, 0)
    assert not muster.complete
    command(muster, 1)
    assert muster.complete
    assert next_step(muster) == (None, None)
    assert muster.unanswered == [0, 1, 2]


def test_what_happens_before_the_states_are_told_takes_effect_in_the_same_step() -> None:
    muster = at_step(3)
    assert muster.next_step == 4
    muster.begin(4)
    assert muster.open
    assert muster.next_step == 4
    assert muster.take_up(Rewired(NoneSpec().build(3), "quiet")) == 4
    assert muster.close() == Change((), ())
    assert muster.formation.reason == "quiet"
    assert muster.take_up(Rewired(NoneSpec().build(3), "quieter")) == 5


def test_lost_before_it_has_commanded_it_is_lost_at_once() -> None:
    muster = at_step(3)
    command(muster, 0, 2)
    assert muster.lose(1, "gone") == Loss(Change((1,), ()))
    assert muster.complete
    assert (muster.flying, muster.lost) == ([0, 2], [1])
    assert (muster.formation.step, muster.formation.reason) == (3, "gone")


def test_lost_after_it_has_commanded_it_is_lost_from_the_next_step_on() -> None:
    muster = at_step(3)
    command(muster, 1)
    assert muster.lose(1, "gone") == Loss()
    # Told twice, as by the end of its process and by its silence.
    assert muster.lose(1, "gone") == Loss()
    assert muster.flying == [0, 1, 2]
    command(muster, 0, 2)
    assert muster.complete
    assert next_step(muster) == (None, Change((1,), ()))
    assert (muster.formation.number, muster.formation.step) == (1, 4)
    assert muster.unanswered == [0, 2]


def test_lost_before_its_first_command_it_ends_a_flight_in_lockstep_only() -> None:
    assert at_step(0).lose(1, "gone") == Loss(end="gone, before its first command")
    assert at_step(0, lockstep=False).lose(1, "gone") == Loss(Change((1,), ()))


def test_the_last_satellite_s_loss_ends_the_flight() -> None:
    muster = at_step(3)
    assert muster.lose(0, "gone").end == ""
    assert muster.lose(2, "gone").end == ""
    assert muster.lose(1, "gone too") == Loss(Change((1,), ()), "gone too; no satellite is left")


def test_a_lost_satellite_that_offers_to_come_back_does_so_at_the_next_step() -> None:
    muster = at_step(3)
    muster.lose(1, "gone")
    muster.offer(1, 2)
    assert muster.flying == [0, 2]
    assert next_step(muster) == (None, Change((), (Back(1, 2),)))
    assert muster.unanswered == [0, 1, 2]


def test_who_knows_only_its_flight_plan_has_no_checkpoint() -> None:
    muster = at_step(3)
    muster.lose(1, "gone")
    muster.offer(1, -1)
    assert next_step(muster)[1] == Change((), (Back(1, None),))


def test_offered_twice_it_comes_back_once_from_the_checkpoint_that_it_named_last() -> None:
    muster = at_step(3)
    muster.lose(1, "gone")
    muster.offer(1, 1)
    muster.offer(1, 3)
    assert next_step(muster)[1] == Change((), (Back(1, 3),))
    assert muster.formation.number == 2


def test_lost_once_more_before_its_return_it_stays_lost() -> None:
    muster = at_step(3)
    muster.lose(1, "gone")
    muster.offer(1, 1)
    muster.offer(1, 3)
    assert muster.lose(1, "gone again") == Loss()
    assert next_step(muster) == (None, None)
    assert muster.lost == [1]


def test_an_offer_of_one_who_flies_means_nothing() -> None:
    muster = at_step(3)
    muster.offer(1, 2)
    command(muster, 1)
    muster.offer(1, 2)
    assert next_step(muster) == (None, None)


def test_lost_together_with_the_last_that_had_commanded_nobody_is_left() -> None:
    muster = at_step(3)
    command(muster, 0)
    assert muster.lose(0, "gone") == Loss()
    assert muster.lose(1, "gone").end == ""
    assert muster.lose(2, "gone").end == ""
    assert muster.complete
    assert not muster.deserted
    assert next_step(muster) == (None, Change((0,), ()))
    assert muster.deserted


def test_dead_again_before_its_loss_takes_effect_it_does_not_come_back() -> None:
    muster = at_step(3)
    command(muster, 1)
    muster.lose(1, "gone")
    muster.offer(1, 2)
    muster.lose(1, "gone again")
    assert next_step(muster) == (None, Change((1,), ()))
    command(muster, 0, 2)
    assert next_step(muster) == (None, None)


def test_started_anew_before_its_loss_takes_effect_it_is_lost_first_and_then_back() -> None:
    muster = at_step(3)
    command(muster, 1)
    muster.lose(1, "gone")
    muster.offer(1, 2)
    assert next_step(muster) == (None, Change((1,), ()))
    command(muster, 0, 2)
    assert next_step(muster) == (None, Change((), (Back(1, 2),)))


def test_lost_by_plan_and_back_in_the_same_step() -> None:
    """Its process died and was started anew just before the step at which the scenario kills it."""
    muster = at_step(9, LOST)
    command(muster, 1)
    muster.lose(1, "gone")
    muster.offer(1, 8)
    assert next_step(muster) == (Change((1,), ()), Change((), (Back(1, 8),)))
    assert (muster.formation.number, muster.formation.step) == (2, 10)
    assert muster.unanswered == [0, 1, 2]


def test_a_planned_loss_takes_effect_as_its_step_begins_and_a_planned_return_is_awaited() -> None:
    muster = at_step(9, LOST_AND_BACK)
    assert next_step(muster) == (Change((1,), ()), None)
    for step in range(11, 20):
        command(muster, 0, 2)
        muster.begin(step)
        assert muster.assembled
        assert muster.close() is None
    muster.begin(20)
    assert not muster.assembled
    assert muster.missing == ["sat2"]
    # What the scenario says of its memory counts, not what it happens to have.
    muster.offer(1, 15)
    assert muster.assembled
    assert muster.close() == Change((), (Back(1, None),))
    assert muster.missing == ["sat1", "sat2", "sat3"]


@pytest.mark.parametrize(("offered", "taken"), [(10, 10), (8, 8), (-1, None)])
def test_a_planned_return_is_from_the_checkpoint_that_there_is(offered: int, taken: int | None) -> None:
    muster = Muster(three(faults=[{**LOST_AND_BACK, "memory": "checkpoint"}], checkpoint_period=2.5))
    for step in range(20):
        muster.begin(step)
        muster.close()
    muster.begin(20)
    assert muster.awaited == {1: Back(1, 10)}
    muster.offer(1, offered)
    assert muster.close() == Change((), (Back(1, taken),))


def test_an_offer_well_before_the_planned_return_is_kept_until_then() -> None:
    muster = at_step(12, LOST_AND_BACK)
    muster.offer(1, 10)
    for step in range(13, 20):
        assert (muster.begin(step), muster.close()) == (None, None)
    muster.begin(20)
    assert muster.assembled
    assert muster.close() == Change((), (Back(1, None),))


def test_an_awaited_satellite_that_dies_again_is_awaited_still() -> None:
    muster = at_step(12, LOST_AND_BACK)
    muster.offer(1, 10)
    muster.lose(1, "gone again")
    for step in range(13, 21):
        muster.begin(step)
        if step < 20:
            muster.close()
    assert not muster.assembled
    muster.offer(1, -1)
    assert muster.assembled


def test_after_its_planned_return_a_satellite_comes_back_whenever_it_can() -> None:
    muster = at_step(19, LOST_AND_BACK)
    muster.offer(1, -1)
    next_step(muster)
    assert muster.flying == [0, 1, 2]
    muster.lose(1, "gone")
    muster.offer(1, -1)
    assert next_step(muster)[1] == Change((), (Back(1, None),))


def test_what_is_lost_already_is_not_lost_anew_when_the_scenario_s_time_comes() -> None:
    change = {"at": 5.0, "remove": [["sat1", "sat2"]]}
    muster = Muster(three(faults=[LOST], graph_schedule=[change]).membership_plan())
    for step in range(10):
        muster.begin(step)
        muster.close()
        if step == 4:
            muster.lose(1, "gone")
    assert muster.begin(10) == Change((), ())
    assert muster.formation.reason == "the scenario changes the graph"


@pytest.mark.parametrize(("step", "taken"), [(38, False), (39, True)])
def test_after_the_last_step_nothing_takes_effect_any_more(step: int, taken: bool) -> None:
    muster = at_step(step)
    assert muster.last_step_taken is taken
    assert not muster.over


def test_the_flight_is_over_when_the_states_after_the_last_step_are_told() -> None:
    muster = at_step(39)
    muster.begin(40)
    assert not muster.over
    muster.close()
    assert muster.over
    assert muster.missing == []
