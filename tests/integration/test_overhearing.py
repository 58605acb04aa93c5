"""What is only overheard is handed on, and is nothing that anyone waits for."""

from collections.abc import Callable

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from satform_nodes import topics
from satform_nodes.executor import StepExecutor

SHORT, LONG = 0.3, 30.0


def test_what_is_overheard_arrives_but_is_no_progress(observer: Node) -> None:
    executor = StepExecutor()
    executor.add_node(observer)
    vital: list[str] = []
    overheard: list[str] = []

    def into(heard: list[str]) -> Callable[[bytes, str], None]:
        return lambda data, _name: heard.append(deserialize_message(data, String).data)

    executor.subscribe(observer, String, "/vital", into(vital), topics.STEPPED_READER)
    executor.subscribe(observer, String, "/aside", into(overheard), topics.STEPPED_READER, vital=False)
    say_vital, say_aside = (
        observer.create_publisher(String, topic, topics.STEPPED) for topic in ("/vital", "/aside")
    )
    executor.add_chore(lambda: say_aside.publish(String(data="again")))
    # Something is said aside all the time, and the wait is over all the same.
    assert not executor.spin_while(lambda: True, SHORT)
    assert len(overheard) > 1
    assert vital == []
    executor.add_chore(lambda: say_vital.publish(String(data="news")))
    assert executor.spin_while(lambda: len(vital) < 3, LONG)
    executor.shutdown(timeout_sec=0.0)
