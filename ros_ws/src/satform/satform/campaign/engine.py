# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Flies the cases of a campaign in chunks through an engine, and gives every case a result.

Which cases share a chunk, where and in which order they are flown has no effect on the results. The cases of
a chunk whose worker process dies are flown again in halves; the one that ends its worker twice while it is
flown alone becomes a result with the reason. Imports `results` only, so that engines and workers need no
more.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Protocol

from satform.campaign.results import CaseResult

CHUNKS_PER_WORKER = 4
"""Chunks of a worker in a campaign of many cases, so that all workers end at about the same time."""

MOST_CASES_OF_CHUNK = 512
"""Cases in a chunk at most; larger stacks are hardly faster, and a chunk may be lost."""

WIDE_STACK = 1000
"""Satellites of all cases in a stack from which on a step costs little more than its arithmetic."""

MOST_SATELLITES = 4096
"""Satellites of all cases in a chunk at most, which bounds the memory of a stack."""

MOST_SERIES_BYTES = 64_000_000
"""Size of the retained series of all cases in a chunk at most, unless a single case has more."""


class ChunkObserver(Protocol):
    """What a function that flies a chunk reports meanwhile."""

    def begin(self, numbers: Sequence[int]) -> None:
        """From now on these cases are flown: one alone, or several in a stack."""

    def advanced(self, part: float) -> None:
        """Of the cases that were begun last this part is flown, from 0 to 1; called as often as is known."""

    def finished(self, results: Sequence[CaseResult]) -> None:
        """These cases have their results."""


FlyChunk = Callable[[Any, Sequence[int], ChunkObserver | None, str | None], list[CaseResult]]
"""Flies cases of a campaign: campaign, numbers, observer, folder for retained records or None."""


@dataclass(frozen=True)
class Job:
    """What a worker process of a campaign gets once.

    The engine `dask` sends it to the dask workers with every chunk, compressed, so that a worker that joins
    later or replaces a lost one has it too.

    Attributes:
        fly: function of a module that flies a chunk, such as `satform.campaign.chunk.fly_chunk`.
        campaign: its first argument.
        records: folder for retained records; None to retain none.
        time_limit: wall-clock time in which a case flown alone has to end, s; a stack has as much for each of
            its cases, but has to advance, or give results, at least once in this time. None for no limit.
    """

    fly: FlyChunk
    campaign: Any
    records: str | None = None
    time_limit: float | None = None


@dataclass(frozen=True)
class Chunk:
    """Cases that one worker flies.

    Attributes:
        numbers: of the cases.
        again: whether it is a single case whose worker has died before.
    """

    numbers: tuple[int, ...]
    again: bool = False


@dataclass(frozen=True)
class Outcome:
    """What has come of a chunk so far.

    Attributes:
        chunk: that was flown.
        results: of cases that are finished since the last outcome.
        ended: whether no more comes of the chunk.
        failure: why cases of it have no result, in a sentence without a full stop; empty when all have.
        suspects: cases that were flown when it failed.
        timed_out: whether it failed by the time limit.
        under_way: cases of the chunk that are flown without a result yet, those in part counted as that part.
    """

    chunk: Chunk
    results: Sequence[CaseResult] = ()
    ended: bool = True
    failure: str = ""
    suspects: tuple[int, ...] = ()
    timed_out: bool = False
    under_way: float = 0.0


class EngineError(RuntimeError):
    """An engine that cannot go on; its text says why."""


class Engine(Protocol):
    """Where chunks are flown."""

    @property
    def workers(self) -> int:
        """Chunks that are flown at the same time."""

    @property
    def free(self) -> int:
        """Chunks that can be submitted now."""

    def submit(self, chunk: Chunk) -> None:
        """Have a chunk flown; there has to be room for it."""

    def wait(self, duration: float) -> list[Outcome]:
        """What has come of the chunks meanwhile.

        Args:
            duration: wall-clock time that is waited for something, s.

        Raises:
            EngineError: no worker can be started or reached.
        """

    def close(self) -> None:
        """End all workers, whatever they do."""


def chunk_size(cases: int, workers: int, satellites: int, series_bytes: int = 0) -> int:
    """Cases in a chunk.

    Args:
        cases: to be flown.
        workers: chunks that are flown at the same time.
        satellites: in one case.
        series_bytes: size of the retained series of one case.
    """
    workers = max(1, workers)
    # Fewer chunks where more would have stacks narrower than WIDE_STACK; the same number for every worker.
    wide = workers * math.ceil(WIDE_STACK / max(1, satellites))
    rounds = max(1, min(CHUNKS_PER_WORKER, cases // wide))
    chunk = math.ceil(cases / (rounds * workers))
    most = min(
        MOST_CASES_OF_CHUNK, MOST_SATELLITES // max(1, satellites), MOST_SERIES_BYTES // max(1, series_bytes)
    )
    return max(1, min(chunk, most))


@dataclass
class ChunkScheduler:
    """Gives the cases of a campaign to an engine in chunks, and stores their results.

    Attributes:
        changes: gives the changes of a case, for the result of one whose flight gave none.
        store: takes results, in any order.
        report: called with the number of cases that are done since the start, as often as that changes; cases
            that are flown in part are counted as that part.
        stop: asked again and again whether to end; what is finished then is stored.
        period: wall-clock time after which it is asked, s.
    """

    changes: Callable[[int], Any]
    store: Callable[[Sequence[CaseResult]], None]
    report: Callable[[int], None] = lambda _done: None
    stop: Callable[[], bool] = lambda: False
    period: float = 0.2
    _again: deque[Chunk] = field(default_factory=deque)
    _under_way: dict[Chunk, set[int]] = field(default_factory=dict)
    _parts: dict[Chunk, float] = field(default_factory=dict)
    _done: int = 0

    def fly(self, numbers: Iterable[int], size: int, engine: Engine) -> bool:
        """Fly cases until each has a result.

        Args:
            numbers: of the cases.
            size: of a chunk.
            engine: where to fly them; it is not closed.

        Returns:
            Whether all are flown; False when it was stopped.

        Raises:
            EngineError: no worker can be started or reached.
            OSError: results cannot be stored.
        """
        chunks = _chunks(iter(numbers), size)
        exhausted = False
        while not self.stop():
            while engine.free > 0:
                chunk = self._again.popleft() if self._again else next(chunks, None)
                if chunk is None:
                    exhausted = True
                    break
                self._under_way[chunk] = set(chunk.numbers)
                engine.submit(chunk)
            if exhausted and not self._under_way and not self._again:
                return True
            for outcome in engine.wait(self.period):
                self._take(outcome)
        return False

    def _take(self, outcome: Outcome) -> None:
        missing = self._under_way[outcome.chunk]
        missing.difference_update(result.number for result in outcome.results)
        if outcome.ended:
            self._parts.pop(outcome.chunk, None)
        else:
            self._parts[outcome.chunk] = outcome.under_way
        self._store(outcome.results)
        if not outcome.ended:
            self._report()
            return
        del self._under_way[outcome.chunk]
        if missing:
            self._store(self._abandoned(outcome, missing))

    def _abandoned(self, outcome: Outcome, missing: set[int]) -> list[CaseResult]:
        """Results of cases that are not flown again; all others are put into new chunks.

        A stack is halved until the case is alone that ends it: the others are flown in stacks again.
        """
        named = missing.intersection(outcome.suspects)
        suspects = sorted(named or missing)
        rest = sorted(missing.difference(suspects))
        if rest:
            self._again.append(Chunk(tuple(rest)))
        if len(suspects) > 1:
            half = len(suspects) // 2
            self._again += [Chunk(tuple(suspects[:half])), Chunk(tuple(suspects[half:]))]
            return []
        (suspect,) = suspects
        # A case that was flown alone and did not end in time would not end in time once more. One that was
        # not flown when the time was over, since all that were have results, has not used up any time.
        if (outcome.timed_out and named) or outcome.chunk.again:
            return [CaseResult(suspect, self.changes(suspect), reason=outcome.failure, lost=True)]
        self._again.append(Chunk((suspect,), again=True))
        return []

    def _store(self, results: Sequence[CaseResult]) -> None:
        if results:
            self.store(results)
            self._done += len(results)
            self._report()

    def _report(self) -> None:
        self.report(self._done + int(sum(self._parts.values())))


def _chunks(numbers: Iterator[int], size: int) -> Iterator[Chunk]:
    while part := tuple(islice(numbers, size)):
        yield Chunk(part)
