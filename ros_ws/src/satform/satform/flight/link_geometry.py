# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Body axes of satellites in the chief's frame, in which the directions of links are expressed."""

from collections.abc import Sequence

import numpy as np

from satform.attitude.ground_pointing import CircularOrbit
from satform.numeric.elementwise import Array, dot, joined
from satform.numeric.modified_rodrigues import direction_cosines
from satform.orbits.frames import lvlh_frame


def body_axes(mrp: Array | None, orbits: Sequence[CircularOrbit | None], time: Array) -> Array | None:
    """Body axes of each satellite; those of a satellite without attitude are the axes of LVLH.

    Args:
        mrp: modified Rodrigues parameters, inertial to body, shape (..., N, 3); None where nobody has any.
        orbits: N, the chief's orbit in the inertial axes of each satellite's attitude; None without attitude.
        time: simulated, s, shape (...).

    Returns:
        Rows are the body axes in LVLH, shape (..., N, 3, 3); None where nobody has an attitude.
    """
    if mrp is None or all(orbit is None for orbit in orbits):
        return None
    found = np.empty((*np.shape(time), len(orbits), 3, 3))
    for index, orbit in enumerate(orbits):
        if orbit is None:
            found[..., index, :, :] = np.eye(3)
            continue
        chief = orbit.position(time)
        frame = lvlh_frame(chief.value, chief.rate)
        axes = (frame.radial, frame.along_track, frame.normal)
        body = direction_cosines(mrp[..., index, :])
        for row in range(3):
            found[..., index, row, :] = joined(*(dot(body[..., row, :], axis) for axis in axes))
    return found
