# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands that serve the live page: `view` of stored flights, `watch --browser` of those under way."""

import asyncio
import sys
from collections.abc import Callable
from pathlib import Path

from satform.common.exit_codes import EXIT_DONE, EXIT_STOPPED
from satform_tools import console
from satform_tools.live.render import flight_page
from satform_tools.live.server import LiveServer
from satform_tools.live.source import Hands, Source
from satform_tools.live.stored_flight import StoredFlight
from satform_tools.run import stored_run
from satform_tools.run.page_options import PageOptions


def view(run: Path, options: PageOptions) -> int:
    """Serve the page of a stored flight until Ctrl-C.

    Args:
        run: folder of a run, folder of a bag, or `.mcap` file.
        options: how to serve it.

    Returns:
        Exit code.

    Raises:
        CommandError: there is no such flight, or the port cannot be bound.
    """
    stored = stored_run.find(run)
    return serve(StoredFlight(stored), stored.scenario.title, options, finished=lambda _viewers: False)


def serve(
    source: Source,
    title: str,
    options: PageOptions,
    *,
    finished: Callable[[int], bool],
    hands: Hands | None = None,
    page: Callable[[str], str] | None = None,
) -> int:
    """Serve the page of a flight, and print its address.

    Args:
        source: the flight.
        title: of the page until the flight is known.
        options: how to serve it.
        finished: whether to end; asked at each update with the number of viewers.
        hands: what viewers may do; None for viewers who look only.
        page: its text for a nonce; that of a flight when None.

    Returns:
        Exit code: 130 after Ctrl-C.

    Raises:
        CommandError: the port cannot be bound.
    """
    server = LiveServer(source, page or flight_page(title), hands, options)
    console.line(server.url)
    sys.stdout.flush()
    try:
        asyncio.run(server.serve(finished))
    except KeyboardInterrupt:
        return EXIT_STOPPED
    return EXIT_DONE
