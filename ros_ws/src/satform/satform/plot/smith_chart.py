# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Smith chart of a load on a line, with the two stubs that match it."""

import cmath
import math

import numpy as np
from matplotlib.axes import Axes

from satform.communication.line_matching import Line, Stub, impedance_text
from satform.plot.style import BLUE, FAINT, INK, RED, axes_or_new

RESISTANCES = (0.0, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Normalised resistances whose circles are drawn."""

REACTANCES = (0.2, 0.5, 1.0, 2.0, 5.0)
"""Normalised reactances whose arcs are drawn, of both signs."""

_MATCHABLE = 1e-9
"""Difference of the reflection's magnitude from 0 and from 1, up to which no stub is drawn."""

_GRID = "#c9ced6"
_GREEN = "#009E73"
_POINTS = 181


def smith_chart(line: Line, axes: Axes | None = None) -> Axes:
    """The plane of the reflection coefficient: load, way along the line to its input, and stubs.

    Args:
        line: with its load.
        axes: to draw on; new ones when left out.
    """
    axes = axes_or_new(axes)
    axes.set_aspect("equal")
    axes.axis("off")
    _draw_grid(axes)
    load, magnitude = line.reflection, abs(line.reflection)
    angles = np.linspace(0.0, math.tau, _POINTS)
    axes.plot(magnitude * np.cos(angles), magnitude * np.sin(angles), "--", color=FAINT, linewidth=1.0)
    # More than half a wavelength goes around the whole circle.
    shown = np.linspace(0.0, min(line.length, 0.5), _POINTS)
    way = load * np.exp(-2j * math.tau * (line.length - min(line.length, 0.5) + shown))
    axes.plot(way.real, way.imag, color=BLUE, linewidth=2.2, label="line from the load to its input")
    entry = line.reflection_at(line.length)
    for point, colour, name in (
        (load, RED, f"load {impedance_text(line.load)} ohm"),
        (entry, BLUE, f"input {impedance_text(line.input_impedance)} ohm"),
    ):
        axes.plot(point.real, point.imag, "o", color=colour, markersize=8, label=name)
    if _MATCHABLE < magnitude < 1.0 - _MATCHABLE:
        axes.plot(
            -0.5 + 0.5 * np.cos(angles),
            0.5 * np.sin(angles),
            color=_GREEN,
            linewidth=1.2,
            label="conductance 1",
        )
        for number, stub in enumerate(line.stubs(), start=1):
            _draw_stub(axes, line, stub, number)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2)
    return axes


def _draw_stub(axes: Axes, line: Line, stub: Stub, number: int) -> None:
    """The place of a stub on the circle, and the way on which its susceptance leads to the centre."""
    conductance = np.linspace(0.0, 1.0, _POINTS)
    admittance = 1.0 + 1j * stub.susceptance * (conductance - 1.0)
    way = (1.0 - admittance) / (1.0 + admittance)
    axes.plot(way.real, way.imag, color=_GREEN, linewidth=2.2)
    point = line.reflection_at(stub.position)
    name = f"stub {number}: {stub.position:.4f} wavelengths from the load"
    axes.plot(point.real, point.imag, "s", color=_GREEN, markersize=7, label=name)
    axes.annotate(str(number), (point.real, point.imag), xytext=(6, 6), textcoords="offset points", color=INK)


def _draw_grid(axes: Axes) -> None:
    """Circles of constant resistance and arcs of constant reactance (Pozar, section 2.4)."""
    angles = np.linspace(0.0, math.tau, _POINTS)
    for resistance in RESISTANCES:
        centre, radius = resistance / (1.0 + resistance), 1.0 / (1.0 + resistance)
        axes.plot(
            centre + radius * np.cos(angles), radius * np.sin(angles), color=_GRID, linewidth=0.8, zorder=0
        )
        axes.annotate(f"{resistance:g}", (centre - radius, 0.0), fontsize=7, color=FAINT)
    axes.plot([-1.0, 1.0], [0.0, 0.0], color=_GRID, linewidth=0.8, zorder=0)
    for reactance in (sign * value for value in REACTANCES for sign in (1.0, -1.0)):
        # Resistances from zero to infinity, spaced evenly along the arc.
        impedance = np.tan(np.linspace(0.0, 0.4999 * math.pi, _POINTS)) + 1j * reactance
        arc = (impedance - 1.0) / (impedance + 1.0)
        axes.plot(arc.real, arc.imag, color=_GRID, linewidth=0.8, zorder=0)
        rim = cmath.rect(1.06, cmath.phase((1j * reactance - 1.0) / (1j * reactance + 1.0)))
        axes.annotate(
            f"{reactance:+g}j", (rim.real, rim.imag), fontsize=7, color=FAINT, ha="center", va="center"
        )
