# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a campaign for papers and documentation."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from satform.plot.style import BLUE, FAINT, INK, RED, STYLE, figure, time_unit
from satform_tools.campaign.chart_content import (
    drawn_pairs,
    is_near,
    is_wide,
    members_text,
    scatter_of,
    with_unit,
)
from satform_tools.campaign.envelopes import Envelope
from satform_tools.campaign.report_statistics import Correlation, Histogram, RateByValue, ReportStatistics
from satform_tools.campaign.summary import interval_text

_COLUMNS = 3
_MOST_PANELS = 12
_PANEL = (4.6, 3.2)
"""Width and height of a panel, inches."""


def draw(statistics: ReportStatistics, folder: Path, form: str) -> list[Path]:
    """Draw the figures of a campaign: distributions, envelopes, success by value, dependences.

    Args:
        statistics: of the campaign.
        folder: existing; files of the same name are replaced.
        form: of the files: png, svg or pdf.

    Returns:
        The files.

    Raises:
        OSError: a file cannot be written.
    """
    files = []
    with mpl.rc_context(STYLE):
        for name, panels in _figures(statistics).items():
            if panels:
                file = folder / f"{name}.{form}"
                tiled(panels[:_MOST_PANELS]).savefig(file)
                files.append(file)
    return files


def overview(statistics: ReportStatistics) -> Figure:
    """What came of a campaign in one figure: success by value, envelopes, distributions, dependences."""
    found = _figures(statistics)
    panels = [*found["success"][:2], *found["envelopes"][:2], *found["figures"][:3]]
    panels += found["dependences"][: max(1, 6 - len(panels))]
    drawn = tiled(panels[:6])
    summary = statistics.summary
    rate, low, high = (100.0 * value for value in summary.rate)
    interval = interval_text(low, high, ".3g")
    drawn.suptitle(
        f"{summary.campaign.title}\n{summary.succeeded} of {summary.flown} cases succeed: "
        f"{rate:.3g} %{f' ({interval} %)' if interval else ''}",
        fontsize=12,
        color=INK,
    )
    return drawn


def tiled(panels: list[Callable[[Axes], None]]) -> Figure:
    """Panels side by side, three in a row."""
    columns = min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    drawn = figure(_PANEL[0] * columns, _PANEL[1] * rows)
    axes = np.atleast_1d(drawn.subplots(rows, columns, squeeze=False)).ravel()
    for panel, own in zip(panels, axes, strict=False):
        panel(own)
    for own in axes[len(panels) :]:
        own.set_axis_off()
    return drawn


def _figures(statistics: ReportStatistics) -> dict[str, list[Callable[[Axes], None]]]:
    """Panels of each figure by its name."""
    return {
        "success": [partial(rate_by_value, found) for found in statistics.rates],
        "envelopes": [partial(envelope, found) for found in statistics.envelopes],
        "figures": [partial(histogram, found) for found in most_judged(statistics)],
        "dependences": [partial(dependence, pair, statistics) for pair in drawn_pairs(statistics)],
    }


def most_judged(statistics: ReportStatistics) -> list[Histogram]:
    """Distributions of the figures: first those with limits, then others, then those without any spread."""
    return sorted(statistics.histograms, key=lambda found: (len(found.counts) == 1, not found.limits))


def rate_by_value(found: RateByValue, axes: Axes) -> None:
    """Draw success rate and its interval over the values of an input."""
    rate, low, high = 100.0 * found.rates.T
    numeric = all(isinstance(value, int | float) for value in found.values)
    values = np.array(found.values if numeric else range(len(found.values)), dtype=np.float64)
    bars = None if np.any(np.isnan(low)) else (rate - low, high - rate)
    axes.errorbar(values, rate, bars, color=BLUE, marker="o", ms=4, lw=1.2, elinewidth=1)
    if not numeric:
        axes.set_xticks(values, [str(value) for value in found.values])
    elif is_wide(values):
        axes.set_xscale("log")
    axes.set_ylim(-3.0, 103.0)
    axes.set_xlabel(_short(found.input.name))
    axes.set_ylabel("success rate [%]")


def histogram(found: Histogram, axes: Axes) -> None:
    """Draw the distribution of a figure, its limits, and the part of failed cases."""
    axes.stairs(found.counts, found.edges, fill=True, color=BLUE, alpha=0.35, label="all cases")
    axes.stairs(found.counts, found.edges, color=BLUE)
    if np.any(found.failed):
        axes.stairs(found.failed, found.edges, fill=True, color=RED, alpha=0.6, label="failed")
        axes.legend(loc="best")
    if found.logarithmic:
        axes.set_xscale("log")
    for limit in found.limits:
        if is_near(limit.value, found):
            axes.axvline(limit.value, color=RED, ls="--", lw=1.2)
    axes.set_xlabel(_short(with_unit(found.figure.name, found.figure.unit)))
    axes.set_ylabel("cases")
    if found.outside:
        axes.set_title(f"{found.outside} more cases outside", fontsize=8, fontweight="normal", color=FAINT)


def envelope(found: Envelope, axes: Axes) -> None:
    """Draw the percentiles of a retained quantity over time."""
    unit = time_unit(float(found.time[-1]))
    time = found.time / unit.size
    low, middle, high = found.percentiles.T
    axes.fill_between(time, low, high, color=BLUE, alpha=0.25, lw=0, label="5 to 95 %")
    axes.plot(time, middle, color=BLUE, label="median")
    if is_wide(found.percentiles):
        axes.set_yscale("log")
    axes.set_xlim(time[0], time[-1])
    axes.set_xlabel(f"time [{unit.name}]")
    axes.set_ylabel(_short(with_unit(found.quantity, found.unit)))
    axes.set_title(members_text(found), fontsize=8, fontweight="normal", color=FAINT)
    axes.legend(loc="best")


def dependence(pair: Correlation, statistics: ReportStatistics, axes: Axes) -> None:
    """Draw a figure over an input, case by case."""
    _, first, second, success = scatter_of(pair, statistics)
    axes.scatter(first[success], second[success], s=6, color=BLUE, alpha=0.6, lw=0)
    axes.scatter(first[~success], second[~success], s=8, color=RED, alpha=0.8, lw=0)
    if is_wide(first):
        axes.set_xscale("log")
    if is_wide(second):
        axes.set_yscale("log")
    unit = statistics.summary.campaign.figure_units.get(pair.figure, "")
    axes.set_xlabel(_short(pair.input))
    axes.set_ylabel(_short(with_unit(pair.figure, unit)))
    axes.set_title(f"ρ = {pair.coefficient:.2f}, {pair.cases} cases", fontsize=9, fontweight="normal")


def _short(text: str) -> str:
    """Text that fits a panel and has no signs of formulas."""
    text = text.replace("$", r"\$")
    return text if len(text) <= 48 else f"{text[:30]}…{text[-16:]}"
