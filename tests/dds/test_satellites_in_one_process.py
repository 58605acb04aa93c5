# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Satellites of one process compute a step together over arrays, with the same bits as alone."""

from pathlib import Path

import pytest

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.scenario import Scenario, parse_scenario
from satform_bringup.supervisor.run import fly


def flown_in_one_process(scenario: Scenario, out: Path) -> list[str]:
    """Quantities of a grouped flight that differ from the in-process run, which here flies each alone."""
    flight = fly(
        scenario, out, record=True, progress=lambda _done, _all: None, group=len(scenario.satellites)
    )
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    return simulate(scenario, stacked=False).differences(bag.record)


@pytest.mark.parametrize(
    ("name", "steps"),
    [
        pytest.param("star_six", 100, marks=pytest.mark.unmeasured),  # with different numbers of neighbours
        pytest.param("approach_gssap", 20, marks=pytest.mark.unmeasured),  # that hear nobody
        ("formation_pointing", 40),  # with attitudes
        ("directed_triangle", 100),  # that tell their motion, under a law with a memory
    ],
)
def test_a_group_flies_with_the_bits_of_single_satellites(name: str, steps: int, tmp_path: Path) -> None:
    scenario = shortened(name, steps * shortened(name, 100.0).timing.step)
    assert flown_in_one_process(scenario, tmp_path) == []


def test_a_group_whose_members_part_in_flight_keeps_its_bits(tmp_path: Path) -> None:
    scenario = shortened(
        "star_six",
        100.0,
        "graph_schedule=[{at: 40.0, remove: [[sat1, sat3], [sat3, sat1]]}]",
    )
    assert flown_in_one_process(scenario, tmp_path) == []


def test_a_group_with_filters_observers_and_saturated_thrusters_flies_with_the_bits_of_single_ones(
    tmp_path: Path,
) -> None:
    scenario = parse_scenario(
        """
name: saturated
title: Three satellites under observers and filters, with thrusters too weak for their laws
text: What was applied goes back to estimators and integrals, of single satellites and of stacked ones.
orbit: {period: 6000.0}
timing: {step: 2.0, duration: 80.0}
dynamics: {kind: cw, perturbations: [{kind: bounded_noise, bound: 1.0e-3}]}
graph: {kind: complete}
consensus: {kind: arc_length, tracking_gain: 1.0e-3, coupling_gain: 1.0e-6, rate_gain: 1.0e-3}
nominal_motion: {period: 6000.0}
satellite_defaults:
  curve: {kind: ellipse, first_axis: [0.0, 2000.0, 0.0], second_axis: [1000.0, 0.0, 0.0]}
  path_parameter: angle
  controller: {kind: observer, law: {kind: lqi}}
  sensor: {position_noise: 1.0, velocity_noise: 0.05}
  filter: {acceleration_density: 6.666666667e-7}
  thruster: {dry_mass: 100.0, maximum_thrust: 0.5, magnitude_error: 0.01}
  position_error: [100.0, 50.0, 20.0]
satellites: [{name: a}, {name: b, arc_length: 3000.0}, {name: c, arc_length: 6000.0}]
"""
    )
    assert flown_in_one_process(scenario, tmp_path) == []
    assert simulate(scenario).saturated_steps[-1].min() > 0.0
