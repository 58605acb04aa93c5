# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Functions that fly chunks of a campaign that is none: results at once, or what goes wrong in a worker.

Worker processes import this module, so that it holds no tests.
"""

import os
import signal
import threading
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from satform.campaign.engine import ChunkObserver
from satform.campaign.results import CaseResult, Columns, ResultsHash

COLUMNS = Columns({"x": "number", "seed": "integer"}, ("figure",), ("figure",))


def changes(number: int) -> dict[str, float | int]:
    """The changes of a case."""
    return {"x": number / 7, "seed": 3 * number}


def result(number: int) -> CaseResult:
    """The result of a case; each tenth is no success."""
    met = number % 10 != 0
    return CaseResult(
        number,
        changes(number),
        {"figure": number**0.5},
        {"figure": met},
        success=met,
        reason="" if met else "not as expected: figure",
    )


def hashed(results: Iterable[CaseResult]) -> str:
    """The hash over results, whatever their order."""
    found = ResultsHash(COLUMNS)
    for one in sorted(results, key=lambda one: one.number):
        found.add(COLUMNS.complete(one))
    return found.hexdigest()


def fly(
    accidents: Mapping[int, str], numbers: Sequence[int], observer: ChunkObserver | None, folder: str | None
) -> list[CaseResult]:
    """Results of cases.

    Args:
        accidents: what the case of a number does to its worker: `exit`, `kill`, `hang`, `memory`, `error`;
            with `once` behind it only the first time, by a file in `folder`.
        numbers: of the cases.
        observer: what to report to.
        folder: for files of accidents that happen once.
    """
    results = []
    for number in numbers:
        if observer is not None:
            observer.begin([number])
        accident, _, often = accidents.get(number, "").partition(" ")
        if accident and (often != "once" or _is_first(Path(folder or "."), number)):
            _have_accident(accident)
        found = result(number)
        if observer is not None:
            observer.finished([found])
        results.append(found)
    return results


def _is_first(folder: Path, number: int) -> bool:
    try:
        (folder / str(number)).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def _have_accident(accident: str) -> None:
    match accident:
        case "exit":
            os._exit(3)
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "hang":
            threading.Event().wait(600.0)
        case "memory":
            raise MemoryError
        case "error":
            raise RuntimeError("no such thing")
