"""What `satform bench` prints: rows of the benchmarks as tables or JSON."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from satform_tools import say
from satform_tools.say import Table


def plant(*, as_json: bool) -> None:
    """Measure and print the rates of the inertial truth and its rivals."""
    from satform_tools.benchmarks import plant as benchmark  # noqa: PLC0415

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


def lockstep(counts: Sequence[int], group: int, steps: int, *, record: bool, as_json: bool) -> None:
    """Measure and print how lockstep flights scale with the number of satellites."""
    from satform_tools.benchmarks import scaling  # noqa: PLC0415

    rows = [scaling.over_dds(count, group, steps, record=record) for count in counts]
    _print(
        rows,
        ("satellites", "processes", "steps/s", "round trips/step", "start [s]", "memory/process [MB]"),
        lambda row: (
            str(row.satellites),
            str(row.processes),
            f"{row.steps_per_second:.4g}",
            f"{row.round_trips_per_step:.3g}",
            f"{row.start_seconds:.2f}",
            f"{row.memory_per_process / 1e6:.0f}",
        ),
        as_json=as_json,
    )


def inprocess(counts: Sequence[int], *, as_json: bool) -> None:
    """Measure and print how in-process flights scale with the number of satellites."""
    from satform_tools.benchmarks import scaling  # noqa: PLC0415

    rows = [scaling.in_process(count) for count in counts]
    _print(
        rows,
        ("satellites", "steps/s", "satellite-steps/s"),
        lambda row: (
            str(row.satellites),
            f"{row.steps_per_second:.4g}",
            f"{row.satellites * row.steps_per_second:.3g}",
        ),
        as_json=as_json,
    )


def _print(rows: Sequence[Any], headings: tuple[str, ...], cells: Any, *, as_json: bool) -> None:
    if as_json:
        say.as_json([asdict(row) for row in rows])
        return
    say.table(Table(headings, [cells(row) for row in rows], frozenset(range(2, len(headings)))))
