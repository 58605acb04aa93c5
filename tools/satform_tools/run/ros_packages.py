# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks that ROS 2 and the ROS packages of the project are installed."""

from importlib.util import find_spec

from satform_tools.errors import CommandError

_NEEDED = ("rclpy", "satform_msgs", "satform_nodes", "satform_bringup")


def require() -> None:
    """Require ROS 2 and the project's own ROS packages.

    Raises:
        CommandError: one of them is missing.
    """
    missing = next((name for name in _NEEDED if find_spec(name) is None), None)
    if missing:
        raise CommandError(
            f"ROS 2 is not in this environment (there is no {missing}); start with ./tools/satform, "
            "or use --mode inprocess"
        )
