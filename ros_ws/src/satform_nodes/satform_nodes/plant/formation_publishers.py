# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishers of the plant about the formation as a whole: status and clock."""

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import Command, FormationStatus, SatelliteTarget
from satform_msgs.msg import EarlyEnd as EarlyEndMessage

from satform.communication import topic_table
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import Channel, relative
from satform.flight.compile import FormationPlan
from satform.flight.plant import Plant
from satform.membership.formation import Formation
from satform.membership.membership_manager import Change
from satform.record.early_end import EarlyEnd
from satform_nodes.runtime.lifecycle import wait_for_acknowledgement
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.node_names import local_name

_NOTHING = Change((), ())
"""No change of the formation."""

_ACKNOWLEDGEMENT_TIMEOUT = 5.0
"""Timeout of the acknowledgements of the final status, s."""


class FormationPublishers:
    """The plant's publishers; what is published of states is in the classes that inherit this one."""

    def __init__(self, node: Node, plan: FormationPlan, plant: Plant, channels: Iterable[Channel]) -> None:
        """Nothing has been published yet.

        Args:
            node: of the plant.
            plan: of the flight's parts.
            plant: whose states are published.
            channels: the topics on which the plant publishes.
        """
        self._node = node
        self._plant = plant
        self._names = list(plan.names)
        self._last_step = plan.timing.steps
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._status = FormationStatus()
        # Diagnostics are published by `Health`.
        self._channels = [channel for channel in channels if channel.kind != "diagnostics"]
        self._publishers: dict[str, Any] = {
            channel.topic: node.create_publisher(
                topic_types.TYPES[channel.kind], relative(channel.topic), qos.publisher_profile(channel)
            )
            for channel in self._channels
        }
        self._clock_publisher = self._publishers[topic_table.CLOCK]
        self._status_publisher = self._publishers[topic_table.STATUS]

    @property
    def _state_topics(self) -> list[Any]:
        """Publishers of the states that satellites wait for."""
        raise NotImplementedError

    def require_subscribers(self, endpoints: MatchedEndpoints, *, recorded: bool) -> None:
        """Require the subscribers of the plant's topics.

        Args:
            endpoints: gets them.
            recorded: whether a recorder subscribes, too.
        """
        for channel in self._channels:
            endpoints.require_subscribers(
                self._publishers[channel.topic], channel.required_subscribers(recorded=recorded)
            )

    def publish_states(self, number: int) -> None:
        """Publish the states of a step, with the formation version of this step."""
        raise NotImplementedError

    def retransmit_states(self, satellites: Iterable[int]) -> None:
        """Retransmit the messages of this step to some satellites."""
        raise NotImplementedError

    def publish_propulsion(self) -> None:
        """Publish the applied thrust of the step that was just taken."""

    def _publish_clock(self, seconds: int, nanoseconds: int) -> None:
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = seconds, nanoseconds
        self._clock_publisher.publish(clock)

    # Now and then

    def publish_status(
        self,
        formation: Formation,
        phase: int,
        reason: str,
        change: Change = _NOTHING,
        final_commands: Sequence[Command] = (),
        early_end: EarlyEnd | None = None,
    ) -> None:
        """Publish the status of the formation.

        Args:
            formation: membership and communication graph.
            phase: of the flight.
            reason: of this phase, as text.
            change: of the formation at this step.
            final_commands: the last command of each satellite that is lost now.
            early_end: why the flight ends now before its last step; None when it does not.
        """
        receivers, senders = np.nonzero(formation.graph.adjacency)
        self._status = FormationStatus(
            step=self._plant.step,
            version=formation.number,
            phase=phase,
            last_step=self._last_step,
            satellites=self._names,
            alive=formation.alive.tolist(),
            edge_receivers=receivers.tolist(),
            edge_senders=senders.tolist(),
            algebraic_connectivity=float(formation.connectivity),
            lost=[self._names[index] for index in change.lost],
            final_commands=list(final_commands),
            rejoined=[self._names[event.satellite] for event in change.rejoined],
            rejoin_checkpoints=[
                -1 if event.checkpoint is None else event.checkpoint for event in change.rejoined
            ],
            targets=[
                SatelliteTarget(
                    satellite=self._names[index],
                    since=target.since,
                    target=target.spec.to_text(),
                    fields=sorted(target.fields),
                )
                for index, target in sorted(formation.targets.items())
            ],
            early_end=[] if early_end is None else [_early_end_message(early_end)],
            reason=reason,
        )
        seconds, nanoseconds = self._stamps.at(self._plant.step)
        self._status.header.stamp.sec, self._status.header.stamp.nanosec = seconds, nanoseconds
        self._status.header.frame_id = topic_table.FRAME
        self.republish_status()

    def republish_status(self) -> None:
        """Publish the last status again."""
        self._status_publisher.publish(self._status)

    def wait_for_acknowledgement(self, others: Collection[str], *, recorded: bool) -> bool:
        """Wait until the last messages are acknowledged, for a bounded time.

        Args:
            others: names of required subscribers; if none of them is present, the wait ends.
            recorded: whether all steps are in a bag, so that no state is unacknowledged.

        Returns:
            False after the timeout.
        """

        def present() -> bool:
            subscribers = self._node.get_subscriptions_info_by_topic(self._status_publisher.topic_name)
            return any(local_name(other, self._node.get_namespace()) in others for other in subscribers)

        step_publishers: list[Any] = [] if recorded else [*self._state_topics, self._clock_publisher]
        return wait_for_acknowledgement(
            (self._status_publisher, *step_publishers), present, _ACKNOWLEDGEMENT_TIMEOUT
        )


def _early_end_message(end: EarlyEnd) -> EarlyEndMessage:
    return EarlyEndMessage(
        satellite=end.satellite,
        quantity=end.quantity,
        step=end.step,
        value=end.value,
        limit=end.limit,
        unit=end.unit,
        cause=end.cause,
    )
