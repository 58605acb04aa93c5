# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the wheel with the nodes requires: packages of a flight with the versions of requirements.txt."""

import re
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, requires, version

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

RUNTIME = (
    *(
        "ros-jazzy-rclpy",
        "ros-jazzy-common-interfaces",
        "ros-jazzy-rmw-fastrtps-cpp",
        "ros-wheels-bootstrapper",
    ),
    *("numpy", "scipy", "networkx", "brahe", "sgp4", "clarabel"),
    *("pydantic", "ruamel.yaml", "jsonschema"),
    *("mcap", "mcap-ros2-support", "rosbags", "cryptography"),
    *("typer", "rich", "matplotlib", "jinja2", "plotly", "tornado", "arro3-core", "arro3-io", "distributed"),
)
"""Packages that commands and nodes import; what builds and tests them is left out."""

_PIN = re.compile(r"([A-Za-z0-9._-]+)==([^\s;]+)")


def pinned(text: str) -> dict[str, str]:
    """Versions of a requirements file by the normalised names of the packages."""
    found = (_PIN.match(line) for line in text.splitlines())
    return {canonicalize_name(pin[1]): pin[2] for pin in found if pin}


def runtime_requirements(pins: Mapping[str, str], seeds: Iterable[str] = RUNTIME) -> list[str]:
    """The packages of a flight and all that they require and this environment has, each with its version.

    Args:
        pins: versions by normalised name.
        seeds: packages to begin with.

    Returns:
        Requirements such as `numpy==2.4.6`, in order of the names. A package that another one names, and that
        the environment does without, is left to the installer.
    """
    found: set[str] = set()
    todo = [str(canonicalize_name(seed)) for seed in seeds]
    while todo:
        name = todo.pop()
        if name in found or not _installed(name):
            continue
        found.add(name)
        todo += [str(canonicalize_name(needed.name)) for needed in _required_by(name)]
    return [f"{name}=={pins.get(name) or version(name)}" for name in sorted(found)]


def _installed(name: str) -> bool:
    try:
        version(name)
    except PackageNotFoundError:
        return False
    return True


def _required_by(name: str) -> list[Requirement]:
    needed = [Requirement(line) for line in requires(name) or ()]
    return [entry for entry in needed if entry.marker is None or entry.marker.evaluate({"extra": ""})]
