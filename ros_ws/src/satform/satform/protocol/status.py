# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What the protocol reads of the messages `satform_msgs/msg/FormationStatus` and `Command`."""

from enum import IntEnum
from typing import Any, TypeAlias

FormationStatus: TypeAlias = Any
"""A message satform_msgs/msg/FormationStatus, or an object with its fields."""

FinalCommand: TypeAlias = Any
"""A message satform_msgs/msg/Command, or an object with its fields."""


class FormationPhase(IntEnum):
    """Phase of a flight, with the constants of `FormationStatus`."""

    WAITING = 0
    FLYING = 1
    FINISHED = 2
    ABORTED = 3
    PAUSED = 4


OVER = (FormationPhase.FINISHED, FormationPhase.ABORTED)
"""Phases after which nothing follows."""
