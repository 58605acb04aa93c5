# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a flight by matplotlib; each function draws on given or new axes and returns them.

The optional dependency `satform[plot]` is needed. Imports `evaluation` and below.
"""

try:
    import matplotlib as _  # noqa: F401
except ImportError:
    raise ImportError("satform.plot needs matplotlib: pip install 'satform[plot]'") from None

from satform.plot.formation import orbits, orbits_3d
from satform.plot.links import delivered_connectivity
from satform.plot.time_series import (
    arc_length_spread,
    control,
    delta_v,
    phases,
    pointing_error,
    sliding_variable,
    tracking_error,
    wheel_torque,
)

__all__ = [
    "arc_length_spread",
    "control",
    "delivered_connectivity",
    "delta_v",
    "orbits",
    "orbits_3d",
    "phases",
    "pointing_error",
    "sliding_variable",
    "tracking_error",
    "wheel_torque",
]
