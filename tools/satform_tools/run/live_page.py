# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page beside a flight or a campaign, in a process of its own, which cannot delay them."""

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from satform_tools.run.page_options import PageOptions

_ENDING = 10.0
"""Wall-clock time for a server to end in order, s."""


class Served:
    """A page that is being served; or none.

    It ends by itself when the flight is over and no browser has the page open.
    """

    def __init__(self, process: subprocess.Popen[bytes] | None = None) -> None:
        self._process = process

    def wait(self) -> None:
        """Wait until it ends; to be called within the block of `beside`, so that an interruption ends it."""
        if self._process is not None:
            self._close_input()
            self._process.wait()

    def end(self) -> None:
        """End it now."""
        if self._process is None:
            return
        self._close_input()
        self._process.terminate()
        try:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_ENDING)
        finally:
            self._process.kill()  # does nothing to a process that has ended

    def _close_input(self) -> None:
        """Have the process know that what it shows is over."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()


@contextmanager
def beside(page: PageOptions | None, namespace: str) -> Iterator[Served]:
    """Serve the page of the flight that this process flies within the block.

    The address is printed to standard error. The page ends with the block, unless it is waited for in it.

    Args:
        page: how to serve it; None for no page.
        namespace: of the formation; empty for the root.

    Yields:
        What is served, to be waited for.
    """
    if page is None:
        yield Served()
        return
    way = "foxglove" if page.foxglove else "control" if page.control else "look"
    words = (os.getpid(), namespace, page.address, page.port, way)
    with _serving("watched", words) as served:
        yield served


@contextmanager
def beside_campaign(page: PageOptions | None, folder: Path) -> Iterator[Served]:
    """Serve the page of the campaign that this process flies within the block, as that of a flight.

    Args:
        page: how to serve it; None for no page.
        folder: of the campaign.

    Yields:
        What is served, to be waited for.
    """
    if page is None:
        yield Served()
        return
    with _serving("campaign", (folder, page.address, page.port)) as served:
        yield served


@contextmanager
def _serving(module: str, words: Sequence[object]) -> Iterator[Served]:
    command = [sys.executable, "-m", f"satform_tools.live.{module}", *map(str, words)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=sys.stderr)
    served = Served(process)
    try:
        yield served
    finally:
        served.end()
