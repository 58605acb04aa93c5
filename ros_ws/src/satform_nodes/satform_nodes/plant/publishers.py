# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishers of the plant: states, attitudes, applied thrust, clock, formation status."""

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from satform_msgs.msg import (
    Attitude,
    Command,
    FormationStatus,
    OrbitState,
    Propulsion,
    RelativeState,
    SatelliteTarget,
)
from satform_msgs.msg import EarlyEnd as EarlyEndMessage

from satform.communication import topic_table
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import Channel, relative, topic_name
from satform.flight.compile import FormationPlan
from satform.flight.geodetic_fixes import GeodeticFixes
from satform.flight.plant import Plant
from satform.membership.formation import Formation
from satform.membership.membership_manager import Change
from satform.record.early_end import EarlyEnd
from satform_nodes.plant.sensor_messages import SensorMessages
from satform_nodes.runtime.lifecycle import wait_for_acknowledgement
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.matched_endpoints import MatchedEndpoints
from satform_nodes.transport.message_forms import form_of
from satform_nodes.transport.node_names import local_name

_STATE = layout(RelativeState, topic_table.FRAME)
_ATTITUDE = layout(Attitude, topic_table.FRAME)
_PROPULSION = layout(Propulsion, topic_table.FRAME)
_ORBIT = layout(OrbitState, topic_table.INERTIAL_FRAME)

_NOTHING = Change((), ())
"""No change of the formation."""

_ACKNOWLEDGEMENT_TIMEOUT = 5.0
"""Timeout of the acknowledgements of the final status, s."""


class PlantPublishers:
    """The plant's publishers, with its last messages for retransmission."""

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
        self._topics = plan.topics
        # Messages to each satellite at this step, for retransmission.
        self._last_messages: dict[int, list[bytes]] = {}
        self._status = FormationStatus()
        # Diagnostics are published by `Health`.
        self._channels = [channel for channel in channels if channel.kind != "diagnostics"]
        publishers = self._publishers = {
            channel.topic: node.create_publisher(
                topic_types.TYPES[channel.kind],
                relative(channel.topic),
                qos.PUBLISHER_BY_RHYTHM[channel.rhythm],
            )
            for channel in self._channels
        }

        def of_satellites(kind: str) -> dict[int, Any]:
            """The publishers of a kind by the satellites' indices."""
            named = {index: topic_name(kind, name) for index, name in enumerate(self._names)}
            return {index: publishers[own] for index, own in named.items() if own in publishers}

        self._clock_publisher, self._status_publisher = (
            publishers[topic_table.CLOCK],
            publishers[topic_table.STATUS],
        )
        self._state_publishers = list(of_satellites("state").values())
        self._attitude_publishers = of_satellites("attitude")
        self._link_publishers = of_satellites("link_conditions")
        self._reading_publishers = of_satellites("measurements")
        self._truth_publishers = of_satellites("truth")
        self._orbit_publishers = of_satellites("orbit_state")
        self._orbits = plan.orbit_states
        self._geodetic = None if plan.geodetic is None else GeodeticFixes(plan.geodetic)
        self._sensor_messages = SensorMessages(plan.topics, publishers, self._stamps, self._geodetic)
        self._propulsion_publishers = list(of_satellites("propulsion").values())

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

    # At each step

    def publish_states(self, number: int) -> None:
        """Publish the states of a step, measured to the satellites and true to observers, and the clock.

        Args:
            number: formation version of this step.
        """
        step, stamps = self._plant.step, self._stamps
        seconds, nanoseconds = stamps.at(step)
        measured, moments = self._plant.measured(), self._plant.measured_steps()
        applied = self._plant.applied.tolist()
        for index, (publisher, moment, position, velocity) in enumerate(
            zip(
                self._state_publishers,
                moments.tolist(),
                measured.position.tolist(),
                measured.velocity.tolist(),
                strict=True,
            )
        ):
            data = _STATE.pack(*stamps.at(moment), step, number, *position, *velocity, *applied[index])
            self._last_messages[index] = [data]
            publisher.publish(data)
        self._publish_attitudes(seconds, nanoseconds, step)
        self._publish_links(seconds, nanoseconds, step)
        self._publish_readings(seconds, nanoseconds, step)
        truth = self._plant.motion()
        for index, publisher in self._truth_publishers.items():
            position, velocity = truth.position[index].tolist(), truth.velocity[index].tolist()
            moved = (*position, *velocity, *applied[index])
            publisher.publish(_STATE.pack(seconds, nanoseconds, step, number, *moved))
        self._publish_orbits(seconds, nanoseconds, step)
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = seconds, nanoseconds
        self._clock_publisher.publish(clock)

    def _publish_orbits(self, seconds: int, nanoseconds: int, step: int) -> None:
        if self._orbits is None:
            return
        found = np.concatenate(self._orbits.at(self._plant), axis=-1).tolist()
        for index, publisher in self._orbit_publishers.items():
            publisher.publish(_ORBIT.pack(seconds, nanoseconds, step, *found[index]))

    def _publish_attitudes(self, seconds: int, nanoseconds: int, step: int) -> None:
        attitude = self._plant.attitude()
        if attitude is None:
            return
        limits = self._plant.wheel_limits().astype(np.uint64).tolist()
        for index, publisher in self._attitude_publishers.items():
            turned = (
                *attitude.mrp[index].tolist(),
                *attitude.angular_velocity[index].tolist(),
                *attitude.wheel_momentum[index].tolist(),
            )
            data = _ATTITUDE.pack(seconds, nanoseconds, step, *turned, *limits[index])
            self._last_messages[index].append(data)
            publisher.publish(data)

    def _publish_links(self, seconds: int, nanoseconds: int, step: int) -> None:
        conditions = self._plant.link_conditions()
        if conditions is None:
            return
        for index, publisher in self._link_publishers.items():
            loss, light_time = conditions.loss[index].tolist(), conditions.light_time[index].tolist()
            data = form_of("link_conditions", self._topics, index).pack(
                seconds, nanoseconds, step, len(loss), *loss, len(light_time), *light_time
            )
            self._last_messages[index].append(data)
            publisher.publish(data)

    def _publish_readings(self, seconds: int, nanoseconds: int, step: int) -> None:
        for index, readings in self._plant.readings().items():
            form = form_of("measurements", self._topics, index)
            data = form.pack(seconds, nanoseconds, step, len(readings), *readings.tolist())
            self._last_messages[index].append(data)
            self._reading_publishers[index].publish(data)
        if self._geodetic is not None:
            self._geodetic.note(self._plant)
        self._sensor_messages.publish(self._plant.readings(), step)

    def retransmit_states(self, satellites: Iterable[int]) -> None:
        """Retransmit the messages of this step to some satellites."""
        for index in satellites:
            of_kinds = (self._attitude_publishers, self._link_publishers, self._reading_publishers)
            own = [publishers[index] for publishers in of_kinds if index in publishers]
            publishers = [self._state_publishers[index], *own]
            for publisher, data in zip(publishers, self._last_messages.get(index, []), strict=False):
                publisher.publish(data)

    def publish_propulsion(self) -> None:
        """Publish the applied thrust of the step that was just taken."""
        thrusters = self._plant.thrusters
        if thrusters is None:
            return
        step = self._plant.step - 1
        seconds, nanoseconds = self._stamps.at(step)
        state = thrusters.propulsion
        applied = self._plant.applied[thrusters.members].tolist()
        counters = np.stack(
            (state.saturated_steps, state.below_minimum_impulse_steps, state.propellant_depleted_steps),
            axis=-1,
        ).astype(np.uint64)
        for publisher, acceleration, delta_v, propellant, counts in zip(
            self._propulsion_publishers,
            applied,
            state.delta_v.tolist(),
            state.propellant.tolist(),
            counters.tolist(),
            strict=True,
        ):
            publisher.publish(
                _PROPULSION.pack(seconds, nanoseconds, step, *acceleration, delta_v, propellant, *counts)
            )

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

        step_publishers: list[Any] = [] if recorded else [*self._state_publishers, self._clock_publisher]
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
