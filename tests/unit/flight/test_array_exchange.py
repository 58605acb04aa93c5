# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What groups that exchange arrays can fly, and which of their steps are recorded."""

import pytest

from flights import SCENARIOS, shipped
from satform.flight.array_exchange import LARGEST_BAG, array_complaints, recorded_every

FLOWN = {"ring_six", "line_six", "star_six", "complete_six", "triangle"}
"""Scenarios with nothing but satellites that agree on their phases."""


@pytest.mark.parametrize("name", sorted(FLOWN))
def test_satellites_that_agree_on_their_phases_can_exchange_arrays(name: str) -> None:
    assert array_complaints(shipped(name)) == []


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("satellite_lost_and_rejoined", "faults"),
        ("lossy_links", "links"),
        ("switching_graph", "changes of the graph"),
        ("reconfiguration", "reconfigurations"),
        ("thruster_limited", "thrusters"),
        ("noisy_navigation", "sensors"),
        ("formation_pointing", "attitudes"),
        ("directed_triangle", "the exchange of motion"),
        ("laser_ranging_triangle", "filters"),
        ("aperture_model_predictive", "control laws that make plans"),
    ],
)
def test_what_arrays_do_not_carry_is_named(name: str, what: str) -> None:
    assert (SCENARIOS / f"{name}.yaml").exists()
    assert any(f"arrays cannot fly {what} yet" in sentence for sentence in array_complaints(shipped(name)))


def test_a_bag_of_arrays_stays_below_its_largest_size() -> None:
    # 26 numbers of 8 bytes for each satellite and step: 9 of states, 5 of commands, 12 of what is followed.
    assert recorded_every(1000, 2403) == 1
    assert recorded_every(1000, 2404) == 2
    assert recorded_every(10_000, 1200) == 5
    assert 26 * 8 * 10_000 * 1200 / recorded_every(10_000, 1200) <= LARGEST_BAG
    assert recorded_every(3, 24_000) == 1
