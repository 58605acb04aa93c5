# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""In a step that does not go on, the plant finds out who has not published what others wait for."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flights import shortened
from satform.communication.message_validator import RejectionCounter
from satform.communication.sim_time import Stamps
from satform.communication.topic_table import TopicPlan
from satform.flight.compile import topic_plan
from satform_nodes.plant.message_watch import MessageWatch
from satform_nodes.transport.message_forms import form_of

STEP, SIZE = 7, 12
PHASE, ESTIMATE = "/chief/arc_length", "/chief/navigation_estimate"


class Network:
    """Stands for the executor: hands messages to subscriptions."""

    def __init__(self) -> None:
        self.callbacks: dict[str, Callable[[bytes, str], None]] = {}

    def subscribe(self, _node: Any, _kind: Any, topic: str, callback: Any, *_: Any, vital: bool) -> str:
        assert not vital
        self.callbacks[topic] = callback
        return topic

    def unsubscribe(self, _node: Any, topic: str) -> None:
        del self.callbacks[topic]


@pytest.fixture
def plan() -> TopicPlan:
    return topic_plan(shortened("gnss_differential_pair", 100.0))


@pytest.fixture
def network() -> Network:
    return Network()


@pytest.fixture
def watch(plan: TopicPlan, network: Network) -> MessageWatch:
    stamps = Stamps(10.0, 10 * 10**9)
    return MessageWatch(SimpleNamespace(), network, plan, RejectionCounter(), stamps)  # type: ignore[arg-type]


def phase(plan: TopicPlan, step: int) -> bytes:
    return form_of("arc_length", plan, 0).pack(10 * step, 0, step, 1.0, 0.1)


def estimate(plan: TopicPlan, step: int, variance: float) -> bytes:
    upper = (variance * np.eye(SIZE))[np.triu_indices(SIZE)].tolist()
    numbers = (SIZE, *[0.0] * SIZE, len(upper), *upper, 0.0, 0.0, 0.0)
    return form_of("navigation_estimate", plan, 0).pack(10 * step, 0, step, *numbers)


def test_all_topics_of_the_watched_satellite_alone_are_watched_until_the_end(
    watch: MessageWatch, network: Network
) -> None:
    watch.begin([0], STEP)
    assert set(network.callbacks) == {PHASE, ESTIMATE}
    watch.end()
    assert network.callbacks == {}
    assert watch.step is None


@pytest.mark.parametrize(
    ("phases", "estimates", "unsent"),
    [
        # Nothing from anybody: the plant may have found no publisher yet.
        ([], [], {}),
        ([STEP - 1, STEP], [(STEP, 1.0)], {}),
        ([STEP + 1, STEP], [(STEP, 0.0)], {}),
        ([STEP], [], {0: ESTIMATE}),
        ([STEP], [(STEP - 1, 1.0), (STEP, -1.0)], {0: ESTIMATE}),
        ([STEP - 1], [(STEP - 1, 1.0)], {0: PHASE}),
        ([STEP + 1], [(STEP, 1.0)], {0: PHASE}),
    ],
)
def test_a_valid_message_for_the_step_is_what_counts(
    watch: MessageWatch,
    network: Network,
    plan: TopicPlan,
    phases: list[int],
    estimates: list[tuple[int, float]],
    unsent: dict[int, str],
) -> None:
    watch.begin([0], STEP)
    for step in phases:
        network.callbacks[PHASE](phase(plan, step), "chief")
    for step, variance in estimates:
        network.callbacks[ESTIMATE](estimate(plan, step, variance), "chief")
    assert watch.unsent == unsent
    assert watch.received_from == ({0} if phases else set())
