# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Output of commands: tables and lines, coloured on a terminal, plain text elsewhere, or JSON."""

import json
import math
import os
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TextIO

from satform_tools.output_streams import note as remark
from satform_tools.output_streams import write

PLAIN_WIDTH = 100


@dataclass(frozen=True)
class Table:
    """Rows of text under headings.

    Attributes:
        headings: of the columns.
        rows: texts, as many in each row as there are headings.
        right: indices of the columns that are aligned to the right.
        styles: colour of whole rows by their index, where they have one.
    """

    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    right: frozenset[int] = frozenset()
    styles: dict[int, str] = field(default_factory=dict)


def is_terminal(stream: TextIO | None) -> bool:
    """Whether a stream is a terminal that understands more than plain text."""
    return stream is not None and stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def line(text: str = "", style: str = "") -> None:
    """Print a line of results."""
    if is_terminal(sys.stdout) and style:
        from rich.text import Text  # noqa: PLC0415 - only a terminal needs it

        _console().print(Text(text, style=style), soft_wrap=True)
    else:
        write(f"{text}\n")


def paragraph(text: str, indent: str = "") -> None:
    """Print text wrapped to a readable width, its blank lines kept."""
    for part in text.strip().split("\n\n"):
        filled = textwrap.fill(
            " ".join(part.split()), PLAIN_WIDTH, initial_indent=indent, subsequent_indent=indent
        )
        write(f"{filled}\n\n")


def heading(text: str) -> None:
    """Print the heading of a part."""
    line(text, "bold")


def table(content: Table) -> None:
    """Print a table."""
    if is_terminal(sys.stdout):
        _rich_table(content)
    else:
        write(f"{plain_table(content)}\n")


def plain_table(content: Table) -> str:
    """A table as text in columns, without lines or colours."""
    rows = [content.headings, *content.rows]
    widths = [max(len(row[column]) for row in rows) for column in range(len(content.headings))]
    lines = []
    for row in rows:
        cells = [
            text.rjust(width) if column in content.right else text.ljust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def as_json(data: Any) -> None:
    """Print data as JSON."""
    write(f"{to_json(data)}\n")


def as_json_line(data: Any) -> None:
    """Print data as one line of JSON."""
    write(f"{json.dumps(_finite(data), ensure_ascii=False, allow_nan=False)}\n")


def to_json(data: Any) -> str:
    """Data as JSON text; numbers that are not finite become null, which every reader understands."""
    return json.dumps(_finite(data), indent=1, ensure_ascii=False, allow_nan=False)


def error(text: str) -> None:
    """Print what went wrong to standard error."""
    remark(f"satform: {text}\n")


def note(text: str) -> None:
    """Print a remark beside the results to standard error."""
    remark(f"{text}\n")


def number(value: float) -> str:
    """A figure with seven digits, or a dash where there is none."""
    return "-" if math.isnan(value) else f"{value:.7g}"


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def _console() -> Any:
    from rich.console import Console  # noqa: PLC0415 - only a terminal needs it

    return Console(highlight=False)


def _rich_table(content: Table) -> None:
    _console().print(drawn_table(content))


def drawn_table(content: Table) -> Any:
    """A table as rich draws it on a terminal."""
    from rich import box  # noqa: PLC0415 - only a terminal needs them
    from rich.table import Table as RichTable  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    drawn = RichTable(box=box.SIMPLE_HEAD, pad_edge=False)
    for column, name in enumerate(content.headings):
        drawn.add_column(name, justify="right" if column in content.right else "left", overflow="fold")
    for index, row in enumerate(content.rows):
        drawn.add_row(*(Text(cell) for cell in row), style=content.styles.get(index))
    return drawn
