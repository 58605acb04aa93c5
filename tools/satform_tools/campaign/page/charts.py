# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Charts of a campaign's page, as its script draws them."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from satform.plot.style import time_unit
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
from satform_tools.report.page.document import packed

Chart: TypeAlias = dict[str, Any]

_MOST_ROWS, _MOST_COLUMNS = 30, 16


def charts(statistics: ReportStatistics) -> dict[str, list[Chart]]:
    """All charts by the section of the page."""
    ranks = _ranks(statistics)
    return {
        "rates": [_rate(index, found) for index, found in enumerate(statistics.rates)],
        "figures": [_histogram(index, found) for index, found in enumerate(statistics.histograms)],
        "series": [_envelope(index, found) for index, found in enumerate(statistics.envelopes)],
        "ranks": [ranks] if ranks else [],
        "scatters": [_scatter(index, pair, statistics) for index, pair in enumerate(drawn_pairs(statistics))],
    }


def _chart(key: str, title: str, x: dict[str, Any], y: dict[str, Any], parts: Sequence[Any]) -> Chart:
    return {
        "key": key,
        "title": title,
        "note": "",
        "kind": "",
        "x": x,
        "y": y,
        "parts": list(parts),
        "limits": [],
        "height": 0,
    }


def _rate(index: int, found: RateByValue) -> Chart:
    numeric = all(isinstance(value, int | float) for value in found.values)
    values = np.array(found.values, dtype=np.float64) if numeric else np.arange(float(len(found.values)))
    rate, low, high = 100.0 * found.rates.T
    has_interval = not np.any(np.isnan(low))
    part = {
        "kind": "range",
        "name": "success rate",
        "colour": "accent",
        "x": packed(values),
        "names": None if numeric else [str(value) for value in found.values],
        "y": packed(rate),
        "low": packed(low) if has_interval else None,
        "high": packed(high) if has_interval else None,
        "cases": list(found.cases),
    }
    x = {"title": found.input.path, "log": is_wide(values) if numeric else False, "names": not numeric}
    title = f"Success by {found.input.name}"
    chart = _chart(f"rate-{index}", title, x, {"title": "success rate [%]", "zero": True}, [part])
    chart["note"] = "Bars: 95 % interval (Wilson)." if has_interval else ""
    return chart


def _histogram(index: int, found: Histogram) -> Chart:
    edges = packed(found.edges)
    parts = [
        {"kind": "steps", "name": "all cases", "colour": "accent", "x": edges, "y": packed(found.counts)}
    ]
    if np.any(found.failed):
        failed = packed(found.failed)
        parts.append({"kind": "steps", "name": "failed cases", "colour": "bad", "x": edges, "y": failed})
    figure = found.figure
    x = {"title": with_unit("", figure.unit).strip() or "[1]", "log": found.logarithmic}
    chart = _chart(f"figure-{index}", figure.name, x, {"title": "cases", "zero": True}, parts)
    if found.outside:
        chart["note"] = f"{found.outside} more cases are outside of this range. "
    together: dict[float, list[str]] = {}
    for limit in found.limits:
        together.setdefault(limit.value, []).append(limit.text)
    for value, texts in together.items():
        text = ", ".join(texts)
        if is_near(value, found):
            chart["limits"].append({"at": value, "text": text})
        else:
            chart["note"] += f"{text[:1].upper()}{text[1:]} at {value:g} is outside of this range. "
    return chart


def _envelope(index: int, found: Envelope) -> Chart:
    unit = time_unit(float(found.time[-1]))
    time = packed(found.time / unit.size)
    low, middle, high = found.percentiles.T
    logarithmic = is_wide(found.percentiles)
    parts = [
        {
            "kind": "band",
            "name": "5 to 95 %",
            "colour": "accent",
            "x": time,
            "low": packed(low),
            "high": packed(high),
        },
        {"kind": "line", "name": "median", "colour": "ink", "x": time, "y": packed(middle)},
    ]
    x = {"title": f"time [{unit.name}]", "log": False}
    y = {"title": with_unit("", found.unit).strip() or "[1]", "log": logarithmic}
    chart = _chart(f"series-{index}", found.quantity, x, y, parts)
    chart["kind"] = "time"
    chart["note"] = members_text(found)
    return chart


def _ranks(statistics: ReportStatistics) -> Chart | None:
    """Coefficients of the strongest inputs and all figures."""
    rows = list(dict.fromkeys(pair.input for pair in statistics.correlations))[:_MOST_ROWS]
    columns = list(dict.fromkeys(pair.figure for pair in statistics.correlations))[:_MOST_COLUMNS]
    if len(rows) * len(columns) < 2:
        return None
    found = {(pair.input, pair.figure): round(pair.coefficient, 4) for pair in statistics.correlations}
    z = [[found.get((row, column)) for column in columns] for row in rows]
    part = {"kind": "heat", "rows": rows, "columns": columns, "z": z}
    names = {"title": "", "names": True}
    chart = _chart("ranks", "Rank correlation of inputs (rows) and figures (columns)", names, names, [part])
    chart["kind"] = "heat"
    chart["height"] = 190 + 22 * len(rows)
    return chart


def _scatter(index: int, pair: Correlation, statistics: ReportStatistics) -> Chart:
    numbers, first, second, success = scatter_of(pair, statistics)
    parts = []
    for name, colour, rows in (("success", "accent", success), ("failed", "bad", ~success)):
        if np.any(rows):
            parts.append(
                {
                    "kind": "points",
                    "name": name,
                    "colour": colour,
                    "x": packed(first[rows]),
                    "y": packed(second[rows]),
                    "cases": numbers[rows].tolist(),
                }
            )
    unit = statistics.summary.campaign.figure_units.get(pair.figure, "")
    x = {"title": pair.input, "log": is_wide(first)}
    y = {"title": with_unit("", unit).strip() or "[1]", "log": is_wide(second)}
    title = f"{pair.figure} by {pair.input}"
    chart = _chart(f"scatter-{index}", title, x, y, parts)
    chart["note"] = f"ρ = {pair.coefficient:.3f}, {pair.cases} cases, {len(numbers)} of them drawn."
    return chart
