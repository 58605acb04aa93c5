# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What has to be so before a flight over DDS can start on this machine."""

from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.run import ros_packages


def prepare(*, secured: bool) -> None:
    """Check that a flight over DDS can start, and let the process server import while this process goes on.

    Args:
        secured: whether it is flown with keys.

    Raises:
        CommandError: a flight cannot work here.
    """
    ros_packages.require()
    from satform_bringup.deployment import preflight  # noqa: PLC0415 - needs ROS
    from satform_bringup.supervisor import process_server  # noqa: PLC0415 - likewise

    try:
        preflight.require(secured=secured)
    except preflight.PreflightError as error:
        raise CommandError(str(error)) from None
    for name in preflight.unused_variables():
        console.note(f"{name} is set; the nodes of a flight ignore it")
    if sentence := preflight.shared_memory():
        console.note(sentence)
    preflight.remove_unused_variables()
    process_server.prepare()
