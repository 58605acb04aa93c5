# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What groups of satellites that exchange arrays cannot do yet, of what a scenario may ask for."""

from satform.communication.topic_table import array_bytes
from satform.scenario import Scenario

LARGEST_BAG = 500_000_000
"""Size of a bag above which a recorder of arrays leaves steps out, bytes."""

_OF_A_SATELLITE = (
    ("external", "an external satellite"),
    ("thruster", "thrusters"),
    ("sensor", "sensors"),
    ("sensors", "sensors"),
    ("filter", "filters"),
    ("navigation", "filters"),
    ("attitude", "attitudes"),
)
"""Fields of a satellite, and what they are called."""

_OF_A_SCENARIO = (
    ("faults", "faults"),
    ("links", "links"),
    ("graph_schedule", "changes of the graph"),
    ("reconfigurations", "reconfigurations"),
    ("checkpoint_period", "checkpoints"),
    ("publish_orbits", "orbit states on topics"),
    ("publish_sensor_messages", "messages of sensors"),
    ("hosts", "several hosts"),
)


def recorded_every(satellites: int, steps: int) -> int:
    """How many steps there are to each one that a recorder of arrays writes: 1 for all of them.

    The smallest number with which the bag stays below `LARGEST_BAG`.

    Args:
        satellites: of the formation.
        steps: of the flight.
    """
    return max(1, -(-array_bytes(satellites) * steps // LARGEST_BAG))


def array_complaints(scenario: Scenario) -> list[str]:
    """Why a scenario cannot be flown by groups that exchange arrays, as sentences; empty if it can.

    Args:
        scenario: what is to be flown.
    """
    found = [text for field, text in _OF_A_SCENARIO if getattr(scenario, field)]
    if scenario.consensus.announces != "arc_length":
        found.append("the exchange of motion")
    specs = [scenario.satellite(index) for index in range(len(scenario.satellites))]
    found += [text for field, text in _OF_A_SATELLITE if any(getattr(spec, field) for spec in specs)]
    if any(spec.controller is not None and spec.controller.makes_plans for spec in specs):
        found.append("control laws that make plans")
    return [
        f"groups that exchange arrays cannot fly {text} yet, which this scenario has; fly it without --arrays"
        for text in dict.fromkeys(found)
    ]
