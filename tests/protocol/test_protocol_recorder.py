# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""In whatever order messages reach the recorder, it reports a step only when it has all messages up to it.

The statuses are those of all flights that the explorer finds. Of these flights follows what each node publishes;
the recorder gets the messages of a topic in order, and those of different topics in every order.
"""

import copy
from collections import deque
from dataclasses import dataclass
from typing import Any

import pytest
from protocol_processes import PlantProcess
from protocol_search import CompiledExplorer
from rclpy.serialization import deserialize_message
from satform_msgs.msg import FormationStatus
from test_protocol_explored import flight

from satform.communication.topic_table import RECORDER, channels, subscribed_by
from satform.flight.compile import FormationPlan, compile_scenario
from satform.protocol.recorder_steps import RecorderSteps, SteppedTopic

KINDS = ("state", "command", "arc_length")
"""Topics of each satellite that take part, beside the status."""


@dataclass
class Flight:
    """What is published in a flight.

    Attributes:
        plan: of its parts.
        statuses: of the plant, in order.
        steps: of each topic that is recorded, the steps of its messages in order.
        needed: of each topic, the steps of those messages that belong to the flight.
    """

    plan: FormationPlan
    statuses: list[Any]
    steps: list[list[int]]
    needed: list[set[int]]


class Bag:
    """Stands for the recorder's node."""

    def __init__(self) -> None:
        self.progress: list[int] = []

    def publish_progress(self, step: int) -> None:
        """Note it."""
        self.progress.append(step)


def followed(plan: FormationPlan) -> list[Any]:
    """The topics of `KINDS` that the recorder follows."""
    return [channel for channel in subscribed_by(RECORDER, channels(plan.topics)) if channel.kind in KINDS]
