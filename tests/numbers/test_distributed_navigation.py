# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Distributed navigation stays consistent with lossy and late links, a changing graph, a lost satellite."""

from typing import Any

import numpy as np
import pytest

from flights import shortened
from satform.flight.simulate import simulate
from satform.record.flight_record import FlightRecord

pytestmark = pytest.mark.unmeasured

DURATION, STEP = 1800.0, 10.0
BOTH = [["chief", "deputy"], ["deputy", "chief"]]


def flown(**changes: Any) -> FlightRecord:
    """The pair with GNSS under disturbances, without the outage."""
    scenario = shortened("gnss_differential_pair", DURATION)
    links = {"default": {"loss": 0.5, "delay": 20.0, "jitter": 10.0}}
    return simulate(scenario.with_({"links": links, "consensus.neighbour_timeout": 600.0, **changes}))


def relative_error(record: FlightRecord, observer: int) -> np.ndarray:
    """Length of the error of the deputy's position relative to the chief, as one of them estimates it, m."""
    assert record.navigation is not None
    mean = record.navigation.mean[:, observer].reshape(record.steps, 2, 6)[..., :3]
    true = record.position[: record.steps]
    return np.asarray(np.linalg.norm(mean[:, 1] - mean[:, 0] - true[:, 1] + true[:, 0], axis=-1))


def test_over_half_the_messages_and_a_changing_graph_the_chief_knows_the_deputy() -> None:
    schedule = [{"at": 600.0, "remove": BOTH}, {"at": 900.0, "add": BOTH}]
    record = flown(graph_schedule=schedule)
    error = relative_error(record, 0)
    # Without an edge the differential readings do not reach the chief.
    apart, together = error[85:90], np.concatenate((error[40:60], error[100:]))
    assert np.sqrt(np.mean(together**2)) < 0.2
    assert apart.min() > np.median(together)
    # Mean 6 when consistent; less, as consensus on information is conservative.
    assert np.nanmean(record.estimation_error_squared[60:]) < 7.0


def test_a_lost_satellite_stays_part_of_the_estimate() -> None:
    at = 600
    record = flown(faults=[{"kind": "satellite_lost", "satellite": "deputy", "at": float(at)}])
    error = relative_error(record, 0)
    assert np.isfinite(error).all()
    # Its acceleration is that of the disturbance alone: 0.57 m in 1000 s by the Riccati equation.
    assert error[at // 10 + 100] < 3.0 * 0.57 + 1.0
    assert np.nanmean(record.estimation_error_squared[60:, 0]) < 7.0
