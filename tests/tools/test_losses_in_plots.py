# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Summary, prediction and pictures of flights in which satellites are lost or the graph changes."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formations import formation
from satform.evaluation.arc_lengths import arc_length_spread
from satform.flight.simulate import simulate
from satform.plot import prediction
from satform.plot.style import thinned
from satform.record.flight_record import FlightRecord
from satform.scenario import Scenario
from satform_tools.report.plots.figures import draw
from satform_tools.run.flight_summary import summarise

LOST = {"kind": "satellite_lost", "satellite": "sat2", "at": 5.0}


def three(**other: Any) -> Scenario:
    satellites = [{"arc_length": 100.0 * i, "position_error": [2.0 * i, 1.0, -1.0]} for i in range(3)]
    return formation(satellites, 20.0, **other)


def flown(**fault: Any) -> tuple[Scenario, FlightRecord]:
    scenario = three(faults=[{**LOST, **fault}])
    return scenario, simulate(scenario)


def test_the_summary_of_a_lost_satellite_is_of_the_steps_in_which_it_flew() -> None:
    _, record = flown(rejoin_at=17.0, memory="plan")
    first, lost, _ = summarise(record).satellites
    assert (first.absent, lost.absent) == (0, 24)
    # The last fifth is from 16 s on; it is back from 17 s on.
    assert lost.final_error == np.max(record.tracking_error[34:, 1])
    assert first.final_error == np.max(record.tracking_error[32:, 0])
    assert math.isfinite(summarise(record).spread_at_end)


def test_of_a_satellite_that_never_comes_back_nothing_is_said_of_the_end() -> None:
    _, record = flown()
    summary = summarise(record)
    assert math.isnan(summary.satellites[1].final_error)
    assert summary.satellites[1].delta_v == pytest.approx(np.sum(record.effort[:10, 1]), rel=1e-12)
    assert summary.spread_at_end == pytest.approx(np.ptp(record.arc_length[-1, [0, 2]]))


def test_every_picture_of_a_flight_with_a_loss_is_drawn_without_complaint(tmp_path: Path) -> None:
    scenario, record = flown(rejoin_at=12.0, memory="plan")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        files = draw(scenario, record, tmp_path)
    assert all(file.stat().st_size > 1000 for file in files)


def test_thinning_keeps_the_peak_beside_a_gap() -> None:
    values = np.full((6000, 1), np.nan)
    values[2] = 7.0
    time = np.arange(6000.0)
    _, thin = thinned(time, values)
    assert thin[0, 0] == 7.0
    assert np.isnan(thin[1:]).all()


def test_the_prediction_follows_a_graph_that_changes() -> None:
    gentle = {"tracking_gain": 1e-3, "coupling_gain": 1e-6, "rate_gain": 1e-3}
    satellites = [{"arc_length": 100.0 * i} for i in range(3)]
    changes = [{"at": 200.0, "graph": {"kind": "none"}}, {"at": 600.0, "graph": {"kind": "line"}}]
    scenario = formation(satellites, 1000.0, consensus=gentle, graph_schedule=changes)
    record = simulate(scenario)
    moments = np.linspace(0.0, 1000.0, 101)
    expected = prediction.arc_length_spread(scenario, moments)
    assert expected is not None
    assert arc_length_spread(record)[::20] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    "fields",
    [
        {"links": {"default": {"loss": 0.1}}},
        {"faults": [LOST]},
        {"faults": [{"kind": "byzantine", "satellite": "sat1", "at": 1.0}]},
        {"faults": [{"kind": "clock_offset", "satellite": "sat1", "at": 1.0, "offset": 1.0}]},
    ],
)
def test_nothing_is_predicted_where_the_linear_law_does_not_hold(fields: dict[str, Any]) -> None:
    moments = np.linspace(0.0, 20.0, 11)
    assert prediction.arc_length_spread(three(), moments) is not None
    assert prediction.arc_length_spread(three(**fields), moments) is None
