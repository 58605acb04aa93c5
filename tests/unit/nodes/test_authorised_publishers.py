# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is authorised on a topic: the first writer of the right node, and a second one only after a loss."""

from types import SimpleNamespace
from typing import Any

import pytest

from satform.communication.message_validator import RejectionCounter
from satform_nodes.transport import authorised_publishers
from satform_nodes.transport.authorised_publishers import UNDECIDED, AuthorisedPublishers
from satform_nodes.transport.deserialization import deserialize_or_reject
from satform_nodes.transport.filtered_subscription import FilteredSubscription

TOPIC = "/sat1/command"


class Graph:
    """Stands for a node: knows of the writers that discovery has told of, and counts the questions."""

    def __init__(self) -> None:
        self.owner: dict[bytes, str] = {}
        self.asked = 0

    def get_publishers_info_by_topic(self, topic: str) -> list[Any]:
        # As a node names it that moves with its namespace.
        assert topic == TOPIC.removeprefix("/")
        self.asked += 1
        # rclpy gives an identifier as a list of numbers.
        return [
            SimpleNamespace(
                endpoint_gid=list(gid), node_name=name.rpartition("/")[2], node_namespace=self.space_of(name)
            )
            for gid, name in self.owner.items()
        ]

    def get_namespace(self) -> str:
        return "/f1"

    @staticmethod
    def space_of(name: str) -> str:
        """Of a node called by its bare name the own namespace."""
        return name.rpartition("/")[0] or "/" if "/" in name else "/f1"


def writer(number: int) -> bytes:
    return bytes([number] * 16)


@pytest.fixture
def graph() -> Graph:
    return Graph()


@pytest.fixture
def rejections() -> RejectionCounter:
    return RejectionCounter()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The wall clock of the module, which the test moves."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(authorised_publishers.time, "monotonic", lambda: clock.now)
    return clock


@pytest.fixture
def authorised(graph: Graph, rejections: RejectionCounter) -> AuthorisedPublishers:
    return AuthorisedPublishers(graph, TOPIC, ["sat1"], rejections)  # type: ignore[arg-type]


def test_the_node_that_has_to_publish_is_authorised_and_looked_up_once(
    authorised: AuthorisedPublishers, graph: Graph
) -> None:
    graph.owner = {writer(1): "sat1"}
    assert [authorised.who(writer(1)) for _ in range(1000)] == ["sat1"] * 1000
    assert graph.asked == 1


def test_a_writer_that_was_found_before_the_flight_is_not_looked_up_and_needs_the_right_name_too(
    authorised: AuthorisedPublishers, graph: Graph
) -> None:
    graph.owner = {writer(1): "sat1", writer(2): "stranger", writer(3): "sat1"}
    authorised.note_endpoints(graph.get_publishers_info_by_topic("sat1/command"))
    asked = graph.asked
    assert authorised.who(writer(1)) == "sat1"
    assert graph.asked == asked
    assert authorised.who(writer(2)) is None
    assert authorised.who(writer(3)) is None


def test_a_stranger_is_refused_by_name_each_time_and_looked_up_once(
    authorised: AuthorisedPublishers, graph: Graph, rejections: RejectionCounter
) -> None:
    graph.owner = {writer(1): "sat1", writer(2): "stranger"}
    assert [authorised.who(writer(2)) for _ in range(1000)] == [None] * 1000
    assert rejections.counts == {(TOPIC, "stranger is not authorised"): 1000}
    assert graph.asked == 1
    assert authorised.who(writer(1)) == "sat1"


def test_a_second_writer_of_the_same_name_is_refused_whichever_speaks_first(
    authorised: AuthorisedPublishers, graph: Graph, rejections: RejectionCounter
) -> None:
    graph.owner = {writer(1): "sat1", writer(2): "sat1"}
    assert authorised.who(writer(2)) == "sat1"
    assert authorised.who(writer(1)) is None
    assert rejections.counts == {(TOPIC, "a second writer of sat1"): 1}


def test_after_a_loss_one_successor_is_authorised_and_its_predecessor_no_more(
    authorised: AuthorisedPublishers, graph: Graph, rejections: RejectionCounter
) -> None:
    graph.owner = {writer(1): "sat1", writer(2): "sat1", writer(3): "sat1"}
    assert authorised.who(writer(1)) == "sat1"
    assert authorised.who(writer(2)) is None
    authorised.allow_replacement("sat1")
    assert authorised.who(writer(1)) == "sat1"
    assert authorised.who(writer(2)) == "sat1"
    assert authorised.who(writer(1)) is None
    assert authorised.who(writer(3)) is None
    assert rejections.counts == {
        (TOPIC, "a second writer of sat1"): 2,
        (TOPIC, "sat1 has been restarted"): 1,
    }


def test_a_writer_that_has_been_replaced_is_not_authorised_after_another_loss_either(
    authorised: AuthorisedPublishers, graph: Graph, rejections: RejectionCounter
) -> None:
    graph.owner = {writer(number): "sat1" for number in (1, 2, 3)}
    assert authorised.who(writer(1)) == "sat1"
    authorised.allow_replacement("sat1")
    assert authorised.who(writer(2)) == "sat1"
    authorised.allow_replacement("sat1")
    assert authorised.who(writer(1)) is None
    assert authorised.who(writer(2)) == "sat1"
    assert authorised.who(writer(3)) == "sat1"
    assert authorised.who(writer(2)) is None
    assert rejections.counts == {(TOPIC, "sat1 has been restarted"): 2}


def test_two_losses_without_a_new_writer_between_them_let_one_in(
    authorised: AuthorisedPublishers, graph: Graph
) -> None:
    graph.owner = {writer(number): "sat1" for number in (1, 2, 3)}
    assert authorised.who(writer(1)) == "sat1"
    authorised.allow_replacement("sat1")
    authorised.allow_replacement("sat1")
    assert authorised.who(writer(2)) == "sat1"
    assert authorised.who(writer(3)) is None


def test_the_loss_of_one_who_does_not_speak_here_lets_nobody_in(
    authorised: AuthorisedPublishers, graph: Graph
) -> None:
    graph.owner = {writer(1): "sat1", writer(2): "sat2"}
    assert authorised.who(writer(1)) == "sat1"
    authorised.allow_replacement("sat2")
    assert authorised.who(writer(2)) is None


def test_a_writer_of_whom_nothing_is_known_yet_is_undecided_until_it_is(
    authorised: AuthorisedPublishers, graph: Graph, rejections: RejectionCounter, clock: SimpleNamespace
) -> None:
    assert authorised.who(writer(1)) == UNDECIDED
    graph.owner = {writer(1): "_NODE_NAME_UNKNOWN_"}
    clock.now += 0.1
    assert authorised.who(writer(1)) == UNDECIDED
    graph.owner = {writer(1): "sat1"}
    clock.now += 0.1
    assert authorised.who(writer(1)) == "sat1"
    assert rejections.total == 0


def test_the_graph_is_not_asked_again_at_every_message_of_the_undecided(
    authorised: AuthorisedPublishers, graph: Graph, clock: SimpleNamespace
) -> None:
    for _ in range(1000):
        assert authorised.who(writer(1)) == UNDECIDED
        clock.now += 0.0001
    # A tenth of a second, in which it may be asked every 0.02 s.
    assert graph.asked <= 6


def test_one_who_never_tells_its_name_is_refused_in_the_end(
    authorised: AuthorisedPublishers, rejections: RejectionCounter, clock: SimpleNamespace
) -> None:
    assert authorised.who(writer(1)) == UNDECIDED
    clock.now += 10.1
    assert authorised.who(writer(1)) is None
    assert rejections.counts == {(TOPIC, "a node without a name is not authorised"): 1}


def test_bytes_that_are_no_message_are_counted_and_nothing_comes_of_them(
    rejections: RejectionCounter,
) -> None:
    from satform_msgs.msg import NodeReady

    assert deserialize_or_reject(b"\x00\x01\x00\x00", NodeReady, "/formation/node_ready", rejections) is None
    assert rejections.counts == {("/formation/node_ready", "another form"): 1}


def test_a_node_of_another_namespace_is_not_the_one_of_the_same_name(
    authorised: AuthorisedPublishers, graph: Graph, rejections: RejectionCounter
) -> None:
    # Two formations in a domain have nodes of the same names, and `/clock` and `/diagnostics` in common.
    graph.owner = {writer(1): "/f2/sat1", writer(2): "sat1", writer(3): "/sat1"}
    assert [authorised.who(writer(number)) for number in (1, 2, 3)] == [None, "sat1", None]
    assert dict(rejections.counts) == {
        (TOPIC, "/f2/sat1 is not authorised"): 1,
        (TOPIC, "/sat1 is not authorised"): 1,
    }


@pytest.mark.parametrize("known", [True, False], ids=["arrived in time", "of a node that is not known yet"])
def test_a_late_message_of_a_lost_process_does_not_stand_for_the_next_one(
    known: bool, authorised: AuthorisedPublishers, graph: Graph, clock: SimpleNamespace
) -> None:
    queue: list[tuple[bytes, bytes]] = []
    heard: list[bytes] = []
    taker = SimpleNamespace(take=lambda _subscription: queue.pop(0) if queue else None)
    filtered = FilteredSubscription(
        SimpleNamespace(),
        authorised,
        lambda data, _name: heard.append(data),
        taker,  # type: ignore[arg-type]
    )
    first, second, third = map(writer, range(3))
    graph.owner[first] = "sat1"
    queue.append((b"of the first", first))
    assert filtered.take_one()
    authorised.allow_replacement("sat1")
    # The second process came back and was lost before anything of it was needed; its message has arrived.
    if known:
        graph.owner[second] = "sat1"
    queue.append((b"of the second", second))
    if not known:
        assert not filtered.take_one()
    filtered.finish()
    authorised.allow_replacement("sat1")
    graph.owner |= {second: "sat1", third: "sat1"}
    clock.now += 10.0
    filtered.retry_held()
    queue += [(b"late, of the second", second), (b"of the third", third), (b"again", third)]
    filtered.take_all()
    assert heard[-2:] == [b"of the third", b"again"]
    assert (b"of the second" in heard) is known
