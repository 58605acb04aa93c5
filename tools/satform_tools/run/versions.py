# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Versions of what the numbers of a flight depend on."""

import platform
from importlib.metadata import PackageNotFoundError, version

_PACKAGES = (
    "satform",
    "numpy",
    "scipy",
    "pydantic",
    "brahe",
    "ros-jazzy-rclpy",
    "ros-jazzy-rmw-fastrtps-cpp",
)


def versions() -> dict[str, str]:
    """Versions of Python and of each package that the numbers depend on."""
    found = {"python": platform.python_version(), "machine": f"{platform.system()} {platform.machine()}"}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
