# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans that are not solved are counted on /diagnostics; the flight has the bits of one in process."""

from pathlib import Path

import pytest
from mcap_ros2.reader import read_ros2_messages

from flights import shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured


def test_plans_that_are_not_solved_are_counted_in_the_diagnostics_of_their_satellite(tmp_path: Path) -> None:
    scenario = shortened("keep_out_transfer", 1800.0, "satellites.1.controller.iterations=2")
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag, counted = read_bag(flight.bag), dict[str, int]()
    for message in read_ros2_messages(str(bag.path), topics=["/diagnostics"]):
        for status in message.ros_msg.status:
            for value in status.values:
                if value.key == "plans not solved":
                    before = counted.get(status.hardware_id, 0)
                    counted[status.hardware_id] = max(before, int(value.value))
    # A report a second of a flight of several; one plan in each 60 s.
    assert counted.pop("around") in range(1, 31)
    assert counted == dict.fromkeys(counted, 0)
    assert simulate(scenario).differences(bag.record) == []
