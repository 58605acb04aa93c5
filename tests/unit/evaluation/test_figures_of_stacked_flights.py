# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of runs that are flown as one formation are those of each run flown alone."""

from dataclasses import replace

import numpy as np
import pytest

from flights import shipped
from satform.common.spec import specs
from satform.evaluation.evaluate import judge
from satform.evaluation.flight_figures import FlightFigures
from satform.flight.compile import compile_scenario
from satform.flight.simulate import simulate
from satform.flight.stacked_runs import fly_stacked
from satform.record.flight_block import FlightBlock
from satform.record.reducer import FlightShape
from satform.record.series import DecimatedSeries
from satform.scenario import Scenario
from satform.scenario.expectation import ComputedFrom, Expectation

RUNS = 3
STEPS = 60
SHIPPED = ("triangle", "noisy_navigation", "thruster_limited", "formation_pointing")

FIELDS = {
    "level": 50.0,
    "within": 500.0,
    "fraction": 0.9,
    "nominal_rate": 80.0,
    "axis": "y",
    "limit": "torque",
    "epoch": "2020-06-01T12:00:00Z",
    "chief_longitude": 0.4,
    "combined_radius": 10e3,
    "orbits": 0.1,
}
CHOICES = {
    "response_time": ({"quantity": "x", "event": "peak"}, {"quantity": "y", "event": "settled", "band": 0.9}),
    "overshoot": ({"quantity": "x"}, {"quantity": "range"}),
    "attitude_settling": ({"quantity": "pointing_error", "level": 3.0}, {"quantity": "panel_to_sun"}),
    "collision_probability": ({}, {"standard_deviation": 5e3}),
    "control": ({"statistic": "mean"}, {"statistic": "minimum"}, {"statistic": "maximum"}),
    "navigation_error": ({"statistic": "rms"}, {"statistic": "maximum"}),
    "estimation_error": ({"statistic": "rms"}, {"statistic": "maximum"}),
    "nees": ({"statistic": "mean"}, {"statistic": "maximum"}),
    "nis": ({"statistic": "mean"}, {"statistic": "maximum"}),
    "distance": ({"statistic": "minimum"}, {"statistic": "maximum"}),
    "range": ({"statistic": "minimum"}, {"statistic": "maximum"}),
}


def expectations(scenario: Scenario) -> list[Expectation]:
    """Of every kind whose figure is made of blocks, over the whole flight and from some time on."""
    names = [own.name for own in scenario.satellites]
    found = []
    for kind, spec in sorted(specs("satform.metrics").items()):
        # Campaigns fly cases with a figure of whole records one by one.
        if spec.computed_from is not ComputedFrom.BLOCKS or (
            kind.startswith("tetrahedron") and len(names) != 4
        ):
            continue
        fields = {name: value for name, value in FIELDS.items() if name in spec.model_fields}
        if kind == "distance" or kind.startswith("pass"):
            fields["satellites"] = tuple(names[-2:])
        if kind == "rejoin_time":
            fields["satellite"] = names[0]
        starts = ({}, {"after": 7.5 * scenario.timing.step}) if "after" in spec.model_fields else ({},)
        found += [
            spec(below=1.0, source="none", **{**fields, **choice, **start})
            for choice in CHOICES.get(kind, ({},))
            for start in starts
        ]
    return found


@pytest.mark.parametrize("name", SHIPPED)
def test_figures_and_series_of_runs_flown_as_one_are_those_of_each_alone(name: str) -> None:
    step = shipped(name).timing.step
    base = shipped(name, f"timing.duration={STEPS * step}", "expect=[]")
    runs = [
        base.with_({"seed": 5 + run, "satellites[*].position_error": [3.0 * run, 1.0, 0.5 * run]})
        for run in range(RUNS)
    ]
    records = [simulate(run) for run in runs]
    expected = expectations(base)
    settings = tuple(run.setting for run in runs)
    figures = FlightFigures(expected, replace(FlightShape.of(records[0]), settings=settings))
    series = DecimatedSeries("tracking_error", 7)

    def observe(block: FlightBlock) -> None:
        figures.update(block)
        series.update(block)

    plans = [compile_scenario(run) for run in runs]
    assert fly_stacked(plans, observe, figures.needs | series.needs, block_steps=7) == {}
    judged = [
        judge(expected, record, setting=setting) for record, setting in zip(records, settings, strict=True)
    ]
    alone = np.array([[verdict.figure for verdict in verdicts] for verdicts in judged])
    assert np.array_equal(figures.figures().T, alone, equal_nan=True)
    # Most figures are known, and differ from run to run.
    known = ~np.isnan(alone).any(axis=0)
    assert np.count_nonzero(known) > 20
    assert np.count_nonzero(np.ptp(alone[:, known], axis=0)) > 10
    assert np.array_equal(series.series(), [record.tracking_error[::7] for record in records])
