# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A satellite that repeats its steps on floats decides what it decides over arrays, to the last bit."""

from typing import Any

import numpy as np
import pytest

from flights import satellite_of, satellites_together, shipped
from satform.communication.messages import encode
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import Motion
from satform.flight import float_act
from satform.flight.checkpoint import restore, save
from satform.flight.satellite import Satellite
from satform.numeric.array_trees import arrays_of, numbers_of_arrays, same_bits


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(float_act, "_FIRST", 3)


class Pair:
    """The same satellite over arrays and on floats, with motion and messages that are made up."""

    def __init__(self, name: str, *, together: bool = False) -> None:
        scenario = shipped(name)
        indices = range(len(scenario.satellites))
        make = (
            (lambda: satellites_together(scenario, indices))
            if together
            else (lambda: satellite_of(scenario, 0))
        )
        self.arrays, self.floats = make(), make()
        self.floats.repeat_on_floats(scenario.timing.steps)
        self.by_program = 0
        self._random = np.random.default_rng(5)

    def step(self) -> None:
        """Let both act, and compare all that they decide, announce and remember of it."""
        number = self.arrays.state.step
        assert self.floats.step == number
        shape, random = (*np.shape(self.arrays.plan.arc_length), 3), self._random
        inbox = self.arrays.state.inbox
        motion = Motion(1e3 * random.normal(size=shape), random.normal(size=shape))
        linked = np.ones(inbox.stamp.shape)
        values = np.abs(random.normal(size=inbox.values.shape)) * 100.0
        received = Received.whole(values, np.full(linked.shape, number * self.arrays.plan.step), linked)
        applied = 1e-3 * random.normal(size=shape)
        found = []
        for satellite in (self.arrays, self.floats):
            decision = satellite.act(motion, received, number, None, applied if number else None)
            found.append(numbers_of_arrays([*arrays_of(decision), encode(satellite.announce())]))
        assert len(found[0]) == len(found[1])
        assert same_bits(*found)
        self.by_program += self.floats._state is None

    def same_state(self) -> bool:
        one, two = (numbers_of_arrays(arrays_of(own.state)) for own in (self.arrays, self.floats))
        return (
            len(one) == len(two) and same_bits(one, two) and self.arrays.state.step == self.floats.state.step
        )


@pytest.mark.parametrize(
    "name", ["triangle", "directed_triangle", "geo_parallel_lqi", "byzantine_unprotected"]
)
@pytest.mark.parametrize("together", [False, True])
def test_both_decide_the_same(name: str, together: bool) -> None:
    pair = Pair(name, together=together)
    for _ in range(12):
        pair.step()
    assert pair.by_program >= 8
    assert pair.same_state()
    pair.step()
    assert pair.same_state()


def test_a_gap_and_another_list_of_neighbours_go_over_arrays_for_a_while() -> None:
    pair = Pair("triangle")
    for _ in range(6):
        pair.step()
    for satellite in (pair.arrays, pair.floats):
        satellite.join(20)
    for _ in range(3):
        pair.step()
    assert pair.by_program == 5
    for satellite in (pair.arrays, pair.floats):
        satellite.rearrange([1])
    for _ in range(8):
        pair.step()
    assert pair.by_program == 10
    assert pair.same_state()


def test_another_plan_is_recorded_anew() -> None:
    pair = Pair("triangle")
    for part in range(2):
        for _ in range(6):
            pair.step()
        assert pair.by_program == 3 * (part + 1)
        for satellite in (pair.arrays, pair.floats):
            satellite.use_phase_offset(50.0)


def test_a_checkpoint_is_the_same() -> None:
    pair = Pair("triangle")
    for _ in range(8):
        pair.step()
    assert pair.by_program
    assert save(pair.floats) == save(pair.arrays)
    for satellite in (pair.arrays, pair.floats):
        restore(satellite, save(pair.arrays))
    pair.step()
    assert pair.same_state()


def test_short_flights_and_other_bits_stay_with_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    satellite: Any = satellite_of(shipped("triangle"), 0)
    satellite.repeat_on_floats(100)
    assert satellite._floats is None
    monkeypatch.setattr(float_act, "same_bits", lambda *_: False)
    pair = Pair("triangle")
    for _ in range(8):
        pair.step()
    assert pair.by_program == 0
    assert isinstance(pair.floats, Satellite)
