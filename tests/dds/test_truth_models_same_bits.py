# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Every truth model, thruster, sensor and filter flies over DDS as it does in one process, bit for bit."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from earth_orientation_table import finals
from flights import SCENARIOS, shipped, shortened
from satform.bag.reader import read_bag
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.scenario import load_scenario
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

STEPS = 40


def flown(name: str, out: Path) -> tuple[FlightRecord, FlightRecord, dict[str, int]]:
    """The record of a short lockstep flight, that of the same flight in process, and the bag's messages."""
    scenario = shortened(name, STEPS * shipped(name).timing.step)
    flight = fly(scenario, out, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.reason
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    return bag.record, simulate(scenario), bag.messages


@pytest.mark.parametrize(
    "name", ["leo_degree10", "geo_degree10", "leo_drag_srp", "triangle_inertial", "truth_j2"]
)
def test_a_lockstep_flight_under_each_truth_has_the_bits_of_the_in_process_run(
    name: str, tmp_path: Path
) -> None:
    recorded, in_process, _ = flown(name, tmp_path)
    assert in_process.differences(recorded) == []


def test_satellites_that_coast_ahead_of_time_fly_over_dds_as_in_process(tmp_path: Path) -> None:
    # One of the two has commands, the other has none.
    changes = [
        "dynamics.integrator={kind: collocation, maximum_step: 200.0}",
        f"timing.duration={STEPS * shipped('leo_drag_srp').timing.step}",
        "expect=[]",
    ]
    scenario = load_scenario(SCENARIOS / "leo_drag_srp.yaml", changes)
    flight = fly(scenario, tmp_path, record=True, progress=lambda _done, _all: None)
    assert flight.bag is not None
    assert simulate(scenario).differences(read_bag(flight.bag).record) == []


def test_a_scenario_that_names_a_file_flies_and_is_read_from_its_bag_without_it(tmp_path: Path) -> None:
    folder, out = tmp_path / "scenario", tmp_path / "run"
    folder.mkdir()
    out.mkdir()
    (folder / "eop.txt").write_text(finals())
    text = (SCENARIOS / "leo_degree10.yaml").read_text()
    (folder / "scenario.yaml").write_text(text)
    gravity = "dynamics.gravity={degree: 4, rotation: full, orientation_file: eop.txt}"
    changes = [gravity, "timing.duration=600.0", "expect=[]"]
    scenario = load_scenario(folder / "scenario.yaml", changes)
    flight = fly(scenario, out, record=True, progress=lambda _done, _all: None)
    assert flight.bag is not None
    shutil.rmtree(folder)
    bag = read_bag(flight.bag.rename(tmp_path / "bag"))
    assert bag.scenario.digest() == scenario.digest()
    assert simulate(bag.scenario).differences(bag.record) == []
    assert load_scenario(out / "scenario.json").digest() == scenario.digest()


def test_measured_states_and_estimates_are_the_same_and_the_truth_has_a_topic_of_its_own(
    tmp_path: Path,
) -> None:
    recorded, in_process, messages = flown("noisy_navigation", tmp_path)
    assert in_process.differences(recorded) == []
    assert [messages[f"/{name}/truth"] for name in ("raw", "filtered", "late")] == [STEPS + 1] * 3
    assert np.all(recorded.navigation_error[:, 0] > 0.0)


def test_what_the_thrusters_gave_is_the_same_and_has_a_topic_of_its_own(tmp_path: Path) -> None:
    recorded, in_process, messages = flown("thruster_limited", tmp_path)
    assert in_process.differences(recorded) == []
    assert [messages[f"/sat{number}/propulsion"] for number in (1, 2, 3)] == [STEPS] * 3
    assert recorded.saturated_steps[-1].min() > 0.0
    assert np.all(np.diff(recorded.propellant, axis=0) <= 0.0)


def test_satellites_without_sensor_and_thruster_have_no_topics_for_them(tmp_path: Path) -> None:
    _, _, messages = flown("triangle", tmp_path)
    assert not [topic for topic in messages if topic.endswith(("/truth", "/propulsion"))]
