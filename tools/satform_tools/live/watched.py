# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Serves the live page of a flight under way, in a process of its own."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_STOPPED
from satform_bringup.supervisor.run_registry import registered_runs
from satform_nodes.runtime.signals import interrupting
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.inspect import foxglove_server, observer_node
from satform_tools.inspect.observer_node import Observer
from satform_tools.live import command
from satform_tools.live.ros_flight import RosFlight
from satform_tools.live.ros_hands import RosHands
from satform_tools.run.page_options import PageOptions

_VIEWER_TIMEOUT = 5.0
"""Wall-clock time after the end of a flight for which a page may still be opened, s."""

_START_TIMEOUT = 120.0
"""Wall-clock time within which a flight that was started beside this has to be there, s."""

_POLLING = 0.1
_NICENESS = 10


def watch(observer: Observer, options: PageOptions, found: threading.Event | None = None) -> int:
    """Serve the page of a flight until it is over and no page is open any more, or Ctrl-C.

    Args:
        observer: in the formation's domain.
        options: how to serve it.
        found: set when the flight is known.

    Returns:
        Exit code: 0, or 130 after Ctrl-C.

    Raises:
        CommandError: no formation flies here, or the port cannot be bound.
    """
    # The flight has the processor first.
    os.nice(_NICENESS)
    flight = RosFlight(observer)
    hands = RosHands(observer, flight.monitor) if options.control else None
    if found is not None:
        found.set()
    return command.serve(flight, flight.formation()["title"], options, finished=_ended(flight), hands=hands)


def _ended(flight: RosFlight) -> Callable[[int], bool]:
    """Whether a flight is over, and for a while no page has been open."""
    since: list[float] = []

    def ended(viewers: int) -> bool:
        if not flight.monitor.over or viewers:
            since.clear()
            return False
        since[:] = since or [time.monotonic()]
        return time.monotonic() - since[0] > _VIEWER_TIMEOUT

    return ended


def watch_run_of(process: int, namespace: str | None, options: PageOptions, found: threading.Event) -> int:
    """Serve the page of the flight that a process flies, as soon as it is there.

    Args:
        process: id of the process that starts the flight.
        namespace: of the formation.
        options: how to serve the page.
        found: set when the flight is known.

    Raises:
        CommandError: the process starts no flight in time.
    """
    end = time.monotonic() + _START_TIMEOUT
    while not (runs := [run for run in registered_runs() if run.process == process]):
        if time.monotonic() > end:
            raise CommandError(f"no flight starts within {_START_TIMEOUT:g} s, so nothing is to be shown")
        time.sleep(_POLLING)  # between two looks at the registry of runs
    with observer_node.observe(runs[0].domain, _START_TIMEOUT, namespace) as observer:
        if options.foxglove:
            return foxglove_server.serve(observer, options, found)
        return watch(observer, options, found)


def _interrupt_without_flight(found: threading.Event, missed: threading.Event) -> None:
    """Interrupt this process if the other one closes its pipe, as it does after its flight, too early."""
    # Not by `sys.stdin`: Python aborts on its way out if a thread waits in it.
    os.read(sys.stdin.fileno(), 1)
    if not found.is_set():
        missed.set()
        os.kill(os.getpid(), signal.SIGINT)


def main(arguments: Sequence[str]) -> int:
    """Serve the page of the flight of another process; what `satform run --live` starts beside itself.

    That process holds a pipe to the standard input of this one until its flight is over.

    Args:
        arguments: id of that process, namespace, address, port, and `control`, `look` or `foxglove`.
    """
    process, namespace, address, port, way = arguments
    found, missed = threading.Event(), threading.Event()
    try:
        with interrupting():
            threading.Thread(target=_interrupt_without_flight, args=(found, missed), daemon=True).start()
            options = PageOptions(address, int(port), way == "control", way == "foxglove")
            return watch_run_of(int(process), namespace, options, found)
    except CommandError as error:
        console.error(str(error))
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        if missed.is_set():
            console.note("the flight was over before its page could be served; satform view RUN shows it")
        return EXIT_STOPPED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
