# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints and stores figures of `satform bench`, and prints how they have changed."""

import statistics
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from satform_tools import console
from satform_tools.bench import figures as history
from satform_tools.bench.figures import Figure
from satform_tools.console import Table
from satform_tools.errors import CommandError


def show(figures: Sequence[Figure], folder: Path | None, *, as_json: bool) -> None:
    """Print figures, and store them where a folder is given.

    Args:
        figures: to print.
        folder: of the history; None to store nothing.
        as_json: whether to print JSON.
    """
    path = None if folder is None else history.write(figures, folder)
    if as_json:
        console.as_json(
            {
                "machine": history.machine(),
                "figures": [
                    {**asdict(figure), "ratio": figure.ratio, "spread": figure.spread} for figure in figures
                ],
            }
        )
        return
    rows = [
        (
            figure.name,
            f"{1e6 * statistics.median(figure.seconds):.4g}",
            f"{1e6 * min(figure.seconds):.4g}",
            f"{1e6 * max(figure.seconds):.4g}",
            f"{figure.ratio:.3g}",
            f"{100.0 * figure.spread:.0f} %",
            figure.yardstick,
        )
        for figure in figures
    ]
    headings = ("what", "median [us]", "min [us]", "max [us]", "in yardsticks", "spread", "yardstick")
    console.table(Table(headings, rows, frozenset({1, 2, 3, 4, 5})))
    about = history.machine()
    load = ", ".join(f"{value:.1f}" for value in about["load_average"])
    console.line(f"{about['processor']}, {about['cores']} cores, load {load}")
    if path is not None:
        console.line(f"stored in {path}")


_UNITS = {
    "memory": (1e-6, "MB"),
    "one_by_one": (1e6, "us"),
    "distance_from_rkf78": (1.0, "m"),
    "rkn1210_from_rkf78": (1.0, "m"),
}
"""Factor and unit in which a detail is printed, where it is not SI."""


def details(figures: Sequence[Figure]) -> None:
    """Print what else is known of figures."""
    rows = []
    for figure in figures:
        for name, value in figure.details.items():
            factor, unit = _UNITS.get(name, (1.0, ""))
            rows.append((figure.name, name.replace("_", " "), f"{factor * value:.4g} {unit}".rstrip()))
    console.table(Table(("what", "detail", "value"), rows, frozenset({2})))


def compare(before: Path, after: Path | None, folder: Path, *, as_json: bool) -> bool:
    """Print what has changed between two histories.

    Args:
        before: earlier file.
        after: later file; None for the newest in the folder besides the earlier one.
        folder: of the history.
        as_json: whether to print JSON.

    Returns:
        Whether something has got slower beyond the noise.

    Raises:
        CommandError: a file is no history, or there is none to compare with.
    """
    others = (path for path in folder.glob("*.json") if path.resolve() != before.resolve())
    later = after or max(others, default=None)
    if later is None:
        raise CommandError(f"{folder}: holds no history besides {before}; `satform bench` writes one")
    try:
        changes = history.compare(history.read(before), history.read(later))
    except ValueError as error:
        raise CommandError(str(error)) from None
    if not changes:
        raise CommandError(f"{before} and {later} have no figure in common")
    if as_json:
        console.as_json([{**asdict(change), "slower": change.slower} for change in changes])
    else:
        rows = [
            (
                change.name,
                f"{change.before:.3g}",
                f"{change.after:.3g}",
                f"{100.0 * (change.after / change.before - 1.0):+.0f} %",
                _verdict(change),
            )
            for change in changes
        ]
        console.table(Table(("what", "before", "after", "change", ""), rows, frozenset({1, 2, 3})))
        slower = [change.name for change in changes if change.slower]
        console.line(f"slower: {'; '.join(slower)}" if slower else "nothing is slower beyond the noise")
    return any(change.slower for change in changes)


def _verdict(change: history.Change) -> str:
    if not change.beyond_noise:
        return "within the noise"
    return "slower" if change.slower else "faster"


def plant(*, as_json: bool) -> None:
    """Measure and print the rates of the inertial truth and its rivals."""
    from satform_tools.bench import plant as benchmark  # noqa: PLC0415

    rows = benchmark.measure()
    _print(
        rows,
        ("propagator", "setting", "satellites", "satellite-s/s", "error [m]"),
        lambda row: (
            row.propagator,
            row.setting,
            str(row.satellites),
            f"{row.satellite_seconds_per_second:.3g}",
            f"{row.error:.2g}",
        ),
        as_json=as_json,
    )


def models(separation: float, *, as_json: bool) -> None:
    """Compute and print the errors of the linear truth models, as a table in Markdown."""
    from satform_tools.bench import model_errors  # noqa: PLC0415

    rows = model_errors.rows(separation=separation)
    if as_json:
        console.as_json([asdict(row) for row in rows])
    else:
        console.line(model_errors.markdown(rows))


def _print(rows: Sequence[Any], headings: tuple[str, ...], cells: Any, *, as_json: bool) -> None:
    if as_json:
        console.as_json([asdict(row) for row in rows])
        return
    console.table(Table(headings, [cells(row) for row in rows], frozenset(range(2, len(headings)))))
