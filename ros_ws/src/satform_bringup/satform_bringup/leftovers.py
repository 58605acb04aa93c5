"""What killed processes have left in shared memory, taken away before a new flight comes upon it.

Fast DDS hands messages between processes of a machine through files in `/dev/shm`: a segment for each
participant, and a port, with a semaphore, for each address of a domain. A process that is killed leaves its
own behind. A segment costs half a megabyte. A port can have been in the hands of the killed: whoever opens
it next, in any later flight in that domain, then waits for ever.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

FOLDER = Path("/dev/shm")  # noqa: S108 - where the middleware puts its files
"""Shared memory as files."""

_PORTS_OF_A_DOMAIN, _FIRST_PORT = 250, 7400
"""The DDS standard's formula for ports."""

_PREFIX, _SEMAPHORE, _LOCK = "fastrtps_", "sem.", "_el"


def clear(domain: int, folder: Path = FOLDER, processes: Path = Path("/proc")) -> list[str]:
    """Take away what no process uses any more: ports of a domain, and segments of any.

    Files of other users are left alone, and so is what any process has mapped or locked.

    Args:
        domain: that the caller holds, so that no flight in it is about to begin.
        folder: with the shared memory's files.
        processes: the system's folder of processes.

    Returns:
        Names of the files that were taken away, in order.
    """
    stems = {_stem(file) for file in _own_files(folder) if _belongs(_stem(file), domain)}
    if not stems:
        return []
    used = _mapped(folder, processes)
    gone = []
    for stem in sorted(stems - used):
        if _lives(folder / f"{stem}{_LOCK}", is_port=stem.startswith(f"{_PREFIX}port")):
            continue
        for name in (stem, f"{stem}{_LOCK}", f"{_SEMAPHORE}{stem}_mutex"):
            with suppress(FileNotFoundError, PermissionError):
                (folder / name).unlink()
                gone.append(name)
    return gone


def _own_files(folder: Path) -> Iterator[Path]:
    for pattern in (f"{_PREFIX}*", f"{_SEMAPHORE}{_PREFIX}*"):
        for file in folder.glob(pattern):
            with suppress(OSError):
                if file.stat().st_uid == os.getuid():
                    yield file


def _stem(file: Path) -> str:
    """Name of the segment or port that a file belongs to."""
    return file.name.removeprefix(_SEMAPHORE).removesuffix("_mutex").removesuffix(_LOCK)


def _belongs(stem: str, domain: int) -> bool:
    """Whether it is a segment, or a port of the domain; other domains' ports are their flights' concern."""
    address = stem.removeprefix(f"{_PREFIX}port")
    if address == stem:
        # A segment is known by the lock that its owner holds as long as it lives.
        return True
    first = _FIRST_PORT + _PORTS_OF_A_DOMAIN * domain
    return address.isdecimal() and first <= int(address) < first + _PORTS_OF_A_DOMAIN


def _mapped(folder: Path, processes: Path) -> set[str]:
    """Segments and ports that some process has in its memory."""
    found = set()
    for maps in processes.glob("[0-9]*/maps"):
        with suppress(OSError):
            for line in maps.read_text(errors="replace").splitlines():
                place = line.partition(f"{folder}/")[2]
                if place:
                    found.add(_stem(Path(place.removesuffix(" (deleted)"))))
    return found


def _lives(lock: Path, *, is_port: bool) -> bool:
    """Whether the owner holds the lock by which it says that it lives; a port may have none."""
    try:
        descriptor = os.open(lock, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        # A segment without a lock is one that is being made.
        return not is_port
    except OSError:
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False
