# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The in-process run: a pure function of the scenario, the same flown together or one by one."""

import hashlib
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flights import SCENARIOS, begun, satellites_together
from formations import CIRCLE, RADIUS, RATE, formation
from satform.flight.compile import plant_plan
from satform.flight.plant import Plant
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES
from satform.scenario import Scenario

Array = NDArray[np.float64]

STEPS = 40
INTERVAL = 5
"""Between checkpoints of shipped scenarios, steps."""
ELLIPSE = {"kind": "ellipse", "first_axis": [0.0, 1000.0, 0.0], "second_axis": [500.0, 0.0, 0.0]}
POINT = {"kind": "fixed_point", "position": [0.0, -2000.0, 100.0]}


def digest(record: FlightRecord) -> str:
    return hashlib.sha256(b"".join(getattr(record, name).tobytes() for name in QUANTITIES)).hexdigest()


def angle(position: Array) -> Array:
    """On the circle, by nothing but trigonometry."""
    return np.unwrap(np.arctan2(position[..., 1], position[..., 0]), axis=0)


@pytest.mark.parametrize("file", sorted(SCENARIOS.glob("*.yaml")), ids=lambda file: file.stem)
def test_satellites_flown_together_have_the_bits_of_satellites_flown_one_by_one(file: Path) -> None:
    scenario, stacked = begun(file.stem, INTERVAL)
    assert scenario.timing.steps == 3 * INTERVAL
    assert stacked.differences(simulate(scenario, stacked=False)) == []


MIXED = [
    {"curve": CIRCLE, "arc_length": 100.0},
    {"curve": ELLIPSE, "scale": 0.8, "position_error": [3.0, -2.0, 1.0]},
    {"curve": POINT},
    {"curve": {**ELLIPSE, "centre": [0.0, 0.0, 500.0]}, "path_parameter": "angle", "phase_offset": -40.0},
    {"curve": {**CIRCLE, "radius": 800.0}, "feedforward_sample": "start", "rate": 1.0},
]


@pytest.mark.parametrize("source", ["reference", "projected"])
@pytest.mark.parametrize("graph", ["complete", "ring", "line", "star", "none"])
def test_mixed_kinds_of_curves_fly_in_one_formation_with_the_same_bits(graph: str, source: str) -> None:
    scenario = formation(
        MIXED,
        STEPS * 0.5,
        graph={"kind": graph},
        consensus={"arc_length_source": source, "neighbour_values": "extrapolate"},
    )
    with pytest.raises(ValueError, match="cannot stack"):
        satellites_together(scenario, range(len(MIXED)))
    record = simulate(scenario)
    assert record.differences(simulate(scenario, stacked=False)) == []
    assert all(
        np.isfinite(getattr(record, name)).all() for name in ("position", "acceleration", "arc_length")
    )


@pytest.mark.parametrize("source", ["reference", "projected"])
@pytest.mark.parametrize("neighbour_values", ["hold", "extrapolate"])
def test_satellites_with_unequal_numbers_of_neighbours_have_the_same_bits_padded(
    source: str, neighbour_values: str
) -> None:
    hears = [[0, 1, 1, 1], [1, 0, 0, 0], [0, 0, 0, 0], [0, 1, 1, 0]]
    satellites = [{"arc_length": 100.0 * i, "position_error": [5.0 * i, 1.0, -i]} for i in range(4)]
    scenario = formation(
        satellites,
        STEPS * 0.5,
        graph={"kind": "matrix", "rows": hears},
        consensus={"arc_length_source": source, "neighbour_values": neighbour_values},
    )
    satellites_together(scenario, range(4))
    assert simulate(scenario).differences(simulate(scenario, stacked=False)) == []


def test_the_numbers_of_a_satellite_do_not_depend_on_who_flies_beside_it_unheard() -> None:
    satellites = [{"arc_length": 300.0 * i, "position_error": [5.0, 1.0 * i, -2.0]} for i in range(3)]
    noise = {"kind": "cw", "perturbations": [{"kind": "bounded_noise", "bound": 0.01}]}
    many = simulate(formation(satellites, STEPS * 0.5, graph={"kind": "none"}, dynamics=noise))
    single = simulate(formation(satellites[:1], STEPS * 0.5, graph={"kind": "none"}, dynamics=noise))
    for name in QUANTITIES:
        assert getattr(many, name)[:, :1].tobytes() == getattr(single, name).tobytes(), name


def test_the_record_holds_every_state_and_every_decision() -> None:
    record = simulate(formation(MIXED, 5.0))
    assert record.steps == 10
    assert record.satellites == ("sat1", "sat2", "sat3", "sat4", "sat5")
    assert record.position.shape == record.velocity.shape == (11, 5, 3)
    assert record.arc_length.shape == record.rate.shape == (11, 5)
    assert record.acceleration.shape == record.sliding_variable.shape == (10, 5, 3)


def test_satellites_begin_where_the_scenario_says() -> None:
    quarter = 0.5 * math.pi * RADIUS
    error = {"position_error": [3.0, 4.0, 5.0], "velocity_error": [0.1, 0.2, 0.3]}
    record = simulate(formation([{"arc_length": 0.0}, {"arc_length": quarter, **error}, {"rate": -1.0}], 0.5))
    assert record.position[0] == pytest.approx(
        np.array([[RADIUS, 0.0, 0.0], [3.0, RADIUS + 4.0, 5.0], [RADIUS, 0.0, 0.0]]), abs=1e-9
    )
    assert record.velocity[0] == pytest.approx(
        np.array([[0.0, RATE, 0.0], [-RATE + 0.1, 0.2, 0.3], [0.0, -1.0, 0.0]]), abs=1e-12
    )
    assert record.arc_length[0].tolist() == [0.0, quarter, 0.0]
    assert record.rate[0].tolist() == [RATE, RATE, -1.0]


def test_a_period_is_flown_as_a_lap_in_that_time() -> None:
    record = simulate(formation([{}], 400.0, nominal_motion={"period": 400.0}))
    turned = angle(record.reference_position[:, 0])
    assert turned[-1] + (turned[-1] - turned[-2]) == pytest.approx(2.0 * math.pi, rel=1e-9)


def test_the_plant_moves_freely_without_commands() -> None:
    # Twice as long along-track as radially, once round in one orbit: a free relative motion.
    free = formation(
        [{"curve": ELLIPSE, "path_parameter": "angle"}], 6000.0, nominal_motion={"period": 6000.0}
    )
    plant = Plant(plant_plan(free))
    for step in range(12_000):
        if step % 1000 == 0:
            turned = 2.0 * math.pi * step / 12_000
            expected = [500.0 * math.sin(turned), 1000.0 * math.cos(turned), 0.0]
            assert plant.motion().position[0] == pytest.approx(expected, abs=1e-5)
        assert plant.step == step
        plant.advance(np.zeros((1, 3)))
    assert plant.motion().position[0] == pytest.approx([0.0, 1000.0, 0.0], abs=1e-5)


def test_satellites_end_apart_by_their_phase_offsets() -> None:
    offsets = [0.0, 500.0, -250.0]
    satellites = [{"phase_offset": offset, "arc_length": 50.0 * i} for i, offset in enumerate(offsets)]
    record = simulate(formation(satellites, 400.0))
    final = angle(record.position)[-1] * RADIUS
    assert final - final[0] == pytest.approx(offsets, abs=0.02)
    assert np.ptp(record.arc_length[-1]) < 1e-3
    assert record.rate[-1] == pytest.approx(RATE, rel=1e-5)


def test_without_offsets_and_in_agreement_everybody_goes_on_at_the_nominal_rate() -> None:
    record = simulate(formation([{}, {}, {}], 100.0))
    assert record.arc_length == pytest.approx(np.outer(RATE * record.time, np.ones(3)), rel=1e-13)


def test_the_formation_pulls_no_one_without_a_graph() -> None:
    record = simulate(formation([{"arc_length": 0.0}, {"arc_length": 500.0}], 100.0, graph={"kind": "none"}))
    assert record.arc_length[:, 1] - record.arc_length[:, 0] == pytest.approx(500.0, rel=1e-12)


LAGGARD = {"position_error": [0.0, -300.0, 0.0]}
"""Starts by about 17 degrees of the circle behind its reference."""

WEAK = {"proportional_gain": 0.01, "switching_gain": 0.01, "reaching_gain": 0.01}


def chased(source: str) -> FlightRecord:
    """A satellite on its reference, and one behind its own that comes back slowly."""
    return simulate(formation([{}, LAGGARD], 200.0, controller=WEAK, consensus={"arc_length_source": source}))


def test_with_projected_arc_lengths_the_formation_waits_for_a_laggard() -> None:
    time = 50.0
    row = round(time / 0.5)
    advance = {
        source: (angle(chased(source).position)[row, 0] - angle(chased(source).position)[0, 0]) * RADIUS
        for source in ("reference", "projected")
    }
    assert advance["reference"] == pytest.approx(RATE * time, abs=1.0)
    assert advance["projected"] < 0.5 * RATE * time


def test_once_the_laggard_has_caught_up_the_formation_goes_on_together() -> None:
    record = chased("projected")
    places = angle(record.position) * RADIUS
    assert abs(places[0, 0] - places[0, 1]) > 250.0
    assert abs(places[-1, 0] - places[-1, 1]) < 5.0
    assert record.rate[-1] == pytest.approx(RATE, rel=0.05)


def test_a_projected_arc_length_is_that_of_the_true_place_one_step_before() -> None:
    record = chased("projected")
    assert record.arc_length[1:] == pytest.approx(angle(record.position)[:-1] * RADIUS, abs=1e-6)


def test_a_projected_arc_length_counts_the_laps() -> None:
    laps = 2.0 * 2.0 * math.pi * RADIUS
    satellites = [{"arc_length": laps + 10.0}, {"arc_length": laps - 10.0}]
    record = simulate(formation(satellites, 10.0, consensus={"arc_length_source": "projected"}))
    assert record.arc_length[1] == pytest.approx([laps + 10.0, laps - 10.0], abs=1e-6)


NOISY = {"kind": "cw", "perturbations": [{"kind": "bounded_noise", "bound": 0.01}]}


def test_a_scenario_flown_twice_gives_the_same_bits() -> None:
    scenario = formation(MIXED, 20.0, dynamics=NOISY, seed=5)
    assert simulate(scenario).differences(simulate(scenario)) == []


def test_a_scenario_read_again_from_its_json_gives_the_same_bits() -> None:
    scenario = formation(MIXED, 20.0, dynamics=NOISY, seed=5)
    again = Scenario.model_validate_json(scenario.to_json())
    assert simulate(scenario).differences(simulate(again)) == []


def test_another_process_gives_the_same_bits(tmp_path: Path) -> None:
    scenario = formation(MIXED, 20.0, dynamics=NOISY, seed=5)
    file = tmp_path / "scenario.json"
    file.write_bytes(scenario.to_json().encode())
    program = (
        "import sys; sys.path += sys.argv[2:]\n"
        "from test_simulate import digest, simulate\n"
        "from satform.scenario import load_scenario\n"
        "print(digest(simulate(load_scenario(sys.argv[1]))))"
    )
    paths = [str(Path(__file__).parent), str(Path(__file__).parents[2]), *filter(None, sys.path)]
    finished = subprocess.run(
        [sys.executable, "-c", program, str(file), *paths],
        env={**os.environ, "PYTHONHASHSEED": "12345"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert finished.returncode == 0, finished.stderr
    assert finished.stdout.strip() == digest(simulate(scenario))


def test_another_seed_gives_other_noise_and_another_flight() -> None:
    records = [simulate(formation([{}, {}], 20.0, dynamics=NOISY, seed=seed)) for seed in (0, 1)]
    assert (records[0].position[1:] != records[1].position[1:]).all()
    assert records[0].position[0].tolist() == records[1].position[0].tolist()


def test_without_anything_random_the_seed_does_not_matter() -> None:
    records = [simulate(formation([{}, {}], 20.0, seed=seed)) for seed in (0, 1)]
    assert records[0].differences(records[1]) == []


def test_progress_is_told_after_every_step() -> None:
    told: list[int] = []
    simulate(formation([{}], 5.0), progress=told.append)
    assert told == list(range(1, 11))
