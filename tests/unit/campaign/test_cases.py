# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Case N follows from the campaign's file and N alone, and is the scenario with its changes."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from campaigns import campaign, of
from satform.campaign.cases import case_scenario, case_values
from satform.campaign.chunk import columns_of
from satform.campaign.sampling import SOBOL_STREAM, case_seed

UNIT = {"kind": "uniform", "low": 0.0, "high": 1.0}


def column(made: Any, path: str) -> np.ndarray:
    return np.array([case_values(made, number)[path] for number in range(made.cases)])


@pytest.mark.parametrize("kind", ["monte_carlo", "latin_hypercube", "sobol"])
def test_a_case_is_the_same_whatever_was_asked_for_before(kind: str) -> None:
    fields = {"runs": 600, "sampling": {"kind": kind}, "dispersions": [of("satellites[*].arc_length", UNIT)]}
    forwards, backwards = campaign(**fields), campaign(**fields)
    there = [case_values(forwards, number) for number in range(600)]
    back = [case_values(backwards, number) for number in reversed(range(600))]
    assert there == back[::-1]
    assert len({tuple(values.values()) for values in there}) == 600


@pytest.mark.parametrize("kind", ["monte_carlo", "sobol"])
def test_more_runs_leave_the_earlier_cases_as_they_are(kind: str) -> None:
    fields = {"sampling": {"kind": kind}, "dispersions": [of("satellites[*].arc_length", UNIT)]}
    few, many = campaign(runs=10, **fields), campaign(runs=1000, **fields)
    assert [case_values(few, number) for number in range(10)] == [case_values(many, n) for n in range(10)]


def test_another_seed_makes_other_cases() -> None:
    fields = {"runs": 3, "dispersions": [of("satellites[0].arc_length", UNIT)]}
    assert case_values(campaign(seed=1, **fields), 0) != case_values(campaign(seed=2, **fields), 0)


def test_a_latin_hypercube_has_one_case_in_each_stratum_of_every_axis() -> None:
    made = campaign(
        runs=50, sampling={"kind": "latin_hypercube"}, dispersions=[of("satellites[*].arc_length", UNIT)]
    )
    for index in range(3):
        found = column(made, f"satellites[{index}].arc_length")
        assert sorted(np.floor(found * 50).astype(int)) == list(range(50))


def test_a_sobol_sequence_is_that_of_scipy() -> None:
    made = campaign(
        runs=700, seed=5, sampling={"kind": "sobol"}, dispersions=[of("satellites[*].arc_length", UNIT)]
    )
    generator = np.random.default_rng([5, SOBOL_STREAM])
    points = qmc.Sobol(3, scramble=True, rng=generator).random(1024)[:700]
    found = np.stack([column(made, f"satellites[{index}].arc_length") for index in range(3)], axis=1)
    assert np.array_equal(found, points)


def test_sobol_points_are_spread_more_evenly_than_random_ones() -> None:
    spread = {}
    for kind in ("sobol", "monte_carlo"):
        made = campaign(runs=512, sampling={"kind": kind}, dispersions=[of("satellites[*].arc_length", UNIT)])
        points = np.stack([column(made, f"satellites[{index}].arc_length") for index in range(3)], axis=1)
        spread[kind] = qmc.discrepancy(points)
    assert spread["sobol"] < 0.1 * spread["monte_carlo"]


def test_a_grid_goes_through_every_combination_again_and_again() -> None:
    made = campaign(
        sampling={"kind": "grid", "repeats": 2},
        dispersions=[
            of("satellites[0].arc_length", grid={"values": [1.0, 2.0]}),
            of("satellites[1].arc_length", grid={"first": 0.0, "last": 1.0, "count": 3}),
            of("satellites[2].arc_length", UNIT),
        ],
    )
    assert made.cases == 12
    paths = [f"satellites[{index}].arc_length" for index in range(2)]
    found = [tuple(case_values(made, number)[path] for path in paths) for number in range(12)]
    once = [(1.0, 0.0), (1.0, 0.5), (1.0, 1.0), (2.0, 0.0), (2.0, 0.5), (2.0, 1.0)]
    assert found == once * 2
    assert len(set(column(made, "satellites[2].arc_length"))) == 12
    assert len(set(column(made, "seed"))) == 12


def test_one_at_a_time_begins_with_the_scenario_itself() -> None:
    made = campaign(
        sampling={"kind": "one_at_a_time", "quantiles": [0.25, 0.75]},
        same_noise=True,
        dispersions=[
            of("satellites[0].arc_length", UNIT, applied="add"),
            of("orbit.period", grid={"values": [5900.0, 6100.0, 6200.0]}),
        ],
    )
    own, period = made.base.satellites[0].arc_length, 6000.0
    found = [tuple(case_values(made, number).values())[:2] for number in range(made.cases)]
    assert found == [
        (own, period),
        (own + 0.25, period),
        (own + 0.75, period),
        (own, 5900.0),
        (own, 6100.0),
        (own, 6200.0),
    ]
    assert case_scenario(made, 0).digest() == made.base.digest()


def test_the_seed_of_a_case_is_its_own_unless_the_campaign_says_otherwise() -> None:
    own = column(campaign(runs=1000), "seed")
    assert len(set(own)) == 1000
    assert own[7] == case_seed(1, 7)
    assert set(column(campaign(runs=5, same_noise=True, set={"seed": 12}), "seed")) == {12}
    dispersed = campaign(runs=50, dispersions=[of("seed", {"kind": "choice", "values": [3, 4]})])
    assert set(column(dispersed, "seed")) == {3, 4}


def test_a_wildcard_has_an_independent_draw_for_each_field_and_a_shared_one_has_the_same() -> None:
    path = "satellites[*].position_error[*]"
    apart = case_values(campaign(runs=1, dispersions=[of(path, UNIT)]), 0)
    alike = case_values(campaign(runs=1, dispersions=[of(path, UNIT, shared=True)]), 0)
    assert len(apart) == len(alike) == 10
    assert len(set(apart.values())) == 10
    assert len(set(alike.values())) == 2


def test_a_value_replaces_is_added_or_multiplies() -> None:
    exact = {"kind": "uniform", "low": 3.0, "high": 3.0}
    given = {}
    for applied in ("replace", "add", "scale"):
        made = campaign(runs=1, dispersions=[of("satellites[1].arc_length", exact, applied=applied)])
        given[applied] = case_scenario(made, 0).satellites[1].arc_length
    assert given == {"replace": 3.0, "add": 30003.0, "scale": 90000.0}


def test_only_whole_numbers_are_rounded() -> None:
    wide = {"kind": "uniform", "low": 0.0, "high": 20.0}
    made = campaign(runs=200, dispersions=[of("tolerated_losses", wide), of("satellites[0].scale", wide)])
    whole = column(made, "tolerated_losses")
    assert all(isinstance(case_values(made, number)["tolerated_losses"], int) for number in range(200))
    assert set(whole) == set(range(21))
    assert not any(value.is_integer() for value in column(made, "satellites[0].scale"))


def test_what_satellites_inherit_is_dispersed_one_by_one() -> None:
    path = "satellites[*].controller.boundary_layer[*]"
    scale = {"kind": "uniform", "low": 0.5, "high": 1.5}
    made = campaign(runs=1, dispersions=[of(path, scale, applied="scale")])
    flown = case_scenario(made, 0)
    layers = [flown.satellite(index).controller.boundary_layer for index in range(3)]  # type: ignore[union-attr]
    assert len(set(np.array(layers).ravel())) == 9
    for index in range(3):
        other = flown.satellite(index).controller.model_copy(update={"boundary_layer": (0.1, 0.1, 0.1)})  # type: ignore[union-attr]
        assert other == made.base.satellite(index).controller


def test_chosen_angles_in_degrees_are_numbers_in_radians() -> None:
    path = "satellite_defaults.thruster.pointing_error"
    made = campaign(
        "thruster_limited",
        runs=20,
        dispersions=[of(path, {"kind": "choice", "values": ["2 deg", "10 deg", 0.5]})],
    )
    found = {case_values(made, number)[path] for number in range(20)}
    assert found == {math.radians(2.0), math.radians(10.0), 0.5}
    assert columns_of(made).changes[path] == "number"
    assert case_scenario(made, 0).satellite(0).thruster.pointing_error in found


def test_text_and_truth_values_are_chosen() -> None:
    made = campaign(
        runs=100,
        dispersions=[
            of("consensus.neighbour_values", {"kind": "choice", "values": ["hold", "extrapolate"]}),
            of("orbit.allow_below_surface", {"kind": "choice", "values": [True, False], "weights": [3, 1]}),
        ],
    )
    assert {case_scenario(made, n).consensus.neighbour_values for n in range(20)} == {"hold", "extrapolate"}  # type: ignore[attr-defined]
    assert 60 <= column(made, "orbit.allow_below_surface").sum() <= 88


def test_a_case_keeps_the_files_that_its_scenario_names(tmp_path: Path) -> None:
    made = campaign("attitude_cape_canaveral", runs=2, dispersions=[of("satellites[0].arc_length", UNIT)])
    flown = case_scenario(made, 1)
    assert (
        flown.with_({"satellites[0].arc_length": 0.0, "seed": 0}).digest()
        == made.base.with_({"satellites[0].arc_length": 0.0, "seed": 0}).digest()
    )


def test_a_case_is_what_settings_make_of_the_scenario() -> None:
    made = campaign(
        runs=5,
        dispersions=[
            of("satellites[*].arc_length", UNIT),
            of("satellites[*].position_error[*]", UNIT, applied="add"),
            of("timing.step", {"kind": "choice", "values": [0.5, 1.0, 2.0]}),
        ],
    )
    for number in range(5):
        assert case_scenario(made, number) == made.base.with_(case_values(made, number))


@pytest.mark.parametrize("number", [-1, 5])
def test_there_is_no_case_outside_the_campaign(number: int) -> None:
    with pytest.raises(IndexError, match="has 0 to 4"):
        case_values(campaign(runs=5), number)
