# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints the state of a running formation until its flight ends: on a terminal, in a pipe, or once."""

import sys
import time
from dataclasses import asdict

from satform.common.exit_codes import EXIT_DONE, EXIT_STOPPED
from satform_tools import console
from satform_tools.inspect.monitor import PERIOD, FormationMonitor
from satform_tools.inspect.observer_node import Observer
from satform_tools.inspect.snapshot import Frame, as_renderable, as_text

_LINE_PERIOD = 2.0
"""Wall-clock time between two frames where there is no terminal, s."""


def watch(observer: Observer, *, once: bool, as_json: bool) -> int:
    """Print the state of a formation until its flight has ended, or Ctrl-C.

    Args:
        observer: in the formation's domain.
        once: print one frame only.
        as_json: print a line of JSON for each frame.

    Returns:
        Exit code: 0, or 130 after Ctrl-C.

    Raises:
        CommandError: no formation flies here.
    """
    monitor = FormationMonitor(observer)
    try:
        if once:
            observer.wait(lambda: monitor.update() or monitor.is_complete(), observer.timeout)
            # The second update gives the step rate.
            observer.wait(monitor.update, 2.0 * PERIOD)
            _print(monitor.frame(), as_json)
        elif console.is_terminal(sys.stdout) and not as_json:
            _live(monitor)
        else:
            _in_lines(monitor, as_json, observer.timeout)
    except KeyboardInterrupt:
        return EXIT_STOPPED
    return EXIT_DONE


def _live(monitor: FormationMonitor) -> None:
    from rich.live import Live  # noqa: PLC0415 - only a terminal needs it

    with Live(auto_refresh=False, redirect_stdout=False, redirect_stderr=False) as live:
        while True:
            over = monitor.update()
            live.update(as_renderable(monitor.frame()), refresh=True)
            if over:
                return
            monitor.pause()


def _in_lines(monitor: FormationMonitor, as_json: bool, timeout: float) -> None:
    due, latest = 0.0, time.monotonic() + timeout
    while True:
        over = monitor.update()
        now = time.monotonic()
        # A satellite without messages does not delay the others.
        if over or (now >= due and (monitor.is_complete() or now >= latest)):
            _print(monitor.frame(), as_json)
            due = now + _LINE_PERIOD
        if over:
            return
        monitor.pause()


def _print(frame: Frame, as_json: bool) -> None:
    if as_json:
        console.as_json_line(asdict(frame))
    else:
        print(as_text(frame))
    sys.stdout.flush()
