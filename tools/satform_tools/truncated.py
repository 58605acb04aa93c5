# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints long lists truncated: all of a short one, else its first entries and the total number."""

from collections.abc import Sequence

from satform_tools import console
from satform_tools.console import Table

MOST = 40
"""Longest list that is printed whole."""

FEW = 10
"""Entries of a longer list that are printed."""


def names(entries: Sequence[str]) -> str:
    """Names with commas between them."""
    if len(entries) <= MOST:
        return ", ".join(entries)
    return f"{', '.join(entries[:FEW])}, ... ({len(entries)} in all)"


def lines(entries: Sequence[str]) -> None:
    """Print a line for each entry."""
    for entry in entries[: len(entries) if len(entries) <= MOST else FEW]:
        console.line(entry)
    _print_rest(len(entries))


def table(content: Table) -> None:
    """Print a table."""
    rows = content.rows
    if len(rows) <= MOST:
        console.table(content)
        return
    styles = {row: style for row, style in content.styles.items() if row < FEW}
    console.table(Table(content.headings, rows[:FEW], content.right, styles))
    _print_rest(len(rows))


def _print_rest(count: int) -> None:
    if count > MOST:
        console.line(f"... and {count - FEW} more; --json prints all")
