# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Serves the topics of a formation to Foxglove, with their schemas; viewers can only read.

A topic is subscribed to while some viewer looks at it, as best effort unless it is latched: the flight waits
for none. The messages are passed on as they are, in CDR.
"""

import importlib
import queue
import threading
import time
from typing import Any

from satform.common.exit_codes import EXIT_DONE, EXIT_STOPPED
from satform_nodes.transport.message_definitions import described
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.inspect.echo import quality
from satform_tools.inspect.message_values import interface
from satform_tools.inspect.observer_node import Observer
from satform_tools.run.page_options import PageOptions

_DEPTH = 10
_TAKING_PERIOD = 0.02
"""Wall-clock time between two looks for messages, s."""

_DISCOVERY_PERIOD = 1.0
"""Wall-clock time between two looks for topics, s."""


class _Topics:
    """The topics of a formation as channels; what viewers look at is subscribed to.

    Attributes:
        changes: channel and whether it is looked at, put by the threads of the server.
    """

    def __init__(self, observer: Observer, context: Any) -> None:
        self._observer, self._context = observer, context
        self._channels: dict[str, Any] = {}
        self._kinds: dict[int, tuple[str, Any]] = {}
        self._viewers: dict[int, int] = {}
        self._subscriptions: dict[int, Any] = {}
        self.changes: queue.SimpleQueue[tuple[int, int]] = queue.SimpleQueue()

    def discover(self) -> None:
        """Advertise topics that have appeared."""
        foxglove = importlib.import_module("foxglove")
        for topic, kinds in self._observer.node.get_topic_names_and_types():
            if topic in self._channels:
                continue
            try:
                kind = interface(kinds[0])
                message = described(kind)
            except (CommandError, OSError):
                continue  # a type that is not installed here
            schema = foxglove.Schema(
                name=message.name, encoding="ros2msg", data=message.definition.encode("utf-8")
            )
            channel = foxglove.Channel(topic, message_encoding="cdr", schema=schema, context=self._context)
            self._channels[topic] = channel
            self._kinds[channel.id()] = topic, kind

    def follow_viewers(self) -> None:
        """Subscribe to what is looked at, and to nothing else."""
        while not self.changes.empty():
            number, change = self.changes.get()
            self._viewers[number] = self._viewers.get(number, 0) + change
            wanted = self._viewers[number] > 0
            if wanted and number not in self._subscriptions:
                topic, kind = self._kinds[number]
                self._subscriptions[number] = self._observer.node.create_subscription(
                    kind, topic, _nothing, quality(self._observer, topic, _DEPTH), raw=True
                )
            elif not wanted and number in self._subscriptions:
                self._observer.node.destroy_subscription(self._subscriptions.pop(number))

    def pass_on(self) -> None:
        """Pass on the messages that have arrived."""
        for number, subscription in self._subscriptions.items():
            channel = self._channels[self._kinds[number][0]]
            while (taken := subscription.handle.take_message(subscription.msg_type, True)) is not None:
                channel.log(bytes(taken[0]))


class _ViewerChanges:
    """Notes which channels viewers look at; called by threads of the server."""

    def __init__(self, topics: _Topics) -> None:
        self._topics = topics

    def on_subscribe(self, _client: Any, channel: Any) -> None:
        self._topics.changes.put((channel.id, 1))

    def on_unsubscribe(self, _client: Any, channel: Any) -> None:
        self._topics.changes.put((channel.id, -1))


def serve(observer: Observer, options: PageOptions, found: threading.Event | None = None) -> int:
    """Serve the topics of a formation until its plant has ended, or Ctrl-C.

    Args:
        observer: in the formation's domain.
        options: where to serve.
        found: set when the flight is known.

    Returns:
        Exit code: 0, or 130 after Ctrl-C.

    Raises:
        CommandError: no formation flies here, or the port cannot be bound.
    """
    foxglove = importlib.import_module("foxglove")
    observer.require_formation()
    context = foxglove.Context()
    topics = _Topics(observer, context)
    try:
        server = foxglove.start_server(
            name="satform",
            host=options.address,
            port=options.port,
            server_listener=_ViewerChanges(topics),
            context=context,
        )
    except (OSError, RuntimeError) as error:
        raise CommandError(f"cannot be served on {options.address}:{options.port}: {error}") from None
    host = f"[{options.address}]" if ":" in options.address else options.address
    console.line(f"ws://{host}:{server.port}")
    if found is not None:
        found.set()
    try:
        _serve_until_end(observer, topics)
    except KeyboardInterrupt:
        return EXIT_STOPPED
    finally:
        server.stop()
    return EXIT_DONE


def _serve_until_end(observer: Observer, topics: _Topics) -> None:
    due = 0.0
    while True:
        if time.monotonic() >= due:
            if not observer.plant_exists():
                return
            topics.discover()
            due = time.monotonic() + _DISCOVERY_PERIOD
        topics.follow_viewers()
        topics.pass_on()
        time.sleep(_TAKING_PERIOD)  # between two looks at the queues


def _nothing(_message: bytes) -> None:
    """Messages are taken, not called back with."""
