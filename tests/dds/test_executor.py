# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The executor's two ways to wait, and what it looks at now and then."""

from collections.abc import Callable

import pytest
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_msgs.msg import String
from std_srvs.srv import Trigger

from satform_nodes import LEAN
from satform_nodes.runtime.formation_node import FormationNode
from satform_nodes.transport import qos
from satform_nodes.transport.compiled import PYTHON_TRANSPORT
from satform_nodes.transport.executor import StepExecutor

SHORT, LONG = 0.3, 30.0


@pytest.fixture(params=["compiled", "python"])
def executor(observer: Node, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> StepExecutor:
    """An executor that waits in compiled code, if that is built, and one that waits in Python."""
    if request.param == "python":
        monkeypatch.setenv(PYTHON_TRANSPORT, "1")
    executor = StepExecutor()
    executor.add_node(observer)
    return executor


def into(heard: list[str]) -> Callable[[bytes, str], None]:
    return lambda data, _name: heard.append(deserialize_message(data, String).data)


def test_what_is_overheard_arrives_but_is_no_progress(observer: Node, executor: StepExecutor) -> None:
    vital: list[str] = []
    overheard: list[str] = []
    executor.subscribe(observer, String, "/vital", into(vital), qos.LOCKSTEP_READER)
    executor.subscribe(observer, String, "/aside", into(overheard), qos.LOCKSTEP_READER, vital=False)
    say_vital, say_aside = (
        observer.create_publisher(String, topic, qos.LOCKSTEP) for topic in ("/vital", "/aside")
    )
    executor.add_periodic(lambda: say_aside.publish(String(data="again")))
    # Something is said aside all the time, and the wait is over all the same.
    assert not executor.spin_while(lambda: True, SHORT)
    assert len(overheard) > 1
    assert vital == []
    executor.add_periodic(lambda: say_vital.publish(String(data="news")))
    assert executor.spin_while(lambda: len(vital) < 3, LONG)


def test_a_lean_node_has_only_what_it_was_made_for_and_can_be_waited_for(
    observer: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(LEAN, "1")
    node = FormationNode("lean")
    assert (list(node.services), list(node.subscriptions)) == ([], [])
    assert "lean" not in {entry.node_name for entry in observer.get_publishers_info_by_topic("/rosout")}
    heard: list[str] = []
    executor = StepExecutor()
    executor.add_node(node)
    executor.subscribe(node, String, "/vital", into(heard), qos.LOCKSTEP_READER)
    say = observer.create_publisher(String, "/vital", qos.LOCKSTEP)
    executor.add_periodic(lambda: say.publish(String(data="news")))
    assert executor.spin_while(lambda: len(heard) < 3, LONG)
    node.destroy_node()


def test_one_is_waited_for_after_the_other_and_the_rest_is_heard_all_the_same(
    observer: Node, executor: StepExecutor
) -> None:
    heard: list[str] = []
    kinds = ["/first", "/second", "/third"]
    subscriptions = [
        executor.subscribe(observer, String, kind, into(heard), qos.LOCKSTEP_READER) for kind in kinds
    ]
    publishers = [observer.create_publisher(String, kind, qos.LOCKSTEP) for kind in kinds]
    asked: list[int] = []

    def last_that_lacks() -> object:
        lacking = [place for place, kind in enumerate(kinds[:2]) if kind not in heard]
        asked.append(len(lacking))
        return subscriptions[lacking[-1]] if lacking else None

    executor.await_in_turn(last_that_lacks)
    assert executor.spin_until(lambda: all(one.get_subscription_count() for one in publishers), LONG)
    publishers[2].publish(String(data="/third"))
    assert executor.spin_while(lambda: not heard, LONG)
    publishers[0].publish(String(data="/first"))
    publishers[1].publish(String(data="/second"))
    assert executor.spin_while(lambda: len(heard) < 3, LONG)
    assert heard[0] == "/third"
    assert set(heard) == set(kinds)
    assert 2 in asked
    # One that says the same again and again, and is awaited for ever, keeps nobody from an end.
    executor.await_in_turn(lambda: subscriptions[0])
    executor.add_periodic(lambda: publishers[0].publish(String(data="/first")))
    assert not executor.spin_until(lambda: False, SHORT)


def test_what_a_node_gives_up_between_two_looks_is_not_looked_at_any_more(
    observer: Node, executor: StepExecutor
) -> None:
    executor.subscribe(observer, String, "/hot", into([]), qos.LOCKSTEP_READER)
    seen: list[str] = []
    given_up = observer.create_subscription(String, "/cold", lambda said: seen.append(said.data), 10)
    say = observer.create_publisher(String, "/cold", 10)
    executor.add_periodic(lambda: say.publish(String(data="cold")))
    assert executor.spin_until(lambda: bool(seen), LONG)
    observer.destroy_subscription(given_up)
    late: list[str] = []
    observer.create_subscription(String, "/cold", lambda said: late.append(said.data), 10)
    assert executor.spin_until(lambda: bool(late), LONG)


def test_without_anything_hot_what_is_not_hot_is_looked_at_until_the_time_is_up(
    observer: Node, executor: StepExecutor
) -> None:
    seen: list[str] = []
    observer.create_subscription(String, "/cold", lambda said: seen.append(said.data), 10)
    say = observer.create_publisher(String, "/cold", 10)
    executor.add_periodic(lambda: say.publish(String(data="cold")))
    assert executor.spin_until(lambda: bool(seen), LONG)
    assert not executor.spin_until(lambda: False, SHORT)


def test_a_request_is_answered_at_a_background_poll_whatever_else_has_arrived(
    observer: Node, executor: StepExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[str] = []
    answered: list[int] = []

    def answer(_request: Trigger.Request, reply: Trigger.Response) -> Trigger.Response:
        answered.append(len(answered))
        return reply

    executor.subscribe(observer, String, "/hot", into(heard), qos.LOCKSTEP_READER)
    observer.create_service(Trigger, "/ask", answer)
    say = observer.create_publisher(String, "/hot", qos.LOCKSTEP)
    client = observer.create_client(Trigger, "/ask")
    assert executor.spin_until(lambda: bool(say.get_subscription_count()), LONG)
    assert client.wait_for_service(LONG)
    assert not executor.spin_until(lambda: False, SHORT)
    # Requests are not to wait for this.
    monkeypatch.setattr(executor, "_housekeep", lambda: None)
    for count in range(1, 6):
        say.publish(String(data="news"))
        # It stops in the middle of what is ready.
        executor.spin_once(timeout_sec=0.0)
        client.call_async(Trigger.Request())
        say.publish(String(data="news"))
        assert executor.spin_until(lambda count=count: len(answered) == count, LONG)
    assert executor.spin_while(lambda: len(heard) < 10, LONG)
