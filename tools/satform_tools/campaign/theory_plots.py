# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of shipped campaigns with flights and theory on the same axes."""

import math
from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure

from satform.campaign.result_files import all_series
from satform.evaluation.stability_borders import lossy_consensus, stability_border
from satform.numeric.elementwise import Array
from satform.plot.style import BLUE, FAINT, INK, RED, figure
from satform_tools.campaign.report_statistics import ReportStatistics

_AGREED = 0.01
"""Part of the disagreement at the start below which satellites agree."""

_LOSSES = 40
_GAINS = 30


def agreement_over_loss(statistics: ReportStatistics) -> Figure:
    """Time after which the phases of a formation agree, over the loss of its links.

    Args:
        statistics: of `lossy_links_sweep`, whose input is the loss, and which retains arc lengths.
    """
    campaign = statistics.summary.campaign
    times = _agreement_times(statistics)
    losses = statistics.sample.inputs[statistics.inputs[0].name]
    of_cases = np.array([times.get(number, math.inf) for number in statistics.sample.numbers.tolist()])
    border = lossy_consensus(campaign.base).largest_loss()
    longest = campaign.base.timing.duration / 3600.0
    drawn = figure(9.0, 5.0)
    axes = drawn.subplots()
    agreed = np.isfinite(of_cases)
    axes.plot(100 * losses[agreed], of_cases[agreed], "o", ms=3.5, alpha=0.5, color=BLUE, label="flights")
    never = np.full(np.count_nonzero(~agreed), 1.03 * longest)
    axes.plot(100 * losses[~agreed], never, "^", ms=5, color=RED, label="flights that do not agree in time")
    axes.plot(
        *_agreement_by_theory(statistics, longest), color=INK, label="theory: root mean square of all flights"
    )
    axes.axvline(
        100 * border, color=FAINT, ls="--", lw=1.2, label=f"border of the mean square, {100 * border:.1f} %"
    )
    axes.set_ylim(0.0, 1.08 * longest)
    axes.set_xlabel("lost messages [%]")
    axes.set_ylabel(f"time to {100 * _AGREED:g} % of the first disagreement [h]")
    axes.set_title(campaign.title)
    axes.legend(loc="upper left")
    return drawn


def stability_over_gains(statistics: ReportStatistics) -> Figure:
    """Which of two parameters make a sampled loop stable, and the border by the theory of the loop.

    Args:
        statistics: of `gain_sweep`, whose inputs are the reaching gain and the boundary layer.
    """
    campaign, sample = statistics.summary.campaign, statistics.sample
    gain, layer = (sample.inputs[found.name] for found in statistics.inputs)
    drawn = figure(9.0, 5.0)
    axes = drawn.subplots()
    for name, colour, marker, rows in (
        ("flights that converge", BLUE, "o", sample.success),
        ("flights that do not", RED, "x", ~sample.success),
    ):
        axes.plot(gain[rows], layer[rows], marker, ms=5, color=colour, ls="", label=name)
    gains = np.linspace(gain.min(), gain.max(), _GAINS)
    # All components of a gain together, as in the campaign.
    first, second = (dispersion.path.removesuffix("[*]") for dispersion in campaign.dispersions)
    borders = []
    for value in gains.tolist():
        scenario = campaign.base.with_({first: value})
        found = stability_border(scenario, second, 0.5 * layer.min(), 2.0 * layer.max(), "tracking")
        borders.append(math.nan if found is None else found)
    axes.plot(gains, borders, color=INK, label="theory: spectral radius of the sampled loop is 1")
    axes.set_yscale("log")
    axes.set_ylim(0.9 * layer.min(), 1.1 * layer.max())
    axes.set_xlabel("reaching gain [1/s]")
    axes.set_ylabel("boundary layer [m/s]")
    axes.set_title(campaign.title)
    axes.legend(loc="lower right", frameon=True)
    return drawn


FIGURES: Mapping[str, Callable[[ReportStatistics], Figure]] = {
    "lossy_links_sweep": agreement_over_loss,
    "gain_sweep": stability_over_gains,
}
"""Figures of campaigns that have one of their own, by name."""


def _agreement_times(statistics: ReportStatistics) -> dict[int, float]:
    """Time from which a case agrees to its end, h; cases that never do are left out."""
    summary = statistics.summary
    campaign = summary.campaign
    wanted = next(series for series in campaign.keep.series if series.quantity == "arc_length")
    every = wanted.every or campaign.base.timing.step
    found = {}
    for number, series in all_series(summary.folder.path, summary.result_files):
        time = _last_above(_disagreement(series["arc_length"]))
        if math.isfinite(time):
            found[number] = time * every / 3600.0
    return found


def _agreement_by_theory(statistics: ReportStatistics, longest: float) -> tuple[Array, Array]:
    """Losses in percent and times in hours by the mean square of all flights; NaN where it takes longer."""
    base = statistics.summary.campaign.base
    theory = lossy_consensus(base)
    period = base.timing.step if base.links is None else base.links.default.period
    messages = round(3600.0 * longest / period)
    phases = np.array([own.arc_length for own in base.satellites])
    losses = np.linspace(0.0, 0.9, _LOSSES)
    times = []
    for loss in losses.tolist():
        disagreement = theory.rms_disagreement(phases, np.zeros(len(phases)), loss, messages)
        times.append(_last_above(disagreement) * period / 3600.0)
    return 100 * losses, np.where(np.isfinite(times), times, math.nan)


def _disagreement(phases: Array) -> Array:
    """Root mean square of phases less their mean, shape (K,), of phases of shape (K, N)."""
    found: Array = np.sqrt(np.mean((phases - phases.mean(axis=1, keepdims=True)) ** 2, axis=1))
    return found


def _last_above(disagreement: Array) -> float:
    """Rows after which the disagreement stays below its part; infinite where it does not.

    No row where there is no disagreement from the start.
    """
    above = np.flatnonzero(disagreement > _AGREED * disagreement[0])
    rows = int(above[-1]) + 1 if len(above) else 0
    return float(rows) if rows < len(disagreement) else math.inf
