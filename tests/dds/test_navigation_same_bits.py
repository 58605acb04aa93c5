# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flights by sensors of every kind are the same over DDS as in process, with losses, lossy links, fusion."""

from pathlib import Path
from typing import Any

import pytest

from satform.bag.reader import read_bag
from satform.common.spec import specs
from satform.flight.simulate import simulate
from satform.scenario import Scenario
from satform_bringup.supervisor.run import fly

pytestmark = pytest.mark.unmeasured

RANGES = {"targets": ["sat1"], "range_noise": 0.1, "range_rate_noise": 1e-3}
SENSORS: dict[str, list[dict[str, Any]]] = {
    "sat1": [
        {"kind": "gnss", "velocity_noise": 0.05, "latency": 0.0},
        {"kind": "laser_ranging", "targets": ["sat2", "sat3"], "range_noise": 0.05, "outages": []},
    ],
    "sat2": [
        {"kind": "differential_gnss", "reference": "sat1", "period": 2.0},
        {"kind": "radio_ranging", **RANGES, "outages": [{"begin": 5.0, "end": 8.0}]},
    ],
    "sat3": [{"kind": "bearing_camera", "targets": ["sat1", "sat2"], "angle_noise": 1e-4}, {"kind": "gnss"}],
}


def scenario(duration: float, exchange: str, **other: Any) -> Scenario:
    """Three satellites with different sensors about a chief whose orbit and date are known."""
    satellites = [
        {"name": name, "arc_length": 400.0 * number, "sensors": sensors}
        for number, (name, sensors) in enumerate(SENSORS.items())
    ]
    chief = {
        "kind": "keplerian",
        "epoch": "2026-03-20T12:00:00Z",
        "semi_major_axis": 7.0e6,
        "eccentricity": 0.001,
        "inclination": "50 deg",
        "right_ascension": 0.0,
        "argument_of_perigee": 0.0,
        "mean_anomaly": 0.0,
    }
    return Scenario.model_validate(
        {
            "name": "sensors",
            "orbit": {"chief": chief},
            "timing": {"step": 1.0, "duration": duration},
            "dynamics": {"kind": "cw"},
            "graph": {"kind": "complete"},
            "consensus": {
                "kind": "arc_length",
                "tracking_gain": 0.05,
                "coupling_gain": 2.5e-3,
                "rate_gain": 0.05,
            },
            "nominal_motion": {"period": 6000.0},
            "satellite_defaults": {
                "curve": {
                    "kind": "circle",
                    "radius": 1000.0,
                    "normal": [0.0, 0.0, 1.0],
                    "direction": [1.0, 0.0, 0.0],
                },
                "controller": {"kind": "lqr", "position_weight": 1e-4, "velocity_weight": 0.0},
                "navigation": {
                    "kind": "extended",
                    "acceleration_density": 1e-8,
                    "neighbour_acceleration_density": 1e-4,
                    "initial_position_error": 1.0,
                    "initial_velocity_error": 0.01,
                    "exchange": exchange,
                },
            },
            "satellites": satellites,
            **other,
        }
    )


LOST = [{"kind": "satellite_lost", "satellite": "sat2", "at": 6.0, "rejoin_at": 12.0}]
FLIGHTS = {
    "fused by covariance intersection": ("covariance_intersection", {}),
    "consensus on information, lossy links": (
        "information_consensus",
        {"links": {"default": {"loss": 0.3, "delay": 1.0}}},
    ),
    "lost and rejoined": ("covariance_intersection", {"faults": LOST, "checkpoint_period": 3.0}),
    "not exchanged, with standard messages": ("none", {"publish_sensor_messages": True}),
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_flight_by_sensors_has_the_bits_of_the_in_process_run(name: str, tmp_path: Path) -> None:
    exchange, other = FLIGHTS[name]
    flown = scenario(20.0, exchange, **other)
    flight = fly(flown, tmp_path, record=True, progress=lambda _done, _all: None)
    assert not flight.lost, flight.losses
    assert flight.bag is not None
    bag = read_bag(flight.bag)
    assert bag.complete
    assert bag.record.navigation is not None
    assert simulate(flown).differences(bag.record) == []


def test_the_flights_have_a_sensor_of_every_kind_of_motion() -> None:
    flown = {sensor["kind"] for sensors in SENSORS.values() for sensor in sensors}
    assert set(specs("satform.sensors")) - flown <= {"gyro", "star_tracker"}
