# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Run registry: the running flights of this user on this machine, each described by a file.

The files are in the user's runtime folder (`deployment.runtime_folder`). That a DDS domain is in use is not
taken from them but from the domain's lock (`deployment.domain_lock`).
"""

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from satform_bringup.deployment import runtime_folder
from satform_bringup.deployment.domain_lock import DomainError, hold, shell_domain

_NAME = re.compile(r"run-\d+-\d+\.json")
"""Names of descriptions."""

_START_TIME = 19
"""Place of a process's start among the fields of `/proc/<pid>/stat` that follow its name."""


@dataclass(frozen=True)
class RegisteredRun:
    """Description of a running flight.

    Attributes:
        domain: DDS domain in which it flies.
        scenario: name of what is flown.
        folder: of the run.
        process: id of the process that started it and watches over it.
        started: when that process started, in clock ticks since the machine did; process ids come again.
    """

    domain: int
    scenario: str
    folder: str
    process: int
    started: int


@contextmanager
def described(domain: int, scenario: str, folder: Path) -> Iterator[None]:
    """Register the flight in a domain that this process holds, for observers.

    Raises:
        RuntimeFolderError: the user's folder for it is another user's, or open to others.
    """
    describe(domain, scenario, folder)
    try:
        yield
    finally:
        with suppress(OSError, runtime_folder.RuntimeFolderError):
            runtime_folder.remove(file_name(domain))


def describe(domain: int, scenario: str, folder: Path) -> None:
    """Register the flight in a domain that this process holds, for the rest of its life.

    Raises:
        RuntimeFolderError: the user's folder for it is another user's, or open to others.
    """
    run = RegisteredRun(domain, scenario, str(folder.absolute()), os.getpid(), _started(os.getpid()) or 0)
    # Without room for the description the run flies all the same; observers then name the domain.
    with suppress(OSError):
        for name in set(runtime_folder.names()) - {_name_of(other) for other in registered_runs()}:
            # What killed runs have left.
            if _NAME.fullmatch(name):
                runtime_folder.remove(name)
        runtime_folder.write(file_name(domain), json.dumps(asdict(run)))


def file_name(domain: int) -> str:
    """Name of this process's description of a domain; no other process's, in whatever network namespace."""
    return f"run-{domain}-{os.getpid()}.json"


def hold_shell_domain(scenario: str, folder: Path, namespace: str = "") -> int:
    """Hold the shell's own domain for the rest of this process's life, and register the flight.

    Args:
        scenario: name of what is flown.
        folder: of the run.
        namespace: of all its nodes and topics; runs in different ones may share a domain.

    Returns:
        `ROS_DOMAIN_ID`, or 0, which is ROS's own default.

    Raises:
        DomainError: it is no domain, or another run on this machine holds it.
    """
    domain = shell_domain() or 0
    if hold(domain, namespace) is None:
        others = [run for run in registered_runs() if run.domain == domain]
        who = f" ({others[0].scenario} in {others[0].folder})" if others else ""
        raise DomainError(
            f"domain {domain} is in use by another run on this machine{who}, and both runs would receive "
            "each other's messages; "
            "wait for it to end, set ROS_DOMAIN_ID to another number, or push a namespace"
        )
    describe(domain, scenario, folder)
    return domain


def registered_runs() -> list[RegisteredRun]:
    """This user's runs on this machine whose process lives, by domain; what killed ones left is passed over.

    Raises:
        RuntimeFolderError: the user's folder for descriptions is another user's, or open to others.
    """
    found = [_read(name) for name in runtime_folder.names() if _NAME.fullmatch(name)]
    alive = [run for run in found if run is not None and _started(run.process) == run.started]
    return sorted(alive, key=lambda run: (run.domain, run.process))


def _name_of(run: RegisteredRun) -> str:
    return f"run-{run.domain}-{run.process}.json"


def _read(name: str) -> RegisteredRun | None:
    try:
        run = RegisteredRun(**json.loads(runtime_folder.read(name) or ""))
    except (ValueError, TypeError, RecursionError):
        return None
    numbers, texts = (run.domain, run.process, run.started), (run.scenario, run.folder)
    typed = all(isinstance(number, int) for number in numbers) and all(
        isinstance(text, str) for text in texts
    )
    return run if typed and _name_of(run) == name else None


def _started(process: int) -> int | None:
    """When a process started, in clock ticks since the machine did; None when there is no such process."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name stands in brackets and may hold anything, brackets too.
    state, *others = stat.rpartition(")")[2].split()
    return None if state in "ZX" else int(others[_START_TIME - 1])
