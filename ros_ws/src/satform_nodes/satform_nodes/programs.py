# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry points of the executables: signals, and help, before what takes time is imported.

A node needs about a second for its imports. Ctrl-C meanwhile ends it in order and without a traceback: the
executables start Python without `site` (option -S), which is made up for here, after signals are handled.
"""

import _signal  # type: ignore[import-not-found]  # `signal` imports more than all else here
import os
import sys

_DONE, _STOPPED = 0, 130
"""As in `satform.common.exit_codes`."""

MODULES = {
    "plant_node": "satform_nodes.plant.flight_loop",
    "satellite_node": "satform_nodes.satellite.single_node",
    "group_node": "satform_nodes.satellite.group_node",
    "recorder_node": "satform_nodes.recorder.flight_loop",
    "display_node": "satform_nodes.display.node",
}
"""Module of each executable; its function `main` runs the node."""


def plant_node() -> int:
    """Run the plant."""
    return _start("plant_node")


def satellite_node() -> int:
    """Fly one satellite."""
    return _start("satellite_node")


def group_node() -> int:
    """Fly several satellites in one process."""
    return _start("group_node")


def recorder_node() -> int:
    """Record a flight."""
    return _start("recorder_node")


def display_node() -> int:
    """Show a flight."""
    return _start("display_node")


def _leave(_number: int, _frame: object) -> None:
    # Nothing has been opened yet that would have to be closed.
    os._exit(_DONE if "stopped_exit_code:=0" in sys.argv else _STOPPED)


def _start(program: str) -> int:
    # Until the node itself handles them.
    for number in (_signal.SIGINT, _signal.SIGTERM, _signal.SIGHUP):
        # A SIGHUP that the parent ignores, as nohup does, stays ignored.
        if number != _signal.SIGHUP or _signal.getsignal(number) != _signal.SIG_IGN:
            _signal.signal(number, _leave)
    if sys.flags.no_site:
        import site  # noqa: PLC0415

        site.main()
    import importlib  # noqa: PLC0415

    own = sys.argv[1 : sys.argv.index("--ros-args")] if "--ros-args" in sys.argv else sys.argv[1:]
    if {"-h", "--help"}.intersection(own):
        sys.stdout.write(importlib.import_module("satform_nodes.runtime.start_parameters").help_of(program))
        return _DONE
    return int(importlib.import_module(MODULES[program]).main())
