# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Endpoints of the plant where groups of satellites exchange arrays: states of a group out, commands in."""

import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rclpy.node import Node

from satform.communication.message_validator import RejectionCounter
from satform.communication.satellite_groups import SatelliteGroups
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import Channel
from satform.flight.compile import FormationPlan
from satform.flight.plant import Plant
from satform.membership.membership_manager import MembershipManager
from satform.protocol.group_commands import GroupCommands
from satform_nodes.plant.formation_publishers import FormationPublishers
from satform_nodes.plant.formation_subscriptions import FormationSubscriptions
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.message_forms import array_form_of, array_validator_of


class GroupSubscriptions(FormationSubscriptions):
    """The plant's subscriptions to the commands of groups.

    Attributes:
        commands: of all satellites for the present step.
    """

    def __init__(
        self,
        node: Node,
        executor: StepExecutor,
        channels: Iterable[Channel],
        membership: MembershipManager,
        groups: SatelliteGroups,
        rejections: RejectionCounter,
        on_command: Callable[[int, bytes], None],
        on_offer: Callable[[str, int], None],
        on_other_interface: Callable[[str, int], None],
        stamps: Stamps,
    ) -> None:
        """Nothing has been received yet.

        Args:
            node: of the plant.
            executor: hands out the messages.
            channels: the topics to which the plant subscribes.
            membership: is updated with each message, and knows which commands are missing.
            groups: of the satellites.
            rejections: counts rejected messages.
            on_command: called with the index of a group and a command message of its node.
            on_offer: called with the name of a node that is ready, and the step of its checkpoint.
            on_other_interface: called with the name of a node that was written by another version of the
                interface, and that version.
            stamps: of the scenario's steps.
        """
        channels = list(channels)
        super().__init__(
            node, executor, channels, len(membership.names), rejections, on_offer, on_other_interface, stamps
        )
        self._on_command = on_command
        self._received_at = dict.fromkeys(groups.names, time.monotonic())
        own = [channel for channel in channels if channel.kind == "group_command"]
        validators = [array_validator_of(channel, self._rejections, stamps) for channel in own]
        self.commands = GroupCommands(membership, groups, validators, self._rejections, self.command_monitor)
        for index, channel in enumerate(own):
            authorised = AuthorisedPublishers(node, channel.topic, channel.publishers, self._rejections)
            subscription = executor.subscribe(
                node,
                topic_types.TYPES[channel.kind],
                channel.topic,
                partial(self._note_command, index),
                qos.arrays(channel),
                authorised,
            )
            self._commands.append((subscription, authorised))

    def begin(self) -> None:
        """Start the flight: from now on commands are waited for."""
        self._executor.await_together(self._lacking)

    def _lacking(self) -> list[Any] | None:
        """Subscriptions of the groups whose commands are due; None when none is."""
        missing = self.commands.missing
        return [self._commands[index][0] for index in missing] if missing else None

    @property
    def missing_groups(self) -> list[str]:
        """Names of the groups that keep the present step from going on."""
        names = list(self._received_at)
        return [names[index] for index in self.commands.missing]

    def unresponsive(self, names: Iterable[str], timeout: float) -> list[str]:
        """Those of some groups that have not even retransmitted.

        Args:
            names: of nodes that keep a step from going on.
            timeout: wall-clock time without a message, s.
        """
        now = time.monotonic()
        return [name for name in names if now - self._received_at.get(name, 0.0) >= timeout]

    def allow_replacement(self, lost: Iterable[int]) -> None:
        """No process of a group is restarted."""

    def _note_command(self, index: int, data: bytes, name: str) -> None:
        self._received_at[name] = time.monotonic()
        self._on_command(index, data)


class GroupPublishers(FormationPublishers):
    """The plant's publishers of the states of groups, with its last messages for retransmission."""

    def __init__(
        self,
        node: Node,
        plan: FormationPlan,
        plant: Plant,
        channels: Iterable[Channel],
        groups: SatelliteGroups,
    ) -> None:
        """Nothing has been published yet.

        Args:
            node: of the plant.
            plan: of the flight's parts.
            plant: whose states are published.
            channels: the topics on which the plant publishes.
            groups: of the satellites.
        """
        super().__init__(node, plan, plant, channels)
        self._own = [channel for channel in self._channels if channel.kind == "group_state"]
        self._forms = [array_form_of(channel) for channel in self._own]
        self._rows = groups.rows
        self._last_messages: list[bytes] = []

    @property
    def _state_topics(self) -> list[Any]:
        return [self._publishers[channel.topic] for channel in self._own]

    def publish_states(self, number: int) -> None:
        """Publish the states of a step, and the clock.

        Args:
            number: formation version of this step.
        """
        step = self._plant.step
        stamp = self._stamps.at(step)
        motion, applied = self._plant.motion(), self._plant.applied
        self._last_messages = []
        for channel, form, rows in zip(self._own, self._forms, self._rows, strict=True):
            data = form.pack(
                stamp,
                {
                    "step": step,
                    "formation_version": number,
                    "position": motion.position[rows],
                    "velocity": motion.velocity[rows],
                    "applied_acceleration": applied[rows],
                },
            )
            self._last_messages.append(data)
            self._publishers[channel.topic].publish(data)
        self._publish_clock(*stamp)

    def retransmit_states(self, satellites: Iterable[int]) -> None:
        """Retransmit the states of this step to all groups; those that have answered drop it."""
        if any(True for _ in satellites):
            for channel, data in zip(self._own, self._last_messages, strict=False):
                self._publishers[channel.topic].publish(data)
