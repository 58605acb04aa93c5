# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A message is taken together with the identity of its writer, which is that of the graph."""

import time

from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import String

from satform_nodes.transport import qos
from satform_nodes.transport.serialized_take import GID_BYTES, SerializedTaker


def take(taker: SerializedTaker, subscription: object) -> tuple[bytes, bytes]:
    end = time.monotonic() + 30.0
    while (taken := taker.take(subscription)) is None:
        assert time.monotonic() < end, "no message has come"
        time.sleep(0.001)  # polls: threads of the middleware deliver the message without an event
    return taken


def test_messages_come_whole_in_order_and_with_the_writer_that_the_graph_names(observer: Node) -> None:
    taker = SerializedTaker()
    subscription = observer.create_subscription(
        String, "/spoken", lambda _: None, qos.LOCKSTEP_READER, raw=True
    )
    one, other = (observer.create_publisher(String, "/spoken", qos.LOCKSTEP) for _ in range(2))
    assert taker.take(subscription) is None
    # Longer than there is room for at first, then shorter than what was there before.
    sizes = (10, 100_000, 3)
    taken = []
    for publisher in (one, other):
        for size in sizes:
            publisher.publish(String(data="x" * size))
            taken.append(take(taker, subscription))
    assert [len(deserialize_message(data, String).data) for data, _ in taken] == [*sizes, *sizes]
    assert taken[0][0] == serialize_message(String(data="x" * 10))
    first, second = {writer for _, writer in taken[:3]}, {writer for _, writer in taken[3:]}
    assert len(first) == len(second) == 1
    known = {bytes(entry.endpoint_gid) for entry in observer.get_publishers_info_by_topic("/spoken")}
    assert first | second == known
    assert {len(writer) for writer in known} == {GID_BYTES}
    assert taker.take(subscription) is None
