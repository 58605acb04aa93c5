# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps of a satellite by a program on floats have the bits of those over arrays, also when it is changed."""

from dataclasses import replace

import numpy as np
import pytest

from flights import shipped
from satform.communication.messages import WIDTH, encode
from satform.communication.neighbour_buffer import Received
from satform.control.protocol import Motion
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.float_satellite import FloatSatellite, results_of, suits
from satform.flight.satellite import Satellite


class Pair:
    """A satellite that is flown by a program where that goes, and the same one over arrays."""

    def __init__(self, name: str, index: int = 0) -> None:
        self.plan: FormationPlan = compile_scenario(shipped(name))
        self.count = len(self.plan.membership.possible_graph.neighbours(index))
        neighbours = list(self.plan.membership.possible_graph.neighbours(index))
        self.mixed, self.arrays = (
            Satellite(self.plan.satellite(index, neighbours), self.count) for _ in range(2)
        )
        self.floats = FloatSatellite(self.plan, index)
        self.linked = np.ones(self.count)
        self.by_program = 0
        self._random = np.random.default_rng(3)

    def _inputs(self, step: int) -> list[float]:
        """Numbers as a step receives them, near the satellite's start."""
        start, random = self.arrays.plan.start, self._random
        width = WIDTH[self.plan.announces]
        own = [start.position + random.normal(size=3), start.velocity + 0.01 * random.normal(size=3)]
        time = step * self.plan.timing.step
        applied = 0.001 * random.normal(size=3)
        messages = [[time, *(100.0 * random.normal(size=width)).tolist()] for _ in range(self.count)]
        further = [*self.linked.tolist(), *(number for own in messages for number in own)]
        return [*np.concatenate([*own, applied]).tolist(), *further]

    def _over_arrays(self, satellite: Satellite, step: int, inputs: list[float]) -> list[float]:
        given = np.array(inputs)
        messages = given[9 + self.count :].reshape(self.count, 1 + WIDTH[self.plan.announces])
        received = Received(messages[:, 1:], messages[:, 0], self.linked, self.linked, complete=True)
        decision = satellite.act(Motion(given[:3], given[3:6]), received, step, None, given[6:9], None)
        message = satellite.announce()
        return results_of(decision, float(message.time), encode(message).tolist())

    def fly(self, steps: range, inputs: list[float] | None = None) -> None:
        """Fly both, and compare."""
        for step in steps:
            given = inputs or self._inputs(step)
            expected = self._over_arrays(self.arrays, step, given)
            found = self.floats.fly(self.mixed, step, given)
            if found is None:
                found = self._over_arrays(self.mixed, step, given)
                if self.floats.on_trial:
                    self.floats.judge(self.mixed, found)
            else:
                self.by_program += 1
            assert repr(found) == repr(expected), step

    def settle(self) -> None:
        """Compare the states."""
        self.floats.settle(self.mixed)
        assert repr(self.mixed.state) == repr(self.arrays.state)


@pytest.mark.parametrize("name", ["triangle", "ring_six", "directed_triangle", "geo_sphere_lqr"])
def test_a_program_repeats_a_step_with_the_bits_of_the_arrays(name: str) -> None:
    pair = Pair(name)
    pair.fly(range(120))
    pair.settle()
    # A state that somebody has looked at is not another one.
    pair.fly(range(120, 150))
    pair.settle()
    assert pair.by_program > 130


def test_a_satellite_that_is_changed_goes_over_arrays_and_is_recorded_again() -> None:
    pair = Pair("triangle")
    pair.fly(range(100))
    pair.settle()
    for satellite in (pair.mixed, pair.arrays):
        satellite.join(110, skipped=True)
    before = pair.by_program
    pair.fly(range(110, 118))
    assert pair.by_program == before
    pair.fly(range(118, 200))
    pair.settle()
    assert pair.by_program > before + 50


def test_a_plan_that_is_changed_is_flown_by() -> None:
    pair = Pair("triangle")
    pair.fly(range(100))
    pair.settle()
    for satellite in (pair.mixed, pair.arrays):
        satellite.plan = replace(satellite.plan, phase_offset=satellite.plan.phase_offset + 100.0)
    pair.fly(range(100, 180))
    pair.settle()


def test_a_step_beyond_a_limit_goes_over_arrays() -> None:
    pair = Pair("triangle")
    pair.fly(range(80))
    before = pair.by_program
    with np.errstate(all="ignore"):
        pair.fly(range(80, 81), [*[1e200] * 9, *pair.linked.tolist(), *[0.0] * 3 * pair.count])
    assert pair.by_program == before
    pair.settle()


@pytest.mark.parametrize("name", ["formation_pointing", "gnss_differential_pair", "bearing_only_swarm"])
def test_a_satellite_with_attitude_or_filter_is_not_recorded(name: str) -> None:
    plan = compile_scenario(shipped(name))
    neighbours = list(plan.membership.possible_graph.neighbours(0))
    assert not suits(Satellite(plan.satellite(0, neighbours), len(neighbours)))


def test_a_byzantine_satellite_goes_over_arrays() -> None:
    pair = Pair("byzantine", compile_scenario(shipped("byzantine")).faults.byzantine[0].satellite)
    pair.fly(range(20))
    assert pair.by_program == 0


def test_an_edge_that_is_gone_needs_no_other_program() -> None:
    pair = Pair("ring_six")
    pair.fly(range(60))
    before = pair.by_program
    pair.linked = np.array([1.0, 0.0])
    pair.fly(range(60, 90))
    pair.settle()
    assert pair.by_program == before + 30
