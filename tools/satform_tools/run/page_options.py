# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""How the live page is served."""

from dataclasses import dataclass

LOOPBACK = "127.0.0.1"
"""Address of this machine that no other one can reach."""


@dataclass(frozen=True)
class PageOptions:
    """How the page of a flight is served.

    Attributes:
        address: IP address of this machine.
        port: 0 for any that is free.
        control: whether viewers may control the flight.
        foxglove: whether the topics are served to Foxglove instead.
    """

    address: str = LOOPBACK
    port: int = 0
    control: bool = False
    foxglove: bool = False
