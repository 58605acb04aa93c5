# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Process server (fork server): node processes are forks of a process that has all imports done.

Reason for it: importing numpy, scipy, pydantic and rclpy takes a process more than a second, and a formation
has many processes on few cores. The server imports once, without using DDS, and every node's process is a
fork of it.

This module starts the server (`prepare`), forks node processes from it (`start`) and ends the server
(`close`). The node processes are monitored, stopped and restarted by `supervisor`.
"""

import atexit
import ctypes
import importlib
import multiprocessing
import multiprocessing.util
import os
import select
import signal
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from satform_bringup import PACKAGE
from satform_bringup.deployment import preflight
from satform_bringup.deployment.domain_lock import enter_domain
from satform_bringup.deployment.environment import restored
from satform_nodes import SHARED_SCENARIO
from satform_nodes.programs import MODULES

_PRELOADED = f"{PACKAGE}.preload"
_TERMINAL_SIGNALS = frozenset({signal.SIGINT, signal.SIGTERM, signal.SIGHUP})

_SET_PARENT_DEATH_SIGNAL = 1
"""`PR_SET_PDEATHSIG` of Linux's prctl."""

_HUGE_PAGES = "NUMPY_MADVISE_HUGEPAGE"
"""Environment variable of numpy, set to 0 for nodes: else it asks Linux for pages of 2 MB for large arrays,
in which the nearly empty adjacency matrix of 10,000 satellites takes 800 MB of each process."""

_AS_IT_IS: Mapping[str, str] = MappingProxyType({})

_SHUTDOWN_TIMEOUT = 5.0
"""Wall-clock time that a helper of Python's is given to end, s."""

_owner = -1
"""Number of the process that has started the server."""

_TITLE_LENGTH = 15
"""Characters that Linux keeps of a process's name."""


NO_EXIT_CODE = 255
"""Exit code that multiprocessing gives a process whose server has ended and cannot pass on the true one."""


def prepare() -> ForkServerContext:
    """Begin to make the server ready, in the background; calling it again changes nothing.

    Raises:
        OSError: it cannot be started.
    """
    global _owner  # noqa: PLW0603 - as Python's own server, of which there is one in a process
    _owner = os.getpid()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED])
    # The tracker lets signals through again when it starts, so it goes first.
    resource_tracker.ensure_running()
    # A terminal's signals reach the server too, which is to end with its parent and not before.
    try:
        with _signals_held(), restored([SHARED_SCENARIO, _HUGE_PAGES]):
            os.environ[SHARED_SCENARIO] = str(shared_scenario())
            os.environ.setdefault(_HUGE_PAGES, "0")
            forkserver.ensure_running()
    except OSError as error:
        if "AF_UNIX" not in str(error):
            raise
        raise OSError(
            f"the path of the folder for temporary files, {tempfile.gettempdir()}, is too long for sockets "
            "below it, whose paths have 107 characters at most; set TMPDIR to a shorter one"
        ) from None
    atexit.unregister(close)
    atexit.register(close)
    return context


def shared_scenario() -> Path:
    """File by which the server is given the scenario of the processes that it forks next.

    It is in this process's own folder for temporary files, and written by `shared_plan.announce`.
    """
    return Path(multiprocessing.util.get_temp_dir()) / "scenario.pickle"


def close() -> None:
    """End the server, and the tracker that Python runs beside it; both are gone when this returns.

    Both would end soon after this process, but no process of a flight is to be left when it ends. Nodes that
    still run get a signal from the kernel.
    """
    if os.getpid() != _owner:
        # A fork has no helpers of its own.
        return
    server: Any = forkserver._forkserver
    tracker: Any = resource_tracker._resource_tracker
    alive, process = server._forkserver_alive_fd, server._forkserver_pid
    if process is not None:
        server._forkserver_alive_fd = server._forkserver_pid = server._forkserver_address = None
        # It has nothing to put away, and would first import all that it was to.
        _end_helper(alive, process, 0.0)
    alive, process = tracker._fd, tracker._pid
    if process is not None:
        tracker._fd = tracker._pid = None
        _end_helper(alive, process, _SHUTDOWN_TIMEOUT)


def _end_helper(alive: int, process: int, timeout: float) -> None:
    """Wait for the end of a helper process for a timeout in s, and kill it after that."""
    os.close(alive)
    with suppress(ChildProcessError, ProcessLookupError):
        ended = os.pidfd_open(process)
        try:
            if not select.select([ended], [], [], timeout)[0]:
                os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
        finally:
            os.close(ended)


def start(
    executable: str, arguments: list[str], domain: int, log: Path, environment: Mapping[str, str] = _AS_IT_IS
) -> tuple[BaseProcess, Connection]:
    """Start one node in a process of its own.

    Args:
        executable: module of `satform_nodes` whose `main` is run.
        arguments: its command line.
        domain: DDS domain; the node stays on this machine unless the environment says otherwise.
        log: file for what it prints.
        environment: variables that differ from those with which the server was started.

    Returns:
        The process's handle and the end of the pipe on which it reports.

    Raises:
        OSError: the process cannot be started.
    """
    context = prepare()
    ours, theirs = context.Pipe()
    process = context.Process(
        target=_run_node, args=(executable, arguments, domain, log, dict(environment), theirs)
    )
    try:
        with _without_main_module():
            process.start()
    except EOFError:
        raise OSError(f"the process of {log.stem} could not be started: its server has ended") from None
    theirs.close()
    return process, ours


def watch_server() -> int:
    """A descriptor that becomes readable when the server of processes ends; to be closed by the caller.

    Raises:
        OSError: there is no server.
    """
    process = getattr(forkserver._forkserver, "_forkserver_pid", None)
    if process is None:
        raise ProcessLookupError("there is no server of processes")
    return os.pidfd_open(process)


def is_stopped(process: BaseProcess) -> bool:
    """Whether a process that was started here has been stopped by a signal and not been continued."""
    try:
        stat = Path(f"/proc/{process.pid}/stat").read_text()
    except OSError:
        return False
    # The state follows the name in brackets, which may hold anything.
    return stat.rpartition(") ")[2].startswith("T")


@contextmanager
def _without_main_module() -> Iterator[None]:
    """Keep the caller's main script out of the new process, which would otherwise run it again."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def _signals_held() -> Iterator[None]:
    """Keep a terminal's signals from this process for a moment, and from those it starts then for good."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _TERMINAL_SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _run_node(
    executable: str,
    arguments: list[str],
    domain: int,
    log: Path,
    environment: dict[str, str],
    pipe: Connection,
) -> None:
    _leave_terminal()
    _end_with_the_server()
    with log.open("wb") as output:
        os.dup2(output.fileno(), sys.stdout.fileno())
        os.dup2(output.fileno(), sys.stderr.fileno())
    preflight.remove_unused_variables()
    os.environ.update(environment)
    enter_domain(domain)
    name = next(text.partition("__node:=")[2] for text in arguments if "__node:=" in text)
    Path("/proc/self/comm").write_text(name[:_TITLE_LENGTH])
    module = importlib.import_module(MODULES[executable])
    sys.exit(module.main(arguments, pipe))


def _leave_terminal() -> None:
    """Leave the terminal, whose signals the supervisor handles, and unblock signals.

    A signal to the terminal's process group that arrived before is discarded: it was for the supervisor,
    which ends the nodes in order.
    """
    os.setsid()
    for number in _TERMINAL_SIGNALS:
        # Ignoring a signal discards a pending one.
        handler = signal.signal(number, signal.SIG_IGN)
        signal.signal(number, signal.SIG_DFL if handler is None else handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _TERMINAL_SIGNALS)


def _end_with_the_server() -> None:
    """Have the kernel send this process a signal when the server ends, which ends with its parent.

    Without it the processes of a flight would go on after their terminal is closed.
    """
    # Every process of the server keeps it alive by this, for processes of its own.
    server: Any = forkserver._forkserver
    os.close(server._forkserver_alive_fd)
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGTERM)
    if os.getppid() != parent:
        sys.exit(128 + signal.SIGTERM)
