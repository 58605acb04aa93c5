# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The plane in which a flat formation is drawn, the direction of view, and the names in legends."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from satform.plot.style import labels
from satform.plot.viewpoint import plane, viewpoint

TURN = np.linspace(0.0, 2.0 * np.pi, 100)


def flown(*components: Any) -> Any:
    """A record of one satellite with these radial, along-track and cross-track components, m."""
    return SimpleNamespace(position=np.stack(np.broadcast_arrays(*components), axis=-1)[:, None, :])


@pytest.mark.parametrize(
    ("record", "expected"),
    [
        (flown(np.cos(TURN), 2.0 * np.sin(TURN), 0.0), (1, 0)),
        (flown(np.cos(TURN), 2.0 * np.sin(TURN), 0.05 * np.sin(TURN)), (1, 0)),
        (flown(0.0, np.cos(TURN), np.sin(TURN)), (1, 2)),
        (flown(np.cos(TURN), 0.0, np.sin(TURN)), (2, 0)),
        (flown(np.cos(TURN), 2.0 * np.sin(TURN), 0.5 * np.sin(TURN)), None),
        (flown(200.0 * TURN, 0.0, 0.0), (1, 0)),
        (flown(0.0, 0.0, TURN), (1, 2)),
        (flown(0.01 * np.cos(TURN), 100.0 * TURN, 0.01 * np.sin(TURN)), (1, 0)),
        (flown(0.0 * TURN, 0.0, 0.0), (1, 0)),
        (flown(np.nan * TURN, 0.0, 0.0), (1, 0)),
    ],
)
def test_a_flat_formation_is_drawn_in_its_plane(record: Any, expected: tuple[int, int] | None) -> None:
    assert plane(record) == expected


def test_a_circle_is_not_drawn_edge_on() -> None:
    for node in np.linspace(0.0, 2.0 * np.pi, 13):
        for tilt in np.linspace(0.0, np.pi / 2, 7):
            normal = np.array([np.sin(tilt) * np.cos(node), np.sin(tilt) * np.sin(node), np.cos(tilt)])
            first = np.cross(normal, [0.6, 0.0, 0.8])
            first /= np.linalg.norm(first)
            circle = np.outer(np.cos(TURN), first) + np.outer(np.sin(TURN), np.cross(normal, first))
            elevation, azimuth = np.radians(viewpoint(circle))
            camera = (
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            )
            # Ratio of the axes of the ellipse that is seen, 0 if edge-on.
            assert abs(normal @ camera) > 0.25


def test_of_many_satellites_three_are_named() -> None:
    few, many = [f"sat{i}" for i in range(12)], [f"sat{i}" for i in range(1000)]
    assert labels(few) == few
    assert [name for name in labels(many) if name] == ["sat0", "sat499", "sat999"]
