# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans that are not solved are recorded and counted on /diagnostics; the bits are those in process."""

from pathlib import Path

import numpy as np
import pytest
from mcap_ros2.reader import read_ros2_messages

from flights import shortened
from satform.bag.reader import read_bag
from satform.evaluation.evaluate import evaluate
from satform.flight.simulate import simulate
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured


def test_plans_that_are_not_solved_are_counted_in_the_diagnostics_of_their_satellite(tmp_path: Path) -> None:
    expected = (
        "expect=[{kind: unsolved_plans, satellites: [around], value: 30, absolute: 0.5, source: theory}]"
    )
    scenario = shortened("keep_out_transfer", 1800.0, "satellites.1.controller.iterations=2", expected)
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
    # The same is in the record, step by step, and is a figure of the flight.
    unsolved = {name: bag.record[name].unsolved_plans for name in bag.record.satellites}
    assert np.flatnonzero(unsolved.pop("around")).tolist() == (6 * np.arange(30)).tolist()
    assert {name: plans.max() for name, plans in unsolved.items()} == dict.fromkeys(unsolved, 0.0)
    (verdict,) = evaluate(scenario, bag.record)
    assert verdict.met
    assert verdict.figure == 30.0
