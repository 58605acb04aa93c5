# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The formation about one satellite: plant, neighbours and recorder as nodes of this process.

Nothing is published but what a rule asks for: a message can be left out, repeated, or published late.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from satform_msgs.msg import Command, FormationStatus, NodeReady

from satform.communication import topic_table
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import (
    PLANT,
    RECORDER,
    channels,
    published_by,
    relative,
    subscribed_by,
    topic_name,
)
from satform.flight.compile import FormationPlan
from satform.flight.plant import Plant
from satform.membership.formation import Event, Formation, SatelliteLost, SatelliteRejoined
from satform.membership.membership_manager import Change
from satform_nodes.plant.publishers import PlantPublishers
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.missing_endpoints import Shortcoming, shortcomings

_LOOK = 0.02
"""Wall-clock time between two looks at whether something has happened, s."""


class TestedFormation:
    """A formation of which one satellite is tested, and all others are played.

    Attributes:
        name: of the satellite.
        index: of the satellite.
        plant: that moves the satellites; only the tested one is controlled.
        formation: membership and graph.
        commands: that were received, in order.
        announcements: phases or motions that were received, in order.
        ready: `NodeReady` messages that were received, in order.
        neighbours: indices of the in-neighbours that are played.
    """

    def __init__(self, plan: FormationPlan, name: str, context: rclpy.Context, namespace: str = "") -> None:
        """Plant without neighbours and recorder, which come later.

        Args:
            plan: of the flight.
            name: of the satellite.
            context: with the domain of the test.
            namespace: of all nodes; empty for the root.
        """
        self.name, self.index = name, plan.names.index(name)
        self.plant = Plant(plan.plant)
        self.formation = Formation.of(plan.membership)
        self.commands: list[Command] = []
        self.announcements: list[Any] = []
        self.ready: list[NodeReady] = []
        self.neighbours: list[int] = []
        self._plan, self._context, self._namespace = plan, context, namespace
        self._table = channels(plan.topics)
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._kind = topic_types.TYPES[plan.announces]
        self._executor = SingleThreadedExecutor(context=context)
        self._nodes: dict[str, Any] = {}
        self._neighbour_publishers: dict[int, Any] = {}
        self._change: tuple[Change, tuple[Command, ...]] = (Change((), ()), ())
        plant = self._node(PLANT)
        self._publishers = PlantPublishers(plant, plan, self.plant, published_by(PLANT, self._table))
        self._subscribe(plant, NodeReady, topic_table.NODE_READY, self.ready.append, qos.LATCHED_READER)
        self._subscribe(
            plant, Command, topic_name("command", name), self.commands.append, qos.LOCKSTEP_READER
        )

    def _node(self, name: str) -> Node:
        node = Node(
            name,
            context=self._context,
            namespace=self._namespace or None,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._nodes[name] = node
        self._executor.add_node(node)
        return node

    @staticmethod
    def _subscribe(node: Node, kind: Any, topic: str, callback: Callable[[Any], None], profile: Any) -> None:
        node.create_subscription(kind, relative(topic), callback, profile)

    def add_others(self) -> None:
        """Make the neighbours and the recorder, with all endpoints that the satellite has to wait for."""
        own = topic_name(self._plan.announces, self.name)
        adjacency = self.formation.graph.adjacency
        for index, name in enumerate(self._plan.names):
            if index == self.index:
                continue
            node = self._node(name)
            if adjacency[self.index, index]:
                self.neighbours.append(index)
            self._add_publisher(index)
            if adjacency[index, self.index]:
                self._subscribe(node, self._kind, own, lambda _message: None, qos.LOCKSTEP_READER)
        recorder = self._node(RECORDER)
        recorded = subscribed_by(RECORDER, published_by(self.name, self._table))
        for channel in recorded:
            latched = channel.rhythm == "occasional"
            callback = self.announcements.append if channel.topic == own else lambda _message: None
            profile = qos.LATCHED_READER if latched and channel.kind != "diagnostics" else qos.LOCKSTEP_READER
            self._subscribe(recorder, topic_types.TYPES[channel.kind], channel.topic, callback, profile)

    def _add_publisher(self, index: int) -> None:
        """Have a played satellite publish its phase or motion."""
        topic = relative(topic_name(self._plan.announces, self._plan.names[index]))
        node = self._nodes[self._plan.names[index]]
        self._neighbour_publishers[index] = node.create_publisher(self._kind, topic, qos.LOCKSTEP)

    def name_of(self, index: int) -> str:
        """Name of a satellite."""
        return self._plan.names[index]

    def spin(self, seconds: float, until: Callable[[], object] = lambda: False) -> bool:
        """Receive for a wall-clock time in s, or until something has happened; whether it has."""
        end = time.monotonic() + seconds
        while not until():
            left = end - time.monotonic()
            if left <= 0.0:
                return bool(until())
            self._executor.spin_once(timeout_sec=min(left, _LOOK))
        return True

    @property
    def full_name(self) -> str:
        """Name of the satellite's node with its namespace."""
        return f"{self._nodes[PLANT].get_namespace().rstrip('/')}/{self.name}"

    @property
    def node_is_there(self) -> bool:
        """Whether a node of the satellite's name has been discovered."""
        plant = self._nodes[PLANT]
        return (self.name, plant.get_namespace()) in plant.get_node_names_and_namespaces()

    @property
    def readiness_matched(self) -> bool:
        """Whether a publisher of `NodeReady` has been discovered."""
        return bool(self._nodes[PLANT].count_publishers(relative(topic_table.NODE_READY)))

    def shortcomings(self) -> list[Shortcoming]:
        """What the satellite's node lacks, or has of another type or QoS."""
        table = [
            channel for channel in self._table if self.name in (*channel.publishers, *channel.subscribers)
        ]
        found = shortcomings(self._nodes[PLANT], table, recorded=True)
        return [each for each in found if each.node == self.name]

    # What the others publish

    def status(self, phase: int = FormationStatus.FLYING, reason: str = "") -> None:
        """Publish the present formation."""
        self._publishers.publish_status(self.formation, phase, reason)

    def repeat_status(self) -> None:
        """Publish the last status again."""
        self._publishers.republish_status()

    def change(self, events: Sequence[Event], final_commands: Sequence[Command] = ()) -> None:
        """Change the formation from the present step on; the status is published by `announce_change`."""
        changes = self.formation.apply(events, self.plant.step, list(self._plan.names))
        lost = tuple(event.satellite for event in changes if isinstance(event, SatelliteLost))
        rejoined = tuple(event for event in changes if isinstance(event, SatelliteRejoined))
        self._change = (Change(lost, rejoined), tuple(final_commands))

    def announce_change(self) -> None:
        """Publish the status of the last change."""
        change, final_commands = self._change
        reason = self.formation.reason
        self._publishers.publish_status(
            self.formation, FormationStatus.FLYING, reason, change, final_commands
        )

    def states(self) -> None:
        """Publish the states of the present step."""
        self._publishers.publish_states(self.formation.number)

    def repeat_state(self) -> None:
        """Publish the state of the present step again."""
        self._publishers.retransmit_states([self.index])

    def neighbour_messages(self, step: int, senders: Iterable[int]) -> None:
        """Publish the messages of played satellites for a step."""
        for index in senders:
            self._neighbour_publishers[index].publish(self._neighbour_message(index, step))

    def _neighbour_message(self, index: int, step: int) -> Any:
        message = self._kind(step=step)
        message.header.stamp.sec, message.header.stamp.nanosec = self._stamps.at(step)
        message.header.frame_id = topic_table.FRAME
        if self._plan.announces == "arc_length":
            own = self._plan.satellite(index)
            rate = float(own.nominal_rate)
            begin = float(own.arc_length) - float(own.phase_offset)
            message.arc_length, message.rate = begin + rate * step * self._plan.timing.step, rate
            return message
        motion = self.plant.motion()
        position, velocity = motion.position[index].tolist(), motion.velocity[index].tolist()
        for vector, values in ((message.position, position), (message.velocity, velocity)):
            vector.x, vector.y, vector.z = values
        return message

    def final_command(self, index: int, step: int) -> Command:
        """The last command of a played satellite that is lost at a step, with its message for this step."""
        command = Command(step=step - 1)
        command.header.stamp.sec, command.header.stamp.nanosec = self._stamps.at(step - 1)
        command.header.frame_id = topic_table.FRAME
        announced = self._neighbour_message(index, step)
        command.announced_at = announced.header.stamp
        if self._plan.announces == "arc_length":
            command.announced_arc_length, command.announced_rate = announced.arc_length, announced.rate
        else:
            command.announced_position, command.announced_velocity = announced.position, announced.velocity
        return command

    def advance(self) -> None:
        """Take a step with the last command of the satellite; the others are not controlled."""
        acceleration, torque = self.plant.applied * 0.0, self.plant.applied * 0.0
        if self.commands and self.commands[-1].step == self.plant.step:
            command = self.commands[-1]
            acceleration[self.index] = _vector(command.acceleration)
            torque[self.index] = _vector(command.wheel_torque)
        self.plant.advance(acceleration, torque)

    def contradicts(self, message: Any, step: int, *, exact: bool) -> bool:
        """Whether a message of a step cannot have its stamp."""
        stamp = message.header.stamp
        return self._stamps.contradict(stamp.sec, stamp.nanosec, step, exact=exact)

    def close(self) -> None:
        """Take all nodes down."""
        self._executor.shutdown(timeout_sec=0.0)
        for node in self._nodes.values():
            node.destroy_node()


def _vector(values: Any) -> list[float]:
    return [values.x, values.y, values.z]
