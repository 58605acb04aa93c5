# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0

"""Small formations that tests fly: satellites on a circle of the orbital plane."""

from typing import Any

from satform.scenario import Scenario

RADIUS = 1000.0
RATE = 2.0
GAINS = {"tracking_gain": 0.05, "coupling_gain": 2.5e-3, "rate_gain": 0.05}

CIRCLE = {"kind": "circle", "radius": RADIUS, "normal": [0.0, 0.0, 1.0], "direction": [1.0, 0.0, 0.0]}


def formation(satellites: list[dict[str, Any]], duration: float, **other: Any) -> Scenario:
    """Satellites on a circle of the orbital plane, counter-clockwise from the radial direction."""
    data: dict[str, Any] = {
        "name": "test",
        "title": "A test",
        "text": "Flown by a test.",
        "orbit": {"period": 6000.0},
        "timing": {"step": 0.5, "duration": duration},
        "dynamics": {"kind": "cw"},
        "graph": {"kind": "complete"},
        "consensus": {"kind": "arc_length", **GAINS, **other.pop("consensus", {})},
        "nominal_motion": {"rate": RATE},
        "satellite_defaults": {
            "curve": CIRCLE,
            "controller": {"kind": "sliding_mode", "boundary_layer": 0.1, **other.pop("controller", {})},
        },
        "satellites": [{"name": f"sat{i + 1}", **fields} for i, fields in enumerate(satellites)],
        **other,
    }
    return Scenario.model_validate(data)
