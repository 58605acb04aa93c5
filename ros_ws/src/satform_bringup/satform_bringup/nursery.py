"""Where node processes are born: from a server that has imported everything they need.

Importing Python, numpy, scipy, pydantic and rclpy takes a process more than a second, and a
formation has many processes on few cores. Here one server imports once, without ever touching DDS,
and every node's process is a fork of it.
"""

import importlib
import multiprocessing
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import ModuleType

from satform_bringup import PACKAGE

_PRELOADED = f"{PACKAGE}.everything"
_TITLE_LENGTH = 15
"""Characters that Linux keeps of a process's name."""


def prepare() -> ForkServerContext:
    """Begin to make the server ready, in the background; calling it again changes nothing."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED])
    from multiprocessing import forkserver  # noqa: PLC0415  not needed by those who never fly

    forkserver.ensure_running()
    return context


def start(executable: str, arguments: list[str], domain: int, log: Path) -> tuple[BaseProcess, Connection]:
    """Start one node in a process of its own.

    Args:
        executable: module of `satform_nodes` whose `main` is run.
        arguments: its command line.
        domain: DDS domain; the node stays on this machine unless the environment says otherwise.
        log: file for what it prints.

    Returns:
        The process's handle and the end of the pipe on which it reports.
    """
    context = prepare()
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_live, args=(executable, arguments, domain, log, theirs))
    with _without_main_module():
        process.start()
    theirs.close()
    return process, ours


@contextmanager
def _without_main_module() -> Iterator[None]:
    """Keep the caller's main script out of the new process, which would otherwise run it again."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _live(executable: str, arguments: list[str], domain: int, log: Path, pipe: Connection) -> None:
    # A terminal's Ctrl-C is for the one who started the flight, who ends it in order.
    os.setsid()
    with log.open("wb") as output:
        os.dup2(output.fileno(), sys.stdout.fileno())
        os.dup2(output.fileno(), sys.stderr.fileno())
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    name = next(word.removeprefix("__node:=") for word in arguments if word.startswith("__node:="))
    Path("/proc/self/comm").write_text(name[:_TITLE_LENGTH])
    module = importlib.import_module(f"{PACKAGE}.{executable}")
    sys.exit(module.main(arguments, pipe))
