# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of benchmarks beside a yardstick of the same run, their history and its comparison."""

import json
import os
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from satform.files.bounded_file import read_json

_MOST_BYTES = 100_000_000
"""Size of the largest file that is taken for a history."""

NOTICEABLE = 0.1
"""Share by which a ratio has to change in order to be named."""


@dataclass(frozen=True)
class Figure:
    """What one thing costs.

    Attributes:
        name: of what was measured, the same in every history file.
        seconds: cost of each repetition, s for a unit such as a step or a message.
        yardstick: what it is compared with: `numpy loop` or `round trip`.
        yardstick_seconds: cost of the yardstick right before each repetition, s.
        details: other figures of it in SI units.
    """

    name: str
    seconds: tuple[float, ...]
    yardstick: str
    yardstick_seconds: tuple[float, ...]
    details: dict[str, float] = field(default_factory=dict)

    @property
    def ratios(self) -> list[float]:
        """Cost in yardsticks, of each repetition."""
        return [cost / unit for cost, unit in zip(self.seconds, self.yardstick_seconds, strict=True)]

    @property
    def ratio(self) -> float:
        """Cost in yardsticks, the median."""
        return statistics.median(self.ratios)

    @property
    def spread(self) -> float:
        """Half of the distance between the cheapest and the dearest repetition, as a share of the median."""
        return 0.5 * (max(self.ratios) - min(self.ratios)) / self.ratio


@dataclass(frozen=True)
class Change:
    """A figure of two histories.

    Attributes:
        name: of what was measured.
        before: cost in yardsticks, the median.
        after: likewise, later.
        beyond_noise: whether both sides have several repetitions, none of one side reaches into the other's,
            and the medians differ by a noticeable share.
    """

    name: str
    before: float
    after: float
    beyond_noise: bool

    @property
    def slower(self) -> bool:
        """Whether it has got slower beyond the noise."""
        return self.beyond_noise and self.after > self.before


def repeated(
    name: str,
    yardstick: str,
    unit: Callable[[], float],
    measure: Callable[[], float],
    repetitions: int,
    details: dict[str, float] | None = None,
) -> Figure:
    """Measure something and its yardstick in turns.

    Args:
        name: of what is measured.
        yardstick: name of what it is compared with.
        unit: measures the yardstick, s.
        measure: measures the thing, s.
        repetitions: how often.
        details: filled by `measure`, if at all.

    Returns:
        The figure.
    """
    pairs = [(unit(), measure()) for _ in range(repetitions)]
    return Figure(
        name, tuple(cost for _, cost in pairs), yardstick, tuple(base for base, _ in pairs), details or {}
    )


def numpy_loop() -> float:
    """Processor time of a fixed loop of small numpy operations, such as flight software consists of, s.

    The fastest of several, for each operation of the loop.
    """
    rounds = 2000
    best = float("inf")
    a, b = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.25, 0.125])
    for _ in range(5):
        begin = time.thread_time()
        for _ in range(rounds):
            c = a * b
            c = c + a
            np.sqrt(c)
        best = min(best, time.thread_time() - begin)
    return best / (3 * rounds)


def machine() -> dict[str, Any]:
    """What the figures depend on besides the code: processor, cores, load, versions."""
    from satform_tools.run.versions import versions  # noqa: PLC0415 - it asks every package

    return {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "load_average": list(os.getloadavg()),
        "python": platform.python_version(),
        "kernel": platform.release(),
        "versions": versions(),
    }


def write(figures: Sequence[Figure], folder: Path) -> Path:
    """Write figures as a JSON file named by the time.

    Args:
        figures: to write.
        folder: made where it is missing.

    Returns:
        The file.

    Raises:
        OSError: the folder cannot be written to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{datetime.now(UTC).strftime('%Y%m%dT%H%M%S%fZ')}.json"
    data = {"machine": machine(), "figures": [asdict(figure) for figure in figures]}
    path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    return path


def read(path: Path) -> list[Figure]:
    """Figures of a history file.

    Raises:
        ValueError: the file is not one; the message says what is wrong.
        OSError: it cannot be read.
    """
    try:
        data = read_json(path, _MOST_BYTES)
        figures = [
            Figure(
                name=str(entry["name"]),
                seconds=tuple(float(cost) for cost in entry["seconds"]),
                yardstick=str(entry["yardstick"]),
                yardstick_seconds=tuple(float(cost) for cost in entry["yardstick_seconds"]),
                details={str(name): float(value) for name, value in entry["details"].items()},
            )
            for entry in data["figures"]
        ]
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"{path}: is no history of `satform bench`: {error!r}") from None
    for figure in figures:
        whole = 0 < len(figure.seconds) == len(figure.yardstick_seconds)
        if not whole or min(figure.seconds) <= 0.0 or min(figure.yardstick_seconds) <= 0.0:
            raise ValueError(
                f"{path}: {figure.name!r} needs a positive cost and yardstick of each repetition"
            )
    return figures


def compare(before: Sequence[Figure], after: Sequence[Figure]) -> list[Change]:
    """What has changed between two histories, in the order of the later one.

    Args:
        before: earlier figures.
        after: later figures; those that the earlier ones do not have, or have beside another yardstick, are
            left out.

    Returns:
        A change for each figure that both have.
    """
    earlier = {(figure.name, figure.yardstick): figure for figure in before}
    return [
        _change(earlier[figure.name, figure.yardstick], figure)
        for figure in after
        if (figure.name, figure.yardstick) in earlier
    ]


def _change(before: Figure, after: Figure) -> Change:
    # The noise of a single repetition is unknown.
    several = min(len(before.ratios), len(after.ratios)) > 1
    apart = min(after.ratios) > max(before.ratios) or max(after.ratios) < min(before.ratios)
    noticeable = abs(after.ratio / before.ratio - 1.0) > NOTICEABLE
    return Change(before.name, before.ratio, after.ratio, several and apart and noticeable)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
