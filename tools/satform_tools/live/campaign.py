# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A campaign under way as its page shows it, by its files of results; the process that serves the page."""

import math
import os
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from satform.campaign.folder import CampaignFolder
from satform.campaign.result_files import ResultFileError
from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_STOPPED
from satform_nodes.runtime.signals import interrupting
from satform_tools import console
from satform_tools.campaign import library
from satform_tools.campaign.report_statistics import Histogram, distributions
from satform_tools.campaign.summary import Summary, summarise
from satform_tools.errors import CommandError
from satform_tools.live import command
from satform_tools.live.history import Column, History, Recent
from satform_tools.live.render import campaign_page
from satform_tools.run.page_options import PageOptions

_LEAST_PERIOD = 1.0
"""Wall-clock time between two looks at the results, s."""

_FRACTION = 0.25
"""Part of its time for which this process reads results: a large campaign is looked at less often."""

_LINGERS = 5.0
"""Wall-clock time after the end of a campaign for which its page may still be opened, s."""

_MOST_ROWS = 2000
_MOST_FIGURES = 24
_MOST_REASONS = 20


class CampaignProgress:
    """The success rate and the distributions of a campaign, as its results are written.

    Results are read by a thread of its own, so that pages are answered meanwhile.
    """

    period = 0.25

    def __init__(self, folder: CampaignFolder) -> None:
        self._folder, self._campaign = folder, folder.campaign()
        self.history = History({"rate": Column(3)}, most=_MOST_ROWS)
        self.events, self.graphs = Recent(1), Recent(1)
        self.over = threading.Event()
        self._status: dict[str, Any] = {"flown": 0, "over": False}
        self._reader = ThreadPoolExecutor(1)
        self._reading: Future[tuple[dict[str, Any], tuple[float, float, float]] | None] | None = None
        self._due = 0.0
        self._last = False

    @property
    def finished(self) -> bool:
        """Whether the campaign is over and its last results have been read."""
        return bool(self._status["over"])

    def formation(self) -> dict[str, Any]:
        """What does not change during the campaign."""
        return {
            "name": self._campaign.name,
            "title": " ".join(self._campaign.title.split()),
            "cases": self._folder.manifest.cases,
            "folder": str(self._folder.path),
        }

    def status(self) -> dict[str, Any]:
        """Cases flown, success rate, distributions, expectations and reasons of failures so far."""
        return self._status

    def update(self) -> None:
        """Take what has been read, and read again when it is time."""
        if self._reading is None:
            if time.monotonic() >= self._due and not self.finished:
                self._last = self.over.is_set()
                self._reading = self._reader.submit(self._read)
            return
        if not self._reading.done():
            return
        found, self._reading = self._reading.result(), None
        if found is not None:
            status, rate = found
            self._status = {**status, "over": self._last}
            if status["flown"]:
                self.history.append(status["flown"], {"rate": rate})

    def _read(self) -> tuple[dict[str, Any], tuple[float, float, float]] | None:
        begun = time.monotonic()
        try:
            summary = summarise(self._folder, self._campaign)
            shown = _shown(summary, distributions(summary))
        except (OSError, ResultFileError):
            return None  # a file that is being replaced; the next look finds it
        finally:
            spent = time.monotonic() - begun
            self._due = time.monotonic() + max(_LEAST_PERIOD, spent * (1.0 - _FRACTION) / _FRACTION)
        return shown, summary.rate


def _shown(summary: Summary, histograms: Sequence[Histogram]) -> dict[str, Any]:
    """A summary as the page takes it; what is not a number is None."""
    return {
        "flown": summary.flown,
        "succeeded": summary.succeeded,
        "rate": [_number(value) for value in summary.rate] if summary.flown else None,
        "histograms": [
            {
                "name": found.figure.name,
                "unit": found.figure.unit,
                "cases": found.figure.cases,
                "median": _number(found.figure.percentiles[1]),
                "edges": found.edges.tolist(),
                "counts": found.counts.tolist(),
                "failed": found.failed.tolist(),
                "logarithmic": found.logarithmic,
                "limits": [{"value": limit.value, "text": limit.text} for limit in found.limits],
            }
            for found in histograms[:_MOST_FIGURES]
        ],
        "expectations": [
            {
                "label": verdict.label,
                "allowed": verdict.allowed,
                "found": f"{console.number(verdict.statistic)} {verdict.unit}".rstrip(),
                "met": verdict.met,
            }
            for verdict in summary.verdicts
        ],
        "reasons": [[count, kind] for kind, count in list(summary.kinds.items())[:_MOST_REASONS]],
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def serve(folder: Path, options: PageOptions) -> int:
    """Serve the page of a campaign until standard input is closed and no page is open any more, or Ctrl-C.

    Args:
        folder: of the campaign.
        options: how to serve it.

    Returns:
        Exit code.

    Raises:
        CommandError: there is no campaign, or the port cannot be bound.
    """
    progress = CampaignProgress(library.opened(folder))
    threading.Thread(target=_wait_for_end, args=(progress.over,), daemon=True).start()
    since: list[float] = []

    def ended(viewers: int) -> bool:
        if not progress.finished or viewers:
            since.clear()
            return False
        since[:] = since or [time.monotonic()]
        return time.monotonic() - since[0] > _LINGERS

    title = str(progress.formation()["title"])
    return command.serve(progress, title, options, finished=ended, page=campaign_page(title))


def _wait_for_end(over: threading.Event) -> None:
    # Not by `sys.stdin`: Python aborts on its way out if a thread waits in it.
    os.read(sys.stdin.fileno(), 1)
    over.set()


def main(arguments: Sequence[str]) -> int:
    """Serve the page of a campaign that another process flies; it holds a pipe to this one until the end.

    Args:
        arguments: folder of the campaign, address and port.
    """
    folder, address, port = arguments
    try:
        with interrupting():
            return serve(Path(folder), PageOptions(address, int(port)))
    except CommandError as error:
        console.error(str(error))
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        return EXIT_STOPPED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
