# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A relative orbit that is a circle for an observer on the Earth below."""

from typing import Literal

import numpy as np

from satform.common.spec import Positive
from satform.orbits.curve_specs import CurveSpec
from satform.orbits.ellipse import Ellipse, ellipse


class ProjectedCircleSpec(CurveSpec):
    kind: Literal["projected_circle"] = "projected_circle"
    radius: Positive
    """Radius of the circle in the plane along the track and across it, m."""
    descending: bool = False
    """Whether the plane of the orbit is tilted the other way."""

    def build(self) -> Ellipse:
        # A curve of another shape is a class with the methods of satform.orbits.curve.Curve.
        across = -self.radius if self.descending else self.radius
        along = np.array([0.0, self.radius, 0.0])
        return ellipse(np.zeros(3), along, np.array([0.5 * self.radius, 0.0, across]))
