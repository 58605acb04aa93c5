# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Finds ROS 2 Jazzy: a sourced one, or else that of the PyPI wheels."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from satform_setup.errors import SetupError

WHEELS = "wheels"

# Set in every process that runs in an environment made of the wheels.
WHEELS_MARK = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"


def find_ros(environment: Mapping[str, str]) -> str:
    """Decide where ROS comes from.

    Args:
        environment: the shell's variables.

    Returns:
        `WHEELS`, or the prefixes of the sourced ROS as AMENT_PREFIX_PATH names them.

    Raises:
        SetupError: another distribution than Jazzy is sourced.
    """
    distribution = environment.get("ROS_DISTRO", "")
    # Within an environment of wheels (a test that starts satform, say) these variables are that one's own.
    if not distribution or WHEELS_MARK in environment:
        return WHEELS
    if distribution != "jazzy":
        raise SetupError(
            f"this shell has sourced ROS 2 {distribution} and satform needs Jazzy; open a shell that sources "
            "no ROS (satform then installs its own), or run: source /opt/ros/jazzy/setup.bash"
        )
    prefixes = environment.get("AMENT_PREFIX_PATH", "")
    if not prefixes:
        raise SetupError(
            "ROS_DISTRO is jazzy but AMENT_PREFIX_PATH is empty; run: source /opt/ros/jazzy/setup.bash "
            "(or, to use the ROS that satform installs: unset ROS_DISTRO)"
        )
    return prefixes


def check_python_of_ros(ros: str, version: tuple[int, int]) -> None:
    """Refuse a Python that cannot load the sourced ROS.

    Args:
        ros: where ROS comes from, see `find_ros`.
        version: the Python the environment would be made with, e.g. (3, 12).

    Raises:
        SetupError: the sourced ROS was built for another Python.
    """
    if ros == WHEELS:
        return
    for prefix in map(Path, ros.split(":")):
        for package in prefix.glob("lib/python3.*/*-packages/rclpy"):
            built_for = re.fullmatch(r"python3\.(\d+)", package.parts[-3])
            if built_for and version != (3, int(built_for[1])):
                raise SetupError(
                    f"the ROS 2 in {prefix} needs Python 3.{built_for[1]}, the first one on the PATH "
                    f"is {version[0]}.{version[1]}; put the system's own first: export PATH=/usr/bin:$PATH"
                )
