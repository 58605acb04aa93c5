"""What killed processes have left in shared memory, taken away before a new flight comes upon it.

Fast DDS hands messages between processes of a machine through files in `/dev/shm`: a segment for each
participant, and a port, with a semaphore, for each address of a domain. A process that is killed leaves its
own behind. A segment costs half a megabyte. A port can have been in the hands of the killed: whoever opens
it next, in any later flight in that domain, then waits for ever.
"""

import fcntl
import os
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

_LOOKS, _BETWEEN_LOOKS = 20, 0.01
"""How often a semaphore has to be found taken, and the wall-clock time between, s."""

_PREFIX, _SEMAPHORE, _LOCKS = "fastrtps_", "sem.", ("_el", "_sl")


def clear(
    domain: int, *, in_flight: bool = False, folder: Path = FOLDER, processes: Path = Path("/proc")
) -> list[str]:
    """Take away what no process uses any more: ports of a domain, and segments of any.

    Files of other users are left alone, and so is what any process has mapped or locked. Where a process
    cannot be looked into, as another user's or the system's first, a lock does not tell of all who use a
    port: then, and in domain 0, in which anything may begin at any moment, a port goes only when it is stuck.

    Args:
        domain: that the caller holds, so that no flight but its own is in it.
        in_flight: whether the caller's flight is under way, in which a port may just be coming to life: a
            port goes only when it is stuck.
        folder: with the shared memory's files.
        processes: the system's folder of processes.

    Returns:
        Names of the files that were taken away, in order.
    """
    found = {_stem(file) for file in _own_files(folder)}
    stems = sorted(stem for stem in found if _is_segment(stem) or _is_port_of(stem, domain))
    gone: list[str] = []
    with ExitStack() as held:
        # Locked until the end: whoever would come to life meanwhile waits, or makes new files.
        dead = [stem for stem in stems if _take_locks(folder, stem, held)]
        used = _mapped(folder, processes) if dead else set()
        ports_may_go = used is not None and domain != 0 and not in_flight
        for stem in dead:
            unused = stem not in (used or ()) and (ports_may_go or _is_segment(stem))
            if not (unused or _is_stuck(folder, stem)):
                continue
            names = (stem, *(f"{stem}{lock}" for lock in _LOCKS), _semaphore(stem))
            for name in names:
                with suppress(OSError):
                    (folder / name).unlink()
                    gone.append(name)
    return gone


def _is_stuck(folder: Path, port: str) -> bool:
    """Whether a port that nobody reads from is in the hands of one who does not let go.

    A port is held for microseconds, while it is opened or closed.
    """
    for _ in range(_LOOKS):
        try:
            count = (folder / _semaphore(port)).read_bytes()[:4]
        except OSError:
            return False
        if count != _TAKEN:
            return False
        # Between two looks at what another process holds, which tells nobody when it lets go.
        time.sleep(_BETWEEN_LOOKS)
    return True


def _semaphore(port: str) -> str:
    return f"{_SEMAPHORE}{port}_mutex"


def _own_files(folder: Path) -> Iterator[Path]:
    for pattern in (f"{_PREFIX}*", f"{_SEMAPHORE}{_PREFIX}*"):
        for file in folder.glob(pattern):
            with suppress(OSError):
                if file.stat().st_uid == os.getuid():
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
    """Whether it is a port by which participants of a domain are reached."""
    address = stem.removeprefix(f"{_PREFIX}port")
    if not address.isdecimal():
        return False
    first = _FIRST_PORT + _PORTS_OF_A_DOMAIN * domain
    return (
        _FIRST_OF_ANY_DOMAIN <= int(address) < _FIRST_PORT
        or first <= int(address) < first + _PORTS_OF_A_DOMAIN
    )


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
            descriptor = os.open(folder / f"{stem}{lock}", os.O_RDONLY | os.O_CLOEXEC)
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
