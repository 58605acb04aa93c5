"""A DDS domain of one's own, so that two runs on one machine do not hear each other."""

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

FIRST, LAST = 1, 99
"""Domains whose ports lie below those that Linux gives to outgoing connections."""


@contextmanager
def own_domain() -> Iterator[int]:
    """Hold a domain for the length of a run.

    Yields:
        `ROS_DOMAIN_ID` from the environment if it is set; else a number that no other run of this
        user holds.

    Raises:
        RuntimeError: all domains are held by other runs.
    """
    given = os.environ.get("ROS_DOMAIN_ID", "")
    if given.isdecimal():
        yield int(given)
        return
    folder = Path(tempfile.gettempdir()) / f"satform-domains-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    for number in range(FIRST, LAST + 1):
        with (folder / str(number)).open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield number
            return
    raise RuntimeError(f"{LAST - FIRST + 1} runs are under way already; wait for one to end")
