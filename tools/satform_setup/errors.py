# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the set-up as sentences with a remedy."""

from __future__ import annotations

import errno
import re
from pathlib import Path


class SetupError(Exception):
    """The set-up cannot go on; the message says what is missing and which command mends it."""


_DISK_FULL = "the disk is full; free about 2 GB and"

# Ordered: without a network pip also finds "no matching distribution", so causes come before their effects.
_PIP_ERRORS = (
    (r"No space left on device|Errno 28|Disk quota exceeded|Errno 122", _DISK_FULL),
    (
        r"CERTIFICATE_VERIFY_FAILED|SSLError|SSLCertVerificationError",
        "the package index shows a certificate that this machine does not trust (a company proxy?); "
        "give pip its certificate, e.g. export PIP_CERT=/path/to/ca.pem, and",
    ),
    (
        r"ProxyError|Cannot connect to proxy|Tunnel connection failed",
        "the proxy rejects the connection; check the variable https_proxy and",
    ),
    (
        r"NewConnectionError|NameResolutionError|Temporary failure in name resolution"
        r"|Name or service not known|Network is unreachable|No route to host|Connection refused"
        r"|ConnectTimeout|ReadTimeout|Read timed out|RemoteDisconnected|ConnectionResetError|MaxRetryError",
        "the package index cannot be reached; connect this machine to the network and",
    ),
    (
        r"IncompleteRead|ProtocolError|DO NOT MATCH THE HASHES|BadZipFile",
        "a download was interrupted;",
    ),
    (
        r"Permission denied|Errno 13",
        "a file of the environment may not be written; take ownership of the project's folder and",
    ),
)
_NO_WHEEL = re.compile(r"No matching distribution found for (?P<requirement>\S+)")


def pip_error_text(output: str, python: str) -> str:
    """Say in one clause why pip failed.

    Args:
        output: all that pip printed.
        python: version of the Python pip ran in, e.g. "3.12.3".

    Returns:
        A clause that ends where "run the same command again" fits.
    """
    for pattern, clause in _PIP_ERRORS:
        if re.search(pattern, output):
            return clause
    missing = _NO_WHEEL.search(output)
    if missing:
        return (
            f"the package index has no {missing['requirement']} for Python {python} on this machine; "
            "put another Python of 3.11 to 3.13 first on the PATH, or give pip another index, and"
        )
    return "pip failed;"


def os_error_text(error: OSError) -> str:
    """Say in one sentence what the operating system refused."""
    if error.errno in {errno.ENOSPC, errno.EDQUOT}:
        return f"{_DISK_FULL} run the same command again"
    where = f" ({error.filename})" if error.filename else ""
    return f"{error.strerror or error}{where}; correct this and run the same command again"


def last_lines(path: Path, count: int) -> str:
    """The last `count` lines of a text file that are not empty; nothing if it cannot be read."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return "\n".join([line for line in lines if line.strip()][-count:])
