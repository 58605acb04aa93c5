# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Style of all figures: colours, units, axes, decimation of long series."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from satform.numeric.elementwise import Array

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Distinguishable with any colour vision (Okabe & Ito 2008)."""

BLUE, RED = _COLOURS[:2]

INK = "#222222"
FAINT = "#8a8f98"
_MOST_NAMES = 12
"""A legend names all of at most so many satellites."""

_BINS = 1500
_DOTS_PER_INCH = 150

STYLE: Any = {
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 10,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e3e6ea",
    "grid.linewidth": 0.8,
    "xtick.color": INK,
    "ytick.color": INK,
    "text.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.4,
    "font.size": 10,
    # Text stays text, which can be searched and edited.
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}


@dataclass(frozen=True)
class Unit:
    """A unit of an axis.

    Attributes:
        name: as it is printed.
        size: of one of it in SI.
    """

    name: str
    size: float


_FARTHEST = 1e30
"""Largest coordinate that is drawn, m: larger ones do not fit into single precision."""


def length_unit(lengths: Array) -> Unit:
    """Kilometres where some length reaches two of them, else metres."""
    known = lengths[np.isfinite(lengths)]
    return Unit("km", 1e3) if float(np.max(np.abs(known), initial=0.0)) >= 2e3 else Unit("m", 1.0)


def drawable(positions: Array) -> Array:
    """Positions in m, NaN where they are not finite or larger than what is drawn."""
    return np.where(np.abs(positions) < _FARTHEST, positions, np.nan)


def time_unit(duration: float) -> Unit:
    """The largest unit of which a flight lasts several: days, hours, minutes or seconds."""
    units = (Unit("d", 86_400.0), Unit("h", 3600.0), Unit("min", 60.0))
    several = (3 * 86_400.0, 6 * 3600.0, 3600.0)
    fitting = (unit for unit, least in zip(units, several, strict=True) if duration >= least)
    return next(fitting, Unit("s", 1.0))


def colours(count: int) -> list[Any]:
    """A colour for each satellite."""
    if count <= len(_COLOURS):
        return list(_COLOURS[:count])
    return [mpl.colormaps["viridis"](value) for value in np.linspace(0.0, 0.92, count)]


def labels(satellites: Sequence[str]) -> list[str | None]:
    """The name of each satellite for the legend: of all up to twelve, else of the first, middle and last."""
    last = len(satellites) - 1
    if last < _MOST_NAMES:
        return list(satellites)
    named = (0, last // 2, last)
    return [name if column in named else None for column, name in enumerate(satellites)]


def figure(width: float, height: float) -> Figure:
    """An empty picture.

    Args:
        width: in inches.
        height: in inches.
    """
    return Figure(figsize=(width, height), dpi=_DOTS_PER_INCH, layout="constrained")


def thinned(time: Array, values: Array) -> tuple[Array, Array]:
    """A long series of magnitudes by the largest of each short stretch, which keeps every peak and long gaps.

    Args:
        time: s, shape (K,).
        values: shape (K, N).

    Returns:
        Times and values of at most 1500 stretches.
    """
    stride = -(-len(time) // _BINS)
    if stride <= 1:
        return time, values
    starts = np.arange(0, len(time), stride)
    return time[starts], np.fmax.reduceat(values, starts, axis=0)


def axes_or_new(axes: Axes | None) -> Axes:
    """The axes to draw on; those of a new figure of pyplot where none are given."""
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt  # noqa: PLC0415 - reports are drawn without it, and without a display

    with mpl.rc_context(STYLE):
        return plt.subplots(figsize=(9.0, 4.6), layout="constrained")[1]
