# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Warning about fields of a scenario that the program of an external satellite would have to realise."""

from satform.common.name_list import listed
from satform.flight.compile import external_satellites
from satform.membership.faults import ByzantineSpec, ClockOffsetSpec
from satform.scenario import Scenario


def external_satellite_warnings(scenario: Scenario) -> list[str]:
    """A sentence for each field that satform's own flight software realises, about an external satellite."""
    external = external_satellites(scenario)
    if not external:
        return []
    found = [
        f"faults[{row}]: {fault.kind} is realised by a satellite's own node, and {fault.satellite} is "
        "external: over DDS it has this fault only if its program makes it"
        for row, fault in enumerate(scenario.faults)
        if isinstance(fault, ByzantineSpec | ClockOffsetSpec) and fault.satellite in external
    ]
    if scenario.links is not None:
        found.append(
            f"links: loss and delay are realised by the receiver, and {listed(external)} is external: over "
            "DDS it receives every message at once unless its program applies them"
        )
    for row, change in enumerate(scenario.reconfigurations):
        names = [target.satellite for target in change.targets if target.satellite in external]
        if names:
            found.append(
                f"reconfigurations[{row}]: the new target of {listed(names)} is published in the status, and "
                "over DDS an external satellite flies it only if its program does"
            )
    return found
