# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How well satellites keep to the clock with their commands: who missed a step, was late, or is silent."""

import pytest

from satform.flight.command_timeout import held_steps
from satform_nodes.runtime.realtime_loop import CommandMonitor


class Clock:
    """A wall clock that stands still until it is set."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_a_command_for_the_step_is_neither_missed_nor_late() -> None:
    kept = CommandMonitor(2)
    for step in range(3):
        kept.note(0, step, step)
        kept.note(1, step, step)
        assert kept.count_missing([0, 1], step, 1e9) == []
    assert kept.data(["sat1", "sat2"]) == {
        "misses": {"sat1": 0, "sat2": 0},
        "late": {"sat1": 0, "sat2": 0},
        "timed_out": {"sat1": 0, "sat2": 0},
    }


def test_a_command_that_comes_after_its_step_was_taken_is_missed_first_and_then_late() -> None:
    kept = CommandMonitor(2)
    kept.note(0, 0, 0)
    kept.count_missing([0, 1], 0, 1e9)
    kept.note(1, 0, 1)
    assert (kept.misses, kept.late) == ([0, 1], [0, 1])
    assert (kept.first_due(0), kept.first_due(1)) == (1, 1)


def test_those_who_do_not_fly_miss_nothing() -> None:
    kept = CommandMonitor(2)
    kept.count_missing([1], 0, 1e9)
    assert kept.misses == [0, 1]


def test_silence_counts_from_the_last_command_and_anew_when_the_flight_goes_on() -> None:
    clock = Clock()
    kept = CommandMonitor(2, clock)
    kept.begin()
    clock.now += 2.0
    kept.note(0, 0, 0)
    clock.now += 2.0
    assert kept.count_missing([0, 1], 1, 3.0) == [1]
    kept.begin()
    clock.now += 2.5
    assert kept.count_missing([0, 1], 1, 3.0) == []
    kept.restart_timeout(1)
    clock.now += 1.0
    assert kept.count_missing([0, 1], 1, 3.0) == [0]


@pytest.mark.parametrize(
    ("timeout", "step", "steps"), [(10.0, 0.5, 20), (10.0, 3.0, 3), (10.0, 60.0, 1), (0.3, 0.1, 3)]
)
def test_a_command_is_held_for_a_time_of_flight_and_for_a_step_at_least(
    timeout: float, step: float, steps: int
) -> None:
    assert held_steps(timeout, step) == steps


def test_a_command_that_is_too_old_times_out_by_steps_whatever_the_wall_clock_says() -> None:
    clock = Clock()
    kept = CommandMonitor(2, clock)
    kept.begin()
    for satellite in range(2):
        kept.note(satellite, 4, 4)
    assert kept.expired([0, 1], 7, 3) == []
    kept.note(1, 6, 7)
    assert kept.expired([0, 1], 8, 3) == [0]
    assert kept.expired([1], 8, 3) == []
    kept.note(0, 8, 8)
    assert kept.expired([0, 1], 8, 3) == []
    assert kept.timed_out == [1, 0]
