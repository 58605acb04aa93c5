# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The table and the figure of docs/scaling.md: cost by number of satellites."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from satform.scenario import Scenario
from satform_tools import console
from satform_tools.bench import figures
from satform_tools.bench.scaling import OverDds, over_dds, ring
from satform_tools.errors import CommandError

COUNTS = (3, 8, 16, 32, 64, 128, 256, 1000)
"""Numbers of satellites that are flown."""

GRAPHS = {"ring": "ring", "random, degree 4": "random_regular, degree: 4"}

MOST_PROCESSES = 64
"""Largest number of satellites that is also flown with one process each."""

PROCESSES_OF_GROUPS = 2
"""Smallest number of satellite processes of a grouped flight."""

LARGEST_GROUP = 100
"""Largest number of satellites per process: creating a node takes longer the more nodes the process has."""

_DOCS = Path(__file__).resolve().parents[3] / "docs"
_PAGE, _FIGURE = _DOCS / "scaling.md", _DOCS / "scaling.png"
_BEGIN, _END = "<!-- measured: begin -->", "<!-- measured: end -->"
_HEADINGS = (
    "satellites",
    "graph",
    "satellite processes",
    "steps/s",
    "CPU time per step",
    "start-up",
    "memory per process",
    "memory per satellite",
)


@dataclass(frozen=True)
class FlightRow:
    """One flight of the table.

    Attributes:
        satellites: number of satellites.
        graph: its name in the table.
        group: satellites per process.
        flown: the measurement; None if the flight failed.
        reason: why the flight failed.
        load: load average of the machine after the flight, processes.
    """

    satellites: int
    graph: str
    group: int
    flown: OverDds | None
    reason: str
    load: float

    def cells(self) -> tuple[str, ...]:
        """The row as text, one cell per heading."""
        processes = -(-self.satellites // self.group)
        label = (str(self.satellites), self.graph, str(processes))
        if self.flown is None:
            return (*label, f"not flown: {self.reason[:120]}", "", "", "", "")
        memory = self.flown.memory_per_process / 1e6
        return (
            *label,
            f"{self.flown.steps_per_second:.3g}",
            f"{1e3 * self.flown.processor_per_step:.3g} ms",
            f"{self.flown.start_seconds:.3g} s",
            f"{memory:.0f} MB",
            f"{memory / self.group:.3g} MB",
        )


def measure(counts: Sequence[int], steps: int) -> Iterator[FlightRow]:
    """Fly formations of each size on each graph, grouped and one process each, and print each result.

    Args:
        counts: numbers of satellites.
        steps: steps of each flight; from 100 satellites on 20, to bound the duration.
    """
    for count in counts:
        together = min(-(-count // PROCESSES_OF_GROUPS), LARGEST_GROUP)
        groups = {together, *([1] if count <= MOST_PROCESSES else [])}
        for label, graph in GRAPHS.items():
            if graph != "ring" and count < 6:
                continue
            for group in sorted(groups):
                row = _measured(count, group, label, ring(count, steps if count < 100 else 20, graph))
                console.line("  ".join(row.cells()))
                yield row


def _measured(count: int, group: int, label: str, scenario: Scenario) -> FlightRow:
    try:
        flown = over_dds(count, group, 0, record=False, scenario=scenario, round_trips=0)
    except RuntimeError as error:
        return FlightRow(count, label, group, None, str(error), _load())
    return FlightRow(count, label, group, flown, "", _load())


def _load() -> float:
    return float(figures.machine()["load_average"][0])


def write(rows: Sequence[FlightRow]) -> None:
    """Write the rows into docs/scaling.md, between its marks, and draw the figure beside it.

    Raises:
        CommandError: the page cannot be read, or has no marks.
    """
    try:
        text = _PAGE.read_text(encoding="utf-8")
    except OSError as error:
        raise CommandError(f"{_PAGE}: cannot be read: {error.strerror}") from None
    before, begin, rest = text.partition(_BEGIN)
    _, end, after = rest.partition(_END)
    if not begin or not end:
        raise CommandError(f"{_PAGE}: has no marks {_BEGIN} and {_END} to write between")
    loads = [row.load for row in rows]
    about = figures.machine()
    table = [
        f"{about['processor']}, {about['cores']} cores, load {min(loads):.0f} to {max(loads):.0f} "
        "(`./tools/satform bench scaling --write`):",
        "",
        "| " + " | ".join(_HEADINGS) + " |",
        "|" + "---|" * len(_HEADINGS),
        *("| " + " | ".join(row.cells()) + " |" for row in rows),
    ]
    picture = "![CPU time per step and start-up by number of satellites](scaling.png)"
    _PAGE.write_text(f"{before}{begin}\n{chr(10).join(table)}\n\n{picture}\n{end}{after}", encoding="utf-8")
    _draw(rows)


def _draw(rows: Sequence[FlightRow]) -> None:
    from matplotlib.figure import Figure  # noqa: PLC0415 - slow to import

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for label in GRAPHS:
        for grouped in (False, True):
            own = [row for row in rows if row.flown and row.graph == label and (row.group > 1) == grouped]
            if not own:
                continue
            legend = f"{label}, {'grouped' if grouped else 'one process each'}"
            counts = [row.satellites for row in own]
            style = "o--" if grouped else "o-"
            left.plot(counts, [1e3 * r.flown.processor_per_step for r in own if r.flown], style, label=legend)
            right.plot(counts, [r.flown.start_seconds for r in own if r.flown], style, label=legend)
    for axes, title in ((left, "CPU time per step, ms"), (right, "start-up, s")):
        axes.set(xscale="log", yscale="log", xlabel="satellites", title=title)
        axes.grid(visible=True, alpha=0.3)
    left.legend(fontsize=8)
    figure.savefig(_FIGURE, dpi=110)
