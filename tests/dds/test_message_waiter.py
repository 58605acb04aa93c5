# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The compiled waiter counts arriving messages, waits for all that are needed, and knows their writers."""

import faulthandler
import gc
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_msgs.msg import String
from std_srvs.srv import Empty

from satform_nodes.transport import compiled, qos
from satform_nodes.transport.executor import StepExecutor

LONG = 30.0
SHORT = 0.2

pytestmark = pytest.mark.skipif(
    not compiled.is_used(), reason="the compiled part is not built or switched off"
)


def text_of(data: bytes) -> str:
    return str(deserialize_message(data, String).data)


@pytest.fixture
def waiter() -> Any:
    made = compiled.message_waiter()
    assert made is not None
    return made


@pytest.fixture
def add(observer: Node, waiter: Any) -> Callable[..., tuple[int, Any]]:
    """Subscribe to a topic and publish on it; the index in the waiter, and the publisher."""

    def added(topic: str, *, urgent: bool = False) -> tuple[int, Any]:
        subscription = observer.create_subscription(
            String, topic, lambda _: None, qos.LOCKSTEP_READER, raw=True
        )
        publisher = observer.create_publisher(String, topic, qos.LOCKSTEP)
        return waiter.add_subscription(subscription.handle.pointer, urgent), publisher

    return added


def test_a_wait_ends_when_all_needed_messages_are_there_and_not_before(waiter: Any, add: Any) -> None:
    (first, one), (second, other), (third, aside) = add("/one"), add("/other"), add("/aside")
    one.publish(String(data="1"))
    aside.publish(String(data="aside"))
    begin = time.monotonic()
    assert waiter.wait((first, second), SHORT) == (third, first)
    assert time.monotonic() - begin >= SHORT
    late = threading.Timer(SHORT, lambda: other.publish(String(data="2")))
    late.start()
    # Against a hang only: the message ends the wait.
    assert waiter.wait((first, second), LONG) == (third, second, first)
    late.join()
    assert [text_of(waiter.take(index)[0]) for index in (first, second, third)] == ["1", "2", "aside"]
    assert waiter.wait((first, second), 0.0) == ()
    assert waiter.take(first) is None


def test_an_urgent_message_ends_a_wait_for_others(waiter: Any, add: Any) -> None:
    (first, _), (second, status) = add("/state"), add("/status", urgent=True)
    late = threading.Timer(SHORT, lambda: status.publish(String(data="changed")))
    late.start()
    assert waiter.wait((first,), LONG) == (second,)
    late.join()


def test_many_messages_are_counted_and_come_in_order(waiter: Any, add: Any) -> None:
    _, publisher = add("/many")
    sent = [str(number) for number in range(200)]
    for text in sent:
        publisher.publish(String(data=text))
    received = []
    end = time.monotonic() + LONG
    while len(received) < len(sent):
        assert time.monotonic() < end
        for ready in waiter.wait(None, SHORT):
            received.append(text_of(waiter.take(ready)[0]))
    assert received == sent
    assert waiter.wait(None, 0.0) == ()


def test_only_the_known_writer_comes_without_its_identifier(observer: Node, waiter: Any, add: Any) -> None:
    index, mine = add("/command")
    other = observer.create_publisher(String, "/command", qos.LOCKSTEP)

    def taken(publisher: Any) -> Any:
        publisher.publish(String(data="x"))
        assert waiter.wait((index,), LONG) == (index,)
        return waiter.take(index)

    data, writer = taken(mine)
    known = {bytes(entry.endpoint_gid) for entry in observer.get_publishers_info_by_topic("/command")}
    assert writer in known
    waiter.know(index, writer)
    assert taken(mine) == data
    foreign = taken(other)
    assert foreign == (data, foreign[1])
    assert {writer, foreign[1]} == known
    waiter.know(index, foreign[1])
    assert taken(mine) == (data, writer)


def test_wrong_arguments_are_errors_and_not_crashes(waiter: Any, add: Any) -> None:
    index, _ = add("/x")
    for call in (
        lambda: waiter.wait((index + 1,), 0.0),
        lambda: waiter.wait((-1,), 0.0),
        lambda: waiter.take(7),
        lambda: waiter.know(7, b"x" * 16),
        lambda: waiter.know(index, b"short"),
        lambda: waiter.wait([index], 0.0),
        lambda: waiter.wait(None),
        lambda: waiter.wait(None, "soon"),
        waiter.__init__,
    ):
        with pytest.raises((IndexError, ValueError, TypeError, OverflowError, RuntimeError)):
            call()
    assert waiter.wait((index,), 0.0) == ()


def test_requests_are_answered_though_services_are_not_polled(observer: Node) -> None:
    executor = StepExecutor()
    executor.add_node(observer)
    executor.subscribe(observer, String, "/hot", lambda _data, _name: None, qos.LOCKSTEP_READER)
    asked: list[int] = []

    def answer(_request: Any, response: Any) -> Any:
        asked.append(1)
        return response

    observer.create_service(Empty, "/ask", answer)
    client = observer.create_client(Empty, "/ask")
    assert executor.spin_until(client.service_is_ready, LONG)
    for number in range(3):
        client.call_async(Empty.Request())
        assert executor.spin_until(lambda number=number: len(asked) == number + 1, LONG)
    executor.shutdown(timeout_sec=0.0)


def test_a_garbage_collection_during_a_wait_finds_the_waiter_unlocked(waiter: Any, add: Any) -> None:
    # So many that their tuple is none of those that Python keeps for reuse, and begins a collection.
    added = [add(f"/topic{number}") for number in range(24)]
    for _, publisher in added:
        publisher.publish(String(data="1"))
    indices = tuple(index for index, _ in added)
    assert waiter.wait(indices, LONG) == indices[::-1]
    during: list[tuple[int, ...]] = []

    def collecting(phase: str, _information: dict[str, int]) -> None:
        if phase == "start":
            gc.callbacks.remove(collecting)
            during.append(waiter.wait(indices[:1], 0.0))

    threshold = gc.get_threshold()
    # A wait with the mutex held ends for nobody, so it ends the process.
    faulthandler.dump_traceback_later(LONG, exit=True)
    try:
        gc.callbacks.append(collecting)
        gc.set_threshold(1)
        assert waiter.wait(indices, 0.0) == indices[::-1]
    finally:
        gc.set_threshold(*threshold)
        faulthandler.cancel_dump_traceback_later()
    assert during == [indices[::-1]]
