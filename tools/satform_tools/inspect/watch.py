# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Watching a formation fly, until the flight has ended: on a terminal, in a pipe, or once."""

import sys
import time
from dataclasses import asdict

from satform.common.exit_codes import EXIT_DONE, EXIT_STOPPED
from satform_tools import console
from satform_tools.inspect.monitor import PERIOD, Watcher
from satform_tools.inspect.observer_node import Looker
from satform_tools.inspect.snapshot import Frame, as_renderable, as_text

_LINE_PERIOD = 2.0
"""Wall-clock time between two frames where there is no terminal, s."""


def watch(looker: Looker, *, once: bool, as_json: bool) -> int:
    """Show a formation until its flight has ended, or Ctrl-C.

    Args:
        looker: in the formation's domain.
        once: show one frame only.
        as_json: print a line of JSON for each frame.

    Returns:
        Exit code: 0, or 130 after Ctrl-C.

    Raises:
        CommandError: no formation flies here.
    """
    watcher = Watcher(looker)
    try:
        if once:
            looker.wait(lambda: watcher.look() or watcher.knows_all(), looker.patience)
            # The second look gives the step rate.
            looker.wait(watcher.look, 2.0 * PERIOD)
            _print(watcher.frame(), as_json)
        elif console.is_terminal(sys.stdout) and not as_json:
            _live(watcher)
        else:
            _in_lines(watcher, as_json, looker.patience)
    except KeyboardInterrupt:
        return EXIT_STOPPED
    return EXIT_DONE


def _live(watcher: Watcher) -> None:
    from rich.live import Live  # noqa: PLC0415 - only a terminal needs it

    with Live(auto_refresh=False, redirect_stdout=False, redirect_stderr=False) as live:
        while True:
            over = watcher.look()
            live.update(as_renderable(watcher.frame()), refresh=True)
            if over:
                return
            watcher.pause()


def _in_lines(watcher: Watcher, as_json: bool, patience: float) -> None:
    due, latest = 0.0, time.monotonic() + patience
    while True:
        over = watcher.look()
        now = time.monotonic()
        # A satellite that says nothing does not keep the others from being shown.
        if over or (now >= due and (watcher.knows_all() or now >= latest)):
            _print(watcher.frame(), as_json)
            due = now + _LINE_PERIOD
        if over:
            return
        watcher.pause()


def _print(frame: Frame, as_json: bool) -> None:
    if as_json:
        console.as_json_line(asdict(frame))
    else:
        print(as_text(frame))
    sys.stdout.flush()
