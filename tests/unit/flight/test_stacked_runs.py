# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Many runs flown as one formation: every number of each has the bits that it has alone."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from flights import SCENARIOS, shipped
from satform.evaluation.evaluate import evaluate
from satform.flight.compile import FormationPlan, compile_scenario
from satform.flight.simulate import simulate
from satform.flight.stacked_plans import group_runs
from satform.flight.stacked_runs import fly_stacked
from satform.record.flight_block import FlightBlock
from satform.record.flight_record import FlightRecord
from satform.record.quantities import QUANTITIES
from satform.scenario import Scenario

pytestmark = pytest.mark.unmeasured

STEPS = 10
RUNS = 3
EVERYTHING = frozenset(QUANTITIES)
LOST = {"satellite_lost_and_rejoined"}
COUNTED = {"horizon", "interval"}
"""Times that are rounded to a number of intervals, which runs flown as one have in common."""


def scaled(value: Any, factor: float) -> Any:
    """Numbers of a specification times a factor; flags, counts and words as they are."""
    if isinstance(value, dict):
        return {name: part if name in COUNTED else scaled(part, factor) for name, part in value.items()}
    if isinstance(value, list):
        return [scaled(part, factor) for part in value]
    return value * factor if isinstance(value, float) else value


def dispersed(scenario: Scenario, run: int) -> Scenario:
    """A scenario with another seed, other starts, gains, noise and thrusters."""
    factor = 1.0 + 2.0**-8 * run
    changes: dict[str, Any] = {"seed": 100 + run, "consensus": scaled(plain(scenario.consensus), factor)}
    if scenario.links is not None:
        changes["links"] = {**plain(scenario.links), "default": {"loss": 0.1 + 0.1 * run, "jitter": 30.0}}
    for index in range(len(scenario.satellites)):
        own, path = scenario.satellite(index), f"satellites[{index}]"
        if own.start is None:
            changes[f"{path}.position_error"] = [3.0 * run, -2.0 * index, 0.5 * run]
        else:
            changes[f"{path}.start"] = scaled(plain(own.start), factor)
        changes[f"{path}.controller"] = scaled(plain(own.controller), factor)
        changes[f"{path}.curve"] = scaled(plain(own.curve), factor)
        if own.thruster is not None:
            changes[f"{path}.thruster.magnitude_error"] = 0.01 * run
        if own.sensor is not None:
            changes[f"{path}.sensor.position_noise"] = [1.0 + run] * 3
        if own.attitude is not None:
            changes[f"{path}.attitude.wheel_speed"] = [1.0 * run, 0.5, 0.25]
    perturbations = getattr(scenario.dynamics, "perturbations", ())
    for index, perturbation in enumerate(perturbations):
        changes[f"dynamics.perturbations[{index}]"] = scaled(plain(perturbation), factor)
    return scenario.with_(changes)


def plain(spec: Any) -> Any:
    return spec.model_dump(mode="json", exclude_none=True)


def short(name: str, steps: int = STEPS) -> Scenario:
    return shipped(name, f"timing.duration={steps * shipped(name).timing.step}", "expect=[]")


def flown(
    scenarios: Sequence[Scenario], *, block_steps: int = 4, quantities: frozenset[str] = EVERYTHING
) -> tuple[list[FlightBlock], dict[int, int]]:
    return flown_by([compile_scenario(scenario) for scenario in scenarios], block_steps, quantities)


def flown_by(
    plans: Sequence[FormationPlan], block_steps: int = 4, quantities: frozenset[str] = EVERYTHING
) -> tuple[list[FlightBlock], dict[int, int]]:
    blocks: list[FlightBlock] = []
    ends = fly_stacked(plans, blocks.append, quantities, block_steps=block_steps)
    return blocks, ends


def series(blocks: Sequence[FlightBlock], name: str, run: int) -> NDArray[np.float64]:
    return np.concatenate([block.quantities[name][:, run] for block in blocks])


def unlike(blocks: Sequence[FlightBlock], run: int, record: FlightRecord) -> list[str]:
    """Quantities of a run whose bits are not those of a record."""
    return [
        name
        for name in QUANTITIES
        if getattr(record, name).tobytes() != series(blocks, name, run).tobytes()
        or getattr(record, name).shape != series(blocks, name, run).shape
    ]


def grouped(scenarios: Sequence[Scenario]) -> list[tuple[int, ...]]:
    return group_runs([compile_scenario(scenario) for scenario in scenarios])


@pytest.mark.parametrize("file", sorted(SCENARIOS.glob("*.yaml")), ids=lambda file: file.stem)
def test_dispersed_runs_flown_as_one_have_the_bits_of_each_flown_alone(file: Path) -> None:
    base = short(file.stem)
    runs = [dispersed(base, run) for run in range(RUNS)]
    plans = [compile_scenario(run) for run in runs]
    if any(base.satellite(index).sensors for index in range(len(base.satellites))):
        # Runs with sensors are flown one by one.
        assert group_runs(plans) == []
        return
    assert group_runs(plans) == [tuple(range(RUNS))]
    blocks, ends = flown_by(plans)
    assert ends == {}
    assert [block.steps for block in blocks] == [4, 4, 2]
    assert [block.last for block in blocks] == [False, False, True]
    records = [simulate(run) for run in runs]
    for run, record in enumerate(records):
        assert unlike(blocks, run, record) == []
    # What is compared differs from run to run.
    assert len({record.position.tobytes() for record in records}) == RUNS


def ending(run: int) -> Scenario:
    """A run with noisy sensors, the control loop of which is unstable in the runs 1 and 3."""
    gain = 1.2 + 0.2 * run if run in (1, 3) else 0.05
    changes = {"satellite_defaults.controller.reaching_gain": gain, "seed": run}
    return short("noisy_navigation", 60).with_({**changes, "limits.speed": 2000.0})


def test_a_run_that_ends_early_leaves_the_others_their_bits() -> None:
    runs = [ending(run) for run in range(5)]
    records = [simulate(run) for run in runs]
    ended = {run: record.early_end for run, record in enumerate(records) if record.early_end is not None}
    assert set(ended) == {1, 3}
    blocks, ends = flown(runs, block_steps=7)
    assert ends == {run: end.step for run, end in ended.items()}
    assert max(ends.values()) + 14 < 60
    for run, record in enumerate(records):
        if run not in ends:
            assert unlike(blocks, run, record) == []
        else:
            # What it flew before its end is its own, too.
            steps = record.steps
            assert series(blocks, "position", run)[: steps + 1].tobytes() == record.position.tobytes()
            assert series(blocks, "acceleration", run)[:steps].tobytes() == record.acceleration.tobytes()
    assert all(block.runs == 5 for block in blocks)


@pytest.mark.parametrize(
    ("name", "below", "changes"),
    [
        ("triangle", 1.0e5, {"limits.altitude": 2.0e5}),
        # The chief starts in its perigee, 143 km below the circle of the same period.
        (
            "triangle_inertial",
            5.0e3,
            {"limits.altitude": 6.0e5, "dynamics.chief.eccentricity": 0.02, "dynamics.gravity.degree": 0},
        ),
    ],
)
def test_runs_end_in_the_step_in_which_each_would_end_alone(
    name: str, below: float, changes: dict[str, Any]
) -> None:
    runs = [
        short(name, 8).with_({**changes, "satellites[0].position_error": [-below * run, 0, 0]})
        for run in range(9)
    ]
    alone = {
        run: record.early_end.step
        for run, record in enumerate(map(simulate, runs))
        if record.early_end is not None
    }
    assert 0 < len(alone) < 9
    assert flown(runs)[1] == alone


@pytest.mark.parametrize(
    "name",
    [
        "compare_controllers",
        "formation_pointing",
        "leo_drag_srp",
        "lossy_links",
        "noisy_navigation",
        "switching_graph",
        "thruster_limited",
        "truth_j2",
    ],
)
def test_all_parts_of_the_other_runs_go_on_once_one_has_left(name: str) -> None:
    runs = [dispersed(short(name), run) for run in range(3)]
    runs[1] = runs[1].with_({"satellites[0].position_error": [0.0, 3.0e7, 0.0]})
    blocks, ends = flown(runs)
    assert ends == {1: 0}
    assert len(blocks) == 3
    for run in (0, 2):
        assert unlike(blocks, run, simulate(runs[run])) == []


def test_every_run_may_end() -> None:
    runs = [ending(1).with_({"seed": seed}) for seed in range(2)]
    blocks, ends = flown(runs)
    assert set(ends) == {0, 1}
    assert sum(block.steps for block in blocks) < 60


@pytest.mark.parametrize("name", ["noisy_navigation", "lossy_links", "formation_pointing"])
def test_the_bits_do_not_depend_on_how_a_flight_is_cut_into_blocks(name: str) -> None:
    runs = [dispersed(short(name, 12), run) for run in range(2)]
    whole = flown(runs, block_steps=100)[0]
    assert len(whole) == 1
    for block_steps in (1, 5):
        parts = flown(runs, block_steps=block_steps)[0]
        for quantity in QUANTITIES:
            for run in range(2):
                assert series(parts, quantity, run).tobytes() == series(whole, quantity, run).tobytes(), (
                    quantity
                )


def test_random_numbers_of_many_satellites_drawn_part_by_part_are_those_of_one() -> None:
    runs = [short("noisy_navigation", 40).with_({"seed": seed}) for seed in range(25)]
    blocks, _ = flown(runs, block_steps=9, quantities=frozenset({"measured_position"}))
    for run in (0, 24):
        alone = simulate(runs[run]).measured_position
        assert series(blocks, "measured_position", run).tobytes() == alone.tobytes()


def test_only_what_is_asked_for_is_handed_over() -> None:
    runs = [short("triangle").with_({"seed": seed}) for seed in range(2)]
    blocks, _ = flown(runs, quantities=frozenset({"rate", "acceleration"}))
    assert {name for block in blocks for name in block.quantities} == {"rate", "acceleration"}
    assert [block.rate.shape for block in blocks] == [(4, 2, 3), (4, 2, 3), (3, 2, 3)]
    with pytest.raises(KeyError, match="no speed"):
        flown(runs, quantities=frozenset({"speed"}))


@pytest.mark.parametrize(
    "changes",
    [
        {"faults": [{"kind": "satellite_lost", "satellite": "sat2", "at": 2.0}]},
        {"faults": [{"kind": "clock_offset", "satellite": "sat2", "at": 2.0, "offset": 1.0}]},
        {"timing.step": 0.25},
        {"timing.duration": 2.0},
        {"satellites[1].controller": {"kind": "feedback_linearisation"}},
        {"dynamics": {"kind": "linear_j2"}},
        {"graph": {"kind": "ring"}, "satellites[2].name": "third"},
        {"graph": {"kind": "line"}},
        {"links": {"default": {"loss": 0.5}}},
        {"limits": {"speed": 1.0e4}},
        {"satellite_defaults.thruster": {"dry_mass": 10.0}},
    ],
    ids=str,
)
def test_what_cannot_be_flown_with_the_others_is_in_no_group(changes: dict[str, Any]) -> None:
    base = short("triangle")
    assert grouped([base, base.with_({"seed": 5}), base.with_(changes)]) == [(0, 1)]


def test_runs_with_other_formulas_or_constants_are_no_group() -> None:
    base = short("own_truth_model")
    longer = base.with_({"dynamics.constants[r].value": 7.0e6})
    pushed = base.with_({"dynamics.acceleration[2]": "-n**2*z"})
    assert grouped([base, longer, base.with_({"seed": 3}), pushed]) == [(0, 2)]


def test_runs_of_two_kinds_are_two_groups() -> None:
    base = short("triangle")
    other = base.with_({"satellite_defaults.thruster": {"dry_mass": 10.0}})
    found = grouped([base, other, base.with_({"seed": 1}), other.with_({"seed": 2})])
    assert found == [(0, 2), (1, 3)]


@pytest.mark.parametrize(
    "fault",
    [{"kind": "satellite_lost", "at": 2.0}, {"kind": "clock_offset", "at": 2.0, "offset": 1.0}],
    ids=str,
)
def test_runs_with_faults_are_no_group(fault: dict[str, Any]) -> None:
    faulty = short("triangle").with_({"faults": [{"satellite": "sat2", **fault}]})
    assert grouped([faulty, faulty.with_({"seed": 5})]) == []


def test_the_chief_s_orbit_and_the_masses_may_differ_from_run_to_run() -> None:
    base = short("thruster_limited", 20)
    runs = [
        base.with_({"orbit.period": 6000.0 + 50.0 * run, "satellites[*].thruster.dry_mass": 10.0 + run})
        for run in range(3)
    ]
    blocks, ends = flown(runs)
    assert ends == {}
    for run, scenario in enumerate(runs):
        assert unlike(blocks, run, simulate(scenario)) == []


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("directed_triangle", {"dynamics.linear": (-0.2, -0.3), "dynamics.wave": (0.4, 0.2)}),
        (
            "directed_triangle",
            {"dynamics.gravity": ("point_mass", "point_mass"), "dynamics.quadratic": (0.05, 0.02)},
        ),
        (
            "leo_drag_srp",
            {"dynamics.satellite_bodies[0].drag_area": (1.0, 2.0)},
        ),
    ],
)
def test_what_acts_on_satellites_may_differ_from_run_to_run(
    name: str, changes: dict[str, tuple[float, float]]
) -> None:
    runs = [short(name, 4).with_({path: values[run] for path, values in changes.items()}) for run in range(2)]
    blocks, _ = flown(runs, block_steps=3)
    records = [simulate(run) for run in runs]
    for run, record in enumerate(records):
        assert unlike(blocks, run, record) == []
    assert records[0].position.tobytes() != records[1].position.tobytes()


def test_unsolved_plans_of_many_runs_are_those_of_each_and_a_figure_over_a_window() -> None:
    expect = [
        {"kind": "unsolved_plans", "satellites": ["around"], "after": after, "below": 99.0, "source": "none"}
        for after in (0.0, 30.0)
    ]
    changes = {"timing.duration": 300.0, "satellites[1].controller.iterations": 2, "expect": expect}
    base = shipped("keep_out_transfer").with_(changes)
    runs = [base.with_({"satellites[1].position_error": [3.0 * run, 0.0, 0.0]}) for run in range(2)]
    blocks, _ = flown(runs, block_steps=7)
    for run, scenario in enumerate(runs):
        record = simulate(scenario)
        assert unlike(blocks, run, record) == []
        # One a minute from the start on, each of which is made at the step on the minute.
        assert [verdict.figure for verdict in evaluate(scenario, record)] == [5.0, 4.0]
        assert record["plane"].unsolved_plans.max() == 0.0
