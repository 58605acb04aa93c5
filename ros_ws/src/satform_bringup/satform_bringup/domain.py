"""A DDS domain of one's own, so that two runs on one machine do not hear each other."""

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from satform_bringup import leftovers
from satform_bringup.environment import restored

FIRST, LAST = 1, 99
"""Domains whose ports lie below those that Linux gives to outgoing connections."""

HIGHEST = 232
"""The last domain that DDS has ports for."""

_HELD = "SATFORM_HOLDS_DOMAIN"
"""Environment variable that tells programs started from here that their domain is held for them."""

_VARIABLES = ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", _HELD)


class DomainError(RuntimeError):
    """No domain can be had; the message says which was wanted and who has it."""


@contextmanager
def own_domain(agreed: int | None = None) -> Iterator[int]:
    """Hold a domain for the length of a run.

    Args:
        agreed: with other machines, to be taken unless the environment says otherwise; None for any.

    Yields:
        `ROS_DOMAIN_ID` from the environment if it is set; else the one that was agreed; else a number
        that no other run on this machine holds.

    Raises:
        DomainError: the domain that is set is held by another run or is none; or all are held.
    """
    given = os.environ.get("ROS_DOMAIN_ID", "") or ("" if agreed is None else str(agreed))
    wanted = [_number(given)] if given else list(range(FIRST, LAST + 1))
    if given and os.environ.get(_HELD) == given:
        yield wanted[0]
        return
    for number in wanted:
        lock = hold(number)
        if lock is not None:
            try:
                yield number
            finally:
                os.close(lock)
            return
    if given:
        raise DomainError(
            f"ROS_DOMAIN_ID={given} is in use by another run on this machine, and both would hear each "
            "other; wait for it to end, set another one, "
            + ("or unset it to get a free one" if agreed is None else "the same on every host")
        )
    raise DomainError(f"{len(wanted)} runs are under way already; wait for one to end")


@contextmanager
def on_domain(number: int) -> Iterator[None]:
    """Set this process's environment for a domain that it holds, and restore it in the end."""
    with restored(_VARIABLES):
        enter_domain(number)
        yield


def enter_domain(number: int) -> None:
    """Set this process's environment for a domain that is held for it."""
    os.environ["ROS_DOMAIN_ID"] = os.environ[_HELD] = str(number)
    stay_on_this_machine()


def stay_on_this_machine() -> None:
    """Have nodes found on this machine only, unless the environment says otherwise."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


def shell_domain() -> int | None:
    """The domain that `ROS_DOMAIN_ID` names; None when it is not set.

    Raises:
        DomainError: what it names is no domain.
    """
    given = os.environ.get("ROS_DOMAIN_ID", "")
    return _number(given) if given else None


def lock_file(number: int) -> Path:
    """The file whose lock holds a domain, in a folder that all users of the machine share."""
    folder = Path(tempfile.gettempdir()) / "satform-domains"
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        # Shared by all users of the machine, whom the umask would keep out.
        folder.chmod(0o1777)
    return folder / str(number)


def _number(given: str) -> int:
    if not (given.isascii() and given.isdigit() and int(given) <= HIGHEST):
        raise DomainError(f"ROS_DOMAIN_ID={given!r} is not a DDS domain; it is a number from 0 to {HIGHEST}")
    return int(given)


def hold(number: int) -> int | None:
    """Hold a domain for as long as the file that is returned stays open; None when another process has it.

    What killed processes have left of it in shared memory is taken away.
    """
    path = lock_file(number)
    try:
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except PermissionError:
        # Another user's file: reading is enough to hold a lock on it.
        lock = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        return None
    leftovers.clear(number)
    return lock
