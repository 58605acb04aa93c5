# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Versions of the software on which the bits of a result depend."""

import functools
import platform
from importlib.metadata import PackageNotFoundError, version

_SOFTWARE = ("satform", "numpy", "scipy", "brahe")


@functools.cache
def _found() -> tuple[tuple[str, str], ...]:
    found = [("machine", platform.machine())]
    for name in _SOFTWARE:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return tuple(found)


def software() -> dict[str, str]:
    """Versions by name of the package, and the kind of machine."""
    return dict(_found())
