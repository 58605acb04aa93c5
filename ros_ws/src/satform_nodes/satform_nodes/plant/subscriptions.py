# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions of the plant to the commands of each satellite."""

import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rclpy.node import Node
from satform_msgs.msg import Command

from satform.communication import topic_table
from satform.communication.message_validator import MessageRules, RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import Channel, topic_name
from satform.membership.membership_manager import MembershipManager
from satform.protocol.plant_commands import PlantCommands
from satform_nodes.plant.formation_subscriptions import FormationSubscriptions
from satform_nodes.transport import qos
from satform_nodes.transport.authorised_publishers import AuthorisedPublishers
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.compiled import new_validator
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.fast_path import MANY_SUBSCRIPTIONS

_COMMAND = layout(Command, topic_table.FRAME)
_COMMAND_RULES = MessageRules(unbounded=(len(_COMMAND.fields) - 1, len(_COMMAND.fields)))
"""One field of a command may have any value: what a satellite reports as beyond every limit."""


class PlantSubscriptions(FormationSubscriptions):
    """The plant's subscriptions, and the values received on them.

    Attributes:
        commands: of all satellites for the present step.
    """

    def __init__(
        self,
        node: Node,
        executor: StepExecutor,
        channels: Iterable[Channel],
        membership: MembershipManager,
        rejections: RejectionCounter,
        on_command: Callable[[int, bytes], None],
        on_offer: Callable[[str, int], None],
        on_other_interface: Callable[[str, int], None],
        stamps: Stamps,
        *,
        clocked: bool,
    ) -> None:
        """Nothing has been received yet.

        Args:
            node: of the plant.
            executor: hands out the messages.
            channels: the topics to which the plant subscribes.
            membership: is updated with each command, and knows which commands are missing.
            rejections: counts rejected messages.
            on_command: called with the index of a satellite and a command message of its node.
            on_offer: called with the name of a node that is ready, and the step of its checkpoint.
            on_other_interface: called with the name of a node that was written by another version of the
                interface, and that version.
            stamps: of the scenario's steps.
            clocked: whether the flight goes by the wall clock.
        """
        channels = list(channels)
        names = membership.names
        super().__init__(
            node, executor, channels, len(names), rejections, on_offer, on_other_interface, stamps
        )
        self._membership = membership
        self._on_command = on_command
        self._clocked = clocked
        self._turn = (-1, 0)
        self._flying: tuple[int, list[Any]] = (-1, [])
        self._received_at = [time.monotonic()] * len(names)
        authorised = {channel.topic: channel.publishers for channel in channels}
        commands = [topic_name("command", name) for name in names]
        self._authorised = [
            AuthorisedPublishers(node, topic, authorised[topic], rejections) for topic in commands
        ]
        validators = [
            new_validator(topic, _COMMAND, rejections, stamps, _COMMAND_RULES) for topic in commands
        ]
        self.commands = PlantCommands(
            membership, _COMMAND, validators, rejections, self.command_monitor, clocked=clocked
        )
        self._subscriptions = [
            executor.subscribe(
                node,
                Command,
                topic,
                partial(self._note_command, index),
                qos.REALTIME if clocked else qos.LOCKSTEP_READER,
                self._authorised[index],
            )
            for index, topic in enumerate(commands)
        ]
        self._commands = list(zip(self._subscriptions, self._authorised, strict=True))

    def begin(self) -> None:
        """Start the flight: from now on commands are waited for."""
        self.command_monitor.begin()
        if not self._clocked:
            self._executor.await_together(self._lacking)
        if len(self._subscriptions) >= MANY_SUBSCRIPTIONS and not self._clocked:
            self._executor.await_in_turn(self._next_awaited)

    def _lacking(self) -> list[Any] | None:
        """Subscriptions of the satellites whose commands are due; None when none is."""
        membership = self._membership
        if membership.open or membership.over:
            return None
        number = membership.formation.number
        if number != self._flying[0]:
            self._flying = (number, [self._subscriptions[index] for index in membership.flying])
        if not membership.commanded:
            return self._flying[1]
        return [self._subscriptions[index] for index in membership.not_commanded]

    def _next_awaited(self) -> Any:
        """The subscription of the last satellite whose command is due; None when none is.

        It receives its state after all others: when its command arrives, theirs usually have.
        """
        membership = self._membership
        if membership.open or membership.over:
            return None
        step, index = self._turn
        if step != membership.step:
            index = len(self._subscriptions) - 1
        commanded, alive = membership.commanded, membership.formation.alive
        while index >= 0 and (index in commanded or not alive[index]):
            index -= 1
        self._turn = (membership.step, index)
        return self._subscriptions[index] if index >= 0 else None

    def allow_replacement(self, lost: Iterable[int]) -> None:
        """Accept restarted processes of lost satellites as publishers."""
        for index in lost:
            name = self._membership.names[index]
            self._authorised[index].allow_replacement(name)
            self._authorised_ready.allow_replacement(name)

    def unresponsive(self, names: Iterable[str], timeout: float) -> list[str]:
        """Those of some nodes that have not even retransmitted.

        A satellite that waits for a neighbour's message does not command, but retransmits its last messages.

        Args:
            names: of nodes that keep a step from going on.
            timeout: wall-clock time without a message, s.
        """
        now = time.monotonic()
        indices = {name: index for index, name in enumerate(self._membership.names)}
        return [
            name for name in names if name not in indices or now - self._received_at[indices[name]] >= timeout
        ]

    def _note_command(self, index: int, data: bytes, _name: str) -> None:
        self._received_at[index] = time.monotonic()
        self._on_command(index, data)
