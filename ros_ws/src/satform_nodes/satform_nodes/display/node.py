# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Node of the display: publishes markers, poses, paths and transforms for RViz and Foxglove.

It is an observer: it takes the newest message of each topic by best effort, so that no other node waits for
it, and a flight is the same with and without it.
"""

import math
import os
import sys
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from satform_msgs.msg import FormationStatus

from satform.common.exit_codes import EXIT_BAD_INPUT, EXIT_DONE, EXIT_LOST, EXIT_STOPPED
from satform.communication import topic_table
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import relative, topic_name
from satform.display.scene import Scene
from satform.flight.compile import FormationPlan
from satform_nodes.display.markers import MarkerMessages
from satform_nodes.runtime.lifecycle import discovery_timeout, plan_of, plant_timeout, run
from satform_nodes.runtime.parameters import declare_start
from satform_nodes.runtime.signals import StopRequest
from satform_nodes.runtime.start_parameters import START_PARAMETERS
from satform_nodes.runtime.supervisor_pipe import SupervisorPipe
from satform_nodes.transport import qos, topic_types
from satform_nodes.transport.cdr_codec import layout
from satform_nodes.transport.executor import StepExecutor
from satform_nodes.transport.node_error import NodeError

_PATH_EVERY = 10
"""Frames between two publications of the paths, which are long."""

_FORMER_FRAMES = "frames_per_lap"
"""Name of the parameter `frames_per_period` in version 0.1.0."""

_NICENESS = 10
"""Niceness of the display, so that it yields the processor to the flight."""

_POLLING_PERIOD = 0.02
"""Wall-clock time between two polls: messages in between are not taken, s."""

_MOTION = tuple(f"{vector}.{axis}" for vector in ("position", "velocity") for axis in "xyz")
_MRP = ("mrp.x", "mrp.y", "mrp.z")

_LAST_MESSAGES = 0.2
"""Wall-clock time after the end of the flight in which the last states may still arrive, s."""

_ACKNOWLEDGEMENT_TIMEOUT = Duration(seconds=2)
"""Timeout of the acknowledgement of the last frame."""


class DisplayNode:
    """Subscribes to the formation's topics and publishes frames; their content is computed in `satform`."""

    def __init__(self, node: Node, executor: StepExecutor, plan: FormationPlan) -> None:
        scale = _positive(node, "display_scale")
        per_period = round(_positive(node, "frames_per_period"))
        trail = round(_positive(node, "trail"))
        rate = _positive(node, "frame_rate")
        self.node = node
        self.ended: FormationStatus | None = None
        self.received_anything = False
        self.pictures = 0
        self.scene = Scene(plan.scene, max(per_period, 1), max(trail, 2))
        self._stamps = Stamps(plan.timing.step, plan.timing.step_nanoseconds)
        self._messages = MarkerMessages(self._stamps, scale, self.scene.extent, node.get_namespace())
        self._period = 1.0 / rate
        self._next_picture = 0.0
        # The newest message of each topic, and its decoder; decoded only for a frame.
        self._newest: dict[int, bytes] = {}
        self._readers: list[Callable[[bytes], None]] = []

        types = topic_types.TYPES
        self._marker_publisher = node.create_publisher(
            types["markers"], relative(topic_table.MARKERS), qos.MARKERS
        )
        self._transform_publisher = node.create_publisher(types["tf"], topic_table.TF, qos.TRANSFORMS)
        self._pose_publishers, self._path_publishers = {}, {}
        for name in self.scene.names:
            self._pose_publishers[name] = node.create_publisher(
                types["pose"], relative(topic_name("pose", name)), qos.MARKERS
            )
            self._path_publishers[name] = node.create_publisher(
                types["path"], relative(topic_name("path", name)), qos.MARKERS
            )
        for index, name in enumerate(self.scene.names):
            spec = plan.topics.satellites[index]
            motion = "truth" if spec.sensor else "state"
            self._subscribe_newest(executor, motion, name, self._on_state(index), _MOTION)
            if spec.attitude:
                self._subscribe_newest(executor, "attitude", name, self._on_attitude(index), _MRP)
            # Decoded last: it is then at least as new as what it is compared with.
            announcement = plan.announces
            self._subscribe_newest(executor, announcement, name, self._on_announcement(index), ())
        node.create_subscription(
            types["status"], relative(topic_table.STATUS), self._on_status, qos.BEST_EFFORT
        )
        # Only a latched reader receives the status from before this node's start, and the plant waits for it
        # at the end of the flight; so this subscription is destroyed after its first message.
        self._history = node.create_subscription(
            types["status"], relative(topic_table.STATUS), self._on_status, qos.LATCHED
        )

    def begin(self, executor: StepExecutor, stop: StopRequest, longest: float) -> None:
        """Wait for the formation to appear.

        Args:
            executor: does the waiting.
            stop: ends it early.
            longest: wall-clock time after which to give up, s.

        Raises:
            NodeError: there is none.
        """
        if not executor.spin_until(lambda: self.received_anything or stop.asked, longest):
            raise NodeError(f"nothing to show within {longest:g} s: no message of a formation", EXIT_LOST)
        self.node.destroy_subscription(self._history)

    def publish_if_due(self) -> None:
        """Publish a picture if enough simulated time has passed, and not too little of the wall clock."""
        now = time.monotonic()
        if now < self._next_picture:
            return
        self._read_newest()
        if self.scene.due:
            self._next_picture = now + self._period
            self.publish(paths=self.pictures % _PATH_EVERY == 0)

    def publish_last(self) -> None:
        """Publish the last frame, and wait for its acknowledgement, for a bounded time."""
        self._read_newest()
        if self.scene.step < 0:
            return
        self.publish(paths=True)
        for publisher in (
            self._marker_publisher,
            *self._pose_publishers.values(),
            *self._path_publishers.values(),
        ):
            if not publisher.wait_for_all_acked(_ACKNOWLEDGEMENT_TIMEOUT):
                return

    def publish(self, *, paths: bool) -> None:
        """Publish a frame of the newest messages."""
        picture = self.scene.picture()
        self.pictures += 1
        self._marker_publisher.publish(self._messages.markers(picture))
        self._transform_publisher.publish(self._messages.transforms(picture))
        for view in picture.satellites:
            self._pose_publishers[view.name].publish(self._messages.pose(view.pose))
            if paths:
                self._path_publishers[view.name].publish(self._messages.path(view))

    def _subscribe_newest(
        self,
        executor: StepExecutor,
        kind: str,
        satellite: str,
        read: Callable[[int, int, int, list[float]], None],
        fields: tuple[str, ...],
    ) -> None:
        """Subscribe to a satellite's topic, and store its newest message until the next frame.

        Args:
            executor: hands out the messages.
            kind: of the topic.
            satellite: that the topic is about.
            read: takes seconds, nanoseconds and step of a message, and the wanted numbers in it.
            fields: names of these numbers.
        """
        form, reader = layout(topic_types.TYPES[kind], topic_table.FRAME), len(self._readers)
        step, *wanted = (form.fields.index(name) for name in ("step", *fields))

        def take_apart(data: bytes) -> None:
            numbers = form.unpack(data)
            if numbers is not None:
                read(numbers[0], numbers[1], numbers[step], [numbers[index] for index in wanted])

        def keep(data: bytes, _name: str) -> None:
            self._newest[reader] = data
            self.received_anything = True

        self._readers.append(take_apart)
        topic = topic_name(kind, satellite)
        executor.subscribe(self.node, topic_types.TYPES[kind], topic, keep, qos.BEST_EFFORT)

    def _read_newest(self) -> None:
        newest, self._newest = self._newest, {}
        for reader, data in newest.items():
            self._readers[reader](data)

    def _on_state(self, index: int) -> Callable[[int, int, int, list[float]], None]:
        def update(seconds: int, nanoseconds: int, _step: int, numbers: list[float]) -> None:
            # A delayed measurement has the time at which it was taken.
            self.scene.set_motion(index, self._stamps.step(seconds, nanoseconds), numbers[:3], numbers[3:])

        return update

    def _on_attitude(self, index: int) -> Callable[[int, int, int, list[float]], None]:
        def update(_seconds: int, _nanoseconds: int, step: int, numbers: list[float]) -> None:
            self.scene.set_attitude(index, step, numbers)

        return update

    def _on_announcement(self, index: int) -> Callable[[int, int, int, list[float]], None]:
        def update(seconds: int, nanoseconds: int, _step: int, _numbers: list[float]) -> None:
            self.scene.note_message(index, self._stamps.time(seconds, nanoseconds))

        return update

    def _on_status(self, status: FormationStatus) -> None:
        self.received_anything = True
        self.scene.set_formation(status.alive, status.edge_receivers, status.edge_senders)
        if status.phase in (FormationStatus.FINISHED, FormationStatus.ABORTED):
            self.ended = status


def fly(node: Node, executor: StepExecutor, stop: StopRequest, _report: SupervisorPipe) -> int:
    """Show the flight until it has ended."""
    os.nice(_NICENESS)
    # rclpy ignores overrides of parameters that are not declared.
    if _FORMER_FRAMES in node._parameter_overrides:
        raise NodeError(f"{_FORMER_FRAMES} is now called frames_per_period", EXIT_BAD_INPUT)
    declare_start(node, "scenario")
    plan = plan_of(node)
    display = DisplayNode(node, executor, plan)
    first = discovery_timeout(plan)
    display.begin(executor, stop, first)

    def flying() -> bool:
        display.publish_if_due()
        return display.ended is None and not stop.asked

    longest = max(first, plant_timeout(plan.timing.node_timeout))
    if not executor.spin_polling(flying, longest, lambda _leisure: stop.pause(_POLLING_PERIOD)):
        raise NodeError(f"nothing to show for {longest:g} s: no message of the formation", EXIT_LOST)
    executor.spin_while(lambda: not stop.asked, _LAST_MESSAGES)
    display.publish_last()
    return EXIT_STOPPED if stop.asked else EXIT_DONE


def _positive(node: Node, name: str) -> float:
    """A number above zero that is given at the start; whole numbers may be written without a point.

    Raises:
        NodeError: it is something else.
    """
    default, description = START_PARAMETERS[name].default, START_PARAMETERS[name].description
    descriptor = ParameterDescriptor(read_only=True, description=description, dynamic_typing=True)
    try:
        value = node.declare_parameter(name, default, descriptor).value
    except ParameterException as error:
        raise NodeError(f"{name}: {error}", EXIT_BAD_INPUT) from None
    number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise NodeError(f"{name} is {value!r}; it is a number above zero: {description}", EXIT_BAD_INPUT)
    return number


def main(arguments: Sequence[str] | None = None, pipe: Connection | None = None) -> int:
    """Show a flight; entry point of the executable `display_node`."""
    return run("display", fly, arguments, SupervisorPipe(pipe))


if __name__ == "__main__":
    sys.exit(main())
