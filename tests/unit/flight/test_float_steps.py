# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A flight by a program on floats is the flight over arrays, to the last bit and to its end."""

from typing import Any

import numpy as np
import pytest

from flights import shortened
from formations import formation
from satform.control.sliding_mode import SlidingMode
from satform.flight import float_steps
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario

STEPS = 60


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Steps that programs fly from now on: the first of them, and the one after the last."""
    found: list[tuple[int, int]] = []
    fly = float_steps._RecordedStep.fly

    def counted(self: Any, step: int, end: int) -> int:
        after = fly(self, step, end)
        found.append((step, after))
        return after

    monkeypatch.setattr(float_steps._RecordedStep, "fly", counted)
    monkeypatch.setattr(float_steps, "_WORTHWHILE", 10)
    monkeypatch.setattr(float_steps, "_SHORTEST_RUN", 5)
    return found


def over_arrays(scenario: Scenario, monkeypatch: pytest.MonkeyPatch, **options: Any) -> FlightRecord:
    with monkeypatch.context() as patched:
        patched.setattr(float_steps, "MOST_SATELLITES", 0)
        return simulate(scenario, **options)


@pytest.mark.parametrize(
    "name",
    [
        "adaptive_tracking",
        "approach_gssap",
        "attitude_limited_wheels",
        "byzantine_unprotected",
        "compare_controllers",
        "directed_triangle",
        "ei_separation",
        "geo_in_plane_circle",
        "integral_action",
        "thruster_limited",
        "trajectory_tracking_smooth",
        "triangle",
    ],
)
def test_shipped_scenarios_fly_by_programs_with_the_bits_of_arrays(
    name: str, flown: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    step = shortened(name, 1e5).timing.step
    scenario = shortened(name, STEPS * step)
    record = simulate(scenario)
    assert sum(after - first for first, after in flown) > STEPS // 2
    assert record.differences(over_arrays(scenario, monkeypatch)) == []


SATELLITES: list[dict[str, Any]] = [{"arc_length": 100.0}, {"arc_length": -50.0}, {"arc_length": 0.0}]
EVENTS: dict[str, dict[str, Any]] = {
    "lost and rejoined": {
        "faults": [{"kind": "satellite_lost", "satellite": "sat2", "at": 10.0, "rejoin_at": 20.0}],
        "checkpoint_period": 4.0,
    },
    "lost under real forces": {
        "dynamics": {"kind": "inertial"},
        "faults": [{"kind": "satellite_lost", "satellite": "sat2", "at": 10.0}],
    },
    "another graph": {
        "graph_schedule": [{"at": 10.0, "graph": {"kind": "ring"}}, {"at": 20.0, "graph": {"kind": "line"}}]
    },
    "a wrong clock": {"faults": [{"kind": "clock_offset", "satellite": "sat2", "offset": 0.2, "at": 12.0}]},
}


@pytest.mark.parametrize("stacked", [True, False])
@pytest.mark.parametrize("name", EVENTS)
def test_events_have_their_effect(
    name: str, stacked: bool, flown: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = formation(SATELLITES, 30.0, **EVENTS[name])
    record = simulate(scenario, stacked=stacked)
    assert flown
    assert record.differences(over_arrays(scenario, monkeypatch, stacked=stacked)) == []


def test_a_flight_that_diverges_ends_in_the_same_step(
    flown: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = formation(
        SATELLITES, 120.0, controller={"reaching_gain": 4.5}, consensus={"tracking_gain": 0.1}
    )
    record = simulate(scenario)
    assert flown
    assert record.early_end is not None
    assert record.differences(over_arrays(scenario, monkeypatch)) == []


def test_progress_is_told_after_each_step_and_a_flight_stops_at_once(flown: list[tuple[int, int]]) -> None:
    steps: list[int] = []
    record = simulate(
        formation(SATELLITES, 30.0), progress=steps.append, stop=lambda: bool(steps) and steps[-1] == 41
    )
    assert flown
    assert steps == list(range(1, 42))
    assert record.steps == 41
    assert bool(np.isfinite(record.position).all())


def test_a_part_of_another_package_flies_over_arrays(
    flown: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SlidingMode, "__module__", "own_laws.sliding")
    simulate(formation(SATELLITES, 30.0))
    assert flown == []


def test_a_program_that_has_other_bits_is_not_used(
    flown: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = formation(SATELLITES, 30.0)
    expected = over_arrays(scenario, monkeypatch)
    recorded = float_steps._recorded_step

    def wrong(*arguments: Any) -> Any:
        found = recorded(*arguments)
        found._rows[0] = np.nextafter(found._rows[0], np.inf)
        return found

    monkeypatch.setattr(float_steps, "_recorded_step", wrong)
    assert simulate(scenario).differences(expected) == []
    assert flown == []


def test_one_step_that_is_not_as_the_recorded_one_is_flown_over_arrays_and_the_program_goes_on(
    flown: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = formation(SATELLITES, 30.0)
    steps = scenario.timing.steps
    expected = over_arrays(scenario, monkeypatch)
    recorded, recordings = float_steps._recorded_step, []

    def deviating(*arguments: Any) -> Any:
        """A program that cannot fly step 40."""
        found = recorded(*arguments)
        run = found._run
        recordings.append(arguments[1])

        def until(step: int, end: int, *others: Any) -> Any:
            return run(step, min(end, 40) if step <= 40 else end, *others)

        found._run = until
        return found

    monkeypatch.setattr(float_steps, "_recorded_step", deviating)
    assert simulate(scenario).differences(expected) == []
    assert len(recordings) == 1
    assert sum(after - first for first, after in flown) == steps - recordings[0] - 2
