# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the links of a flight delivered, over time."""

import numpy as np
from matplotlib.axes import Axes

from satform.plot.style import BLUE, axes_or_new, time_unit
from satform.record.flight_record import FlightRecord


def delivered_connectivity(
    record: FlightRecord, axes: Axes | None = None, *, window_length: float = 60.0
) -> Axes:
    """Algebraic connectivity of the graph of the links that delivered a message, in windows.

    Args:
        record: of the flight, which knows its scenario.
        axes: to draw on; new ones when left out.
        window_length: of each window, s; at least one step and at most the flight.

    Raises:
        ValueError: the record does not know its scenario.
    """
    if record.links is None:
        raise ValueError(
            "this record does not know its scenario and so not its links; see satform.with_chief"
        )
    axes, unit = axes_or_new(axes), time_unit(record.steps * record.step)
    window = min(max(1, round(window_length / record.step)), record.steps)
    begins, values = record.links.connectivity(window)
    edges = np.append(begins, begins[-1:] + window) * record.step / unit.size
    axes.stairs(values, edges, baseline=None, color=BLUE)
    axes.set_ylim(bottom=0.0)
    axes.set_title(f"Connectivity of delivered messages, {window * record.step:g} s each")
    axes.set_ylabel("λ₂")
    axes.set_xlabel(f"time [{unit.name}]")
    return axes
