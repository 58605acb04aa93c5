# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What a node says of its health, when, and in which form."""

from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from satform.communication.message_validator import RejectionCounter
from satform_nodes.runtime.diagnostics import (
    DIAGNOSTICS,
    PERIOD,
    SHORTEST,
    Condition,
    FlightProgress,
    Health,
    Level,
    flight_condition,
    status,
    with_failures,
)


class Clock:
    """A wall clock that stands still until it is set."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Timer(NamedTuple):
    """Stands for a timer of a node."""

    period: float
    callback: Any

    def reset(self) -> None:
        """Begin its period anew."""


class RecordingNode:
    """Stands for a node: keeps what is published and the timer that was made."""

    namespace = "/"

    def __init__(self) -> None:
        self.published: list[DiagnosticArray] = []
        self.timers: list[Timer] = []
        self.topic = ""

    def create_publisher(self, message_type: Any, topic: str, _profile: Any) -> Any:
        assert message_type is DiagnosticArray
        self.topic = topic
        return SimpleNamespace(publish=self.published.append)

    def get_namespace(self) -> str:
        return self.namespace

    def create_timer(self, period: float, callback: Any) -> Any:
        self.timers.append(Timer(period, callback))
        return self.timers[-1]

    def destroy_timer(self, timer: Any) -> None:
        self.timers.remove(timer)


class Part:
    """A part whose condition the test sets."""

    def __init__(self) -> None:
        self.node = RecordingNode()
        self.clock = Clock()
        self.condition = Condition(Level.OK, "flying", {"step": 1})
        self.asked = 0
        self.health = Health(
            self.node, "sat1: flight software", "sat1", self.publish, lambda: (1500, 250_000_000), self.clock
        )

    def publish(self) -> Condition:
        self.asked += 1
        return self.condition

    def told(self) -> list[tuple[int, str]]:
        return [(array.status[0].level[0], array.status[0].message) for array in self.node.published]


@pytest.fixture
def part() -> Part:
    return Part()


def test_a_timer_of_one_second_tells_the_condition_whether_it_has_changed_or_not(part: Part) -> None:
    ((period, tick),) = part.node.timers
    assert period == PERIOD == 1.0
    assert part.node.topic == DIAGNOSTICS == "/diagnostics"
    tick()
    tick()
    assert part.told() == [(0, "flying"), (0, "flying")]


def test_a_change_is_told_at_once(part: Part) -> None:
    part.health.publish()
    part.clock.now += 1.01 * SHORTEST
    part.condition = Condition(Level.WARN, "nothing received from sat2")
    part.health.changed()
    assert part.told()[-1] == (1, "nothing received from sat2")


def test_figures_that_merely_grow_wait_for_the_timer(part: Part) -> None:
    part.health.publish()
    for step in range(2, 50):
        part.clock.now += SHORTEST
        part.condition = Condition(Level.OK, "flying", {"step": step})
        part.health.changed()
    assert len(part.node.published) == 1


def test_a_part_that_flickers_is_told_of_at_most_ten_times_a_second(part: Part) -> None:
    for number in range(1000):
        part.condition = Condition(Level.WARN, f"silent: {number}")
        part.health.changed()
        part.clock.now += 0.001
    assert 9 <= len(part.node.published) <= 10
    assert part.asked == len(part.node.published)


def test_a_report_that_the_timer_owes_is_made_by_whoever_looks_after_it(part: Part) -> None:
    """A flood of messages keeps the timers of a node waiting."""
    part.health.publish()
    for _ in range(40):
        part.clock.now += 0.1
        part.health.due()
    # After 1.3 s, 2.6 s and 3.9 s: the first looks at which more than 1.25 s have passed.
    assert len(part.node.published) == 4


def test_what_changed_too_soon_is_told_by_the_timer(part: Part) -> None:
    part.health.publish()
    part.condition = Condition(Level.ERROR, "lost")
    part.health.changed()
    assert part.told() == [(0, "flying")]
    part.node.timers[0][1]()
    assert part.told()[-1] == (2, "lost")


def test_the_first_condition_is_told_as_soon_as_the_node_says_so(part: Part) -> None:
    part.health.changed()
    assert part.told() == [(0, "flying")]


def test_the_last_word_is_told_and_the_timer_ends(part: Part) -> None:
    part.condition = Condition(Level.OK, "the flight is over")
    part.health.close()
    assert part.told() == [(0, "the flight is over")]
    assert part.node.timers == []


def test_a_report_is_stamped_and_bears_one_status(part: Part) -> None:
    part.health.publish()
    (array,) = part.node.published
    # Simulated time, as everything else in a bag; the wall clock's time is a value.
    assert (array.header.stamp.sec, array.header.stamp.nanosec) == (1500, 250_000_000)
    wall = {pair.key: pair.value for pair in array.status[0].values}["wall-clock time"]
    assert abs((datetime.now(UTC) - datetime.fromisoformat(wall)).total_seconds()) < 3600.0
    assert [entry.name for entry in array.status] == ["sat1: flight software"]
    assert array.status[0].hardware_id == "sat1"


def test_levels_are_those_of_the_message() -> None:
    assert [bytes([level]) for level in Level] == [
        DiagnosticStatus.OK,
        DiagnosticStatus.WARN,
        DiagnosticStatus.ERROR,
        DiagnosticStatus.STALE,
    ]


def test_values_are_text_by_name() -> None:
    told = status(
        "a", "b", Condition(Level.OK, "c", {"step": 12, "rate": 1234.56789, "ready": True, "who": "sat2"})
    )
    assert {pair.key: pair.value for pair in told.values} == {
        "step": "12",
        "rate": "1234.57",
        "ready": "true",
        "who": "sat2",
    }


def flying(**changes: Any) -> Condition:
    return flight_condition(**{"step": 10, "step_rate": 1500.04, "refused": {}, "silent": {}, **changes})


def test_a_part_that_hears_everyone_is_ok() -> None:
    condition = flying()
    assert (condition.level, condition.message) == (Level.OK, "flying")
    assert condition.values == {
        "step": 10,
        "steps per second": 1500.0,
        "rejected messages": 0,
        "lost neighbours": "none",
    }


def test_refused_messages_are_a_warning_and_counted_by_reason() -> None:
    condition = flying(refused={"wrong step": 2, "wrong form": 1, "unknown sender": 0})
    assert condition.level is Level.WARN
    assert condition.values["rejected messages"] == 3
    assert condition.values["rejected messages: wrong step"] == 2
    assert condition.values["rejected messages: wrong form"] == 1
    assert "rejected messages: unknown sender" not in condition.values


def test_silent_neighbours_are_named_with_their_steps_of_silence() -> None:
    condition = flying(silent={"sat3": 4, "sat2": 7}, refused={"wrong step": 1})
    assert (condition.level, condition.message) == (Level.WARN, "nothing received from sat2, sat3")
    assert condition.values["lost neighbours"] == "sat2, sat3"
    assert condition.values["steps since the loss: sat3"] == 4


def test_a_part_tells_how_fast_it_has_been_since_it_last_told() -> None:
    rejections, moments = RejectionCounter(), iter([10.0, 12.0, 12.5])
    course = FlightProgress(rejections, lambda: next(moments))
    assert course.condition(200, {}).values["steps per second"] == 100.0
    rejections.add("/sat1/command", "not finite")
    later = course.condition(210, {"sat2": 4})
    assert later.values["steps per second"] == 20.0
    assert later.values["rejected messages: /sat1/command: not finite"] == 1
    assert later.message == "nothing received from sat2"


def test_what_failed_in_a_law_is_a_figure_and_a_warning_unless_something_worse_is_said() -> None:
    well = flying()
    assert with_failures(well, {"plans not solved": 0}) == Condition(
        Level.OK, "flying", {**well.values, "plans not solved": 0}
    )
    failed = with_failures(well, {"plans not solved": 3})
    assert (failed.level, failed.message) == (Level.WARN, "plans not solved: 3")
    ended = with_failures(flying(ended="lost"), {"plans not solved": 3})
    assert (ended.level, ended.message, ended.values["plans not solved"]) == (Level.ERROR, "lost", 3)


def test_an_end_that_was_not_wanted_is_an_error_whatever_else_there_is() -> None:
    condition = flying(silent={"sat2": 7}, ended="lost at step 10: no answer from sat2")
    assert (condition.level, condition.message) == (Level.ERROR, "lost at step 10: no answer from sat2")
