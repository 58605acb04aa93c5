# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes results of a campaign under way to files of its folder, many cases at a time."""

import time
from collections.abc import Iterator, Sequence

from satform.campaign.engine import MOST_SERIES_BYTES
from satform.campaign.folder import CampaignFolder
from satform.campaign.result_files import write_results
from satform.campaign.results import CaseResult

_MOST_ROWS = 5000
_PERIOD = 5.0
"""Wall-clock time after which finished cases are written, s."""


class ResultStore:
    """Takes results of a campaign under way, and writes them now and then."""

    def __init__(self, folder: CampaignFolder) -> None:
        self._folder = folder
        self._waiting: list[CaseResult] = []
        self._bytes = 0
        self._next = time.monotonic() + _PERIOD

    def store(self, results: Sequence[CaseResult]) -> None:
        """Take results.

        Raises:
            OSError: they cannot be written.
        """
        columns = self._folder.manifest.columns
        self._waiting += [columns.complete(result) for result in results]
        self._bytes += sum(map(_series_bytes, results))
        is_full = len(self._waiting) >= _MOST_ROWS or self._bytes >= MOST_SERIES_BYTES
        if is_full or time.monotonic() >= self._next:
            self.flush()

    def flush(self) -> None:
        """Write all that was taken.

        Raises:
            OSError: it cannot be written.
        """
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        self._next = time.monotonic() + _PERIOD
        waiting.sort(key=lambda result: result.number)
        for part in _parts(waiting):
            write_results(self._folder.path, part, self._folder.manifest.schema)


def _parts(results: Sequence[CaseResult]) -> Iterator[list[CaseResult]]:
    """Consecutive results for one file each, whose series are not larger than those of a chunk."""
    part: list[CaseResult] = []
    size = 0
    for result in results:
        own = _series_bytes(result)
        if part and size + own > MOST_SERIES_BYTES:
            yield part
            part, size = [], 0
        part.append(result)
        size += own
    if part:
        yield part


def _series_bytes(result: CaseResult) -> int:
    return sum(array.nbytes for array in result.series.values())
