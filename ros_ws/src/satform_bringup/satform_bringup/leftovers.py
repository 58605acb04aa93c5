# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What killed processes have left in shared memory, taken away before somebody new comes upon it.

Fast DDS hands messages between processes of a machine through files in `/dev/shm`, where it may: a segment
for each participant, and a port, with a semaphore, for each address of a domain. A run on one machine does
without (`discovery`); a flight on several hosts, nodes that are started by hand and those who look in do
not. A process that is killed leaves its own behind. A segment costs half a megabyte. A port can have been in
the hands of the killed: whoever opens it next, in any later flight in that domain or in place of the killed,
then waits for ever.
"""

import fcntl
import os
import stat
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

FOLDER = Path("/dev/shm")  # noqa: S108 - where the middleware puts its files
"""Shared memory as files."""

_PORTS_OF_A_DOMAIN, _FIRST_PORT = 250, 7400
"""The DDS standard's formula for ports."""

_FIRST_OF_ANY_DOMAIN = 7000
"""Below the ports of the first domain are those by which participants of all domains are reached."""

_TAKEN = bytes(4)
"""How a semaphore of glibc begins when it is taken: with a count of 0."""

_LONGEST_HOLD = 3.0
"""Wall-clock time for which a port is held at most, s: opening one takes up to 1 s, waiting for it 2 s."""

_BETWEEN_LOOKS = 0.01
"""Wall-clock time between two looks at a semaphore, s."""

_PREFIX, _SEMAPHORE, _LOCKS = "fastrtps_", "sem.", ("_el", "_sl")


def clear(domain: int, folder: Path = FOLDER, processes: Path = Path("/proc")) -> list[str]:
    """Take away what no process uses any more: ports of a domain, and segments of any; and what is stuck.

    Files of other users are left alone, and so is what any process has locked or, unless it is stuck, mapped.
    Ports by which participants of all domains are reached go only when stuck: another flight that is about to
    begin may want one of them at this very moment, and would do without it if it were locked here.
    Where a process cannot be looked into, as another user's or the system's first, locks do not tell who else
    uses a port: then, and in domain 0, in which anything may begin at any moment, it goes only when stuck.

    Args:
        domain: that the caller holds, so that no flight in it is about to begin.
        folder: with the shared memory's files.
        processes: the system's folder of processes.

    Returns:
        Names of the files that were taken away.
    """
    gone = release(domain, folder)
    stems = [stem for stem in _stems(folder) if _is_segment(stem) or _is_port_of(stem, domain)]
    with ExitStack() as held:
        # Locked until the end: whoever would come to life meanwhile makes new files.
        dead = [stem for stem in stems if _take_locks(folder, stem, held)]
        used = _mapped(folder, processes) if dead else set()
        ports_stay = used is None or domain == 0
        for stem in dead:
            if stem not in (used or ()) and not (ports_stay and not _is_segment(stem)):
                gone += _remove(folder, stem)
    return gone


def release(domain: int, folder: Path = FOLDER) -> list[str]:
    """Take away the ports of a domain that are stuck, also while a flight is under way in it.

    Stuck is a port that nobody reads from and that somebody has held all the time for longer than Fast DDS
    ever does. What came to hold it and to map it waits for ever.

    Args:
        domain: of the flight.
        folder: with the shared memory's files.

    Returns:
        Names of the files that were taken away.
    """
    gone: list[str] = []
    ports = [stem for stem in _stems(folder) if _is_port_of(stem, domain) or _is_port_of_all(stem)]
    for port in _stuck(folder, ports):
        with ExitStack() as held:
            if _take_locks(folder, port, held):
                gone += _remove(folder, port)
    return gone


def _stuck(folder: Path, ports: list[str]) -> list[str]:
    """Those of some ports whose semaphores are taken at every look; at once when none is."""
    until = time.monotonic() + _LONGEST_HOLD
    while ports := [port for port in ports if _is_taken(folder / _semaphore(port))]:
        if time.monotonic() > until:
            return ports
        time.sleep(_BETWEEN_LOOKS)  # what is awaited is another process's letting go, of which nobody tells
    return []


def _is_taken(semaphore: Path) -> bool:
    try:
        descriptor = os.open(semaphore, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False
    with os.fdopen(descriptor, "rb") as file:
        return file.read(len(_TAKEN)) == _TAKEN


def _remove(folder: Path, stem: str) -> Iterator[str]:
    """Remove a segment or port with all that belongs to it; gives the names of what there was."""
    for name in (stem, *(f"{stem}{lock}" for lock in _LOCKS), _semaphore(stem)):
        with suppress(OSError):
            (folder / name).unlink()
            yield name


def _semaphore(port: str) -> str:
    return f"{_SEMAPHORE}{port}_mutex"


def _stems(folder: Path) -> list[str]:
    """Names of the segments and ports of this user, in order."""
    return sorted({_stem(file) for file in _own_files(folder)})


def _own_files(folder: Path) -> Iterator[Path]:
    for pattern in (f"{_PREFIX}*", f"{_SEMAPHORE}{_PREFIX}*"):
        for file in folder.glob(pattern):
            with suppress(OSError):
                # Not of what a symbolic link of another user's points at.
                status = file.lstat()
                if status.st_uid == os.getuid() and stat.S_ISREG(status.st_mode):
                    yield file


def _stem(file: Path) -> str:
    """Name of the segment or port that a file belongs to."""
    name = file.name.removeprefix(_SEMAPHORE).removesuffix("_mutex")
    for lock in _LOCKS:
        name = name.removesuffix(lock)
    return name


def _is_segment(stem: str) -> bool:
    """Whether it is a participant's own; known by the lock that it holds while it lives."""
    return not stem.startswith(f"{_PREFIX}port")


def _is_port_of(stem: str, domain: int) -> bool:
    """Whether it is a port by which participants of this domain alone are reached."""
    first = _FIRST_PORT + _PORTS_OF_A_DOMAIN * domain
    return first <= _port(stem) < first + _PORTS_OF_A_DOMAIN


def _is_port_of_all(stem: str) -> bool:
    """Whether it is a port by which participants of all domains are reached."""
    return _FIRST_OF_ANY_DOMAIN <= _port(stem) < _FIRST_PORT


def _port(stem: str) -> int:
    """Number of a port; -1 for what is none."""
    number = stem.removeprefix(f"{_PREFIX}port")
    return int(number) if number.isdecimal() else -1


def _mapped(folder: Path, processes: Path) -> set[str] | None:
    """Segments and ports that some process has in its memory; None when not all could be asked."""
    found = set()
    for maps in processes.glob("[0-9]*/maps"):
        try:
            lines = maps.read_text(errors="replace").splitlines()
        except PermissionError:
            return None
        except OSError:
            # It has just ended.
            continue
        for line in lines:
            place = line.partition(f"{folder}/")[2]
            if place:
                found.add(_stem(Path(place.removesuffix(" (deleted)"))))
    return found


def _take_locks(folder: Path, stem: str, held: ExitStack) -> bool:
    """Take the locks by which an owner says that it lives; False when it holds one, or may be about to."""
    there = False
    for lock in _LOCKS:
        try:
            descriptor = os.open(folder / f"{stem}{lock}", os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
        except FileNotFoundError:
            continue
        except OSError:
            return False
        held.callback(os.close, descriptor)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        there = True
    # A segment without a lock is one that is being made; a port may have none.
    return there or not _is_segment(stem)
