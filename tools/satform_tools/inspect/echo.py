# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints the messages of a topic, and its message rate."""

import csv
import io
import itertools
import math
import sys
import time
from collections import deque
from typing import Any

import yaml
from rclpy.qos import DurabilityPolicy, QoSProfile

from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.inspect.graph import full_name, known_topic
from satform_tools.inspect.message_values import flat, interface, pick, plain
from satform_tools.inspect.observer_node import Observer, best_effort, latched

_QUEUE = 10
"""Queue depth; messages that arrive faster than they can be printed are dropped."""

_RATE_QUEUE = 100
"""Queue depth of a subscription that only counts, so that no message is missed."""

_REPORT = 1.0
"""Wall-clock time between two lines of a rate, s."""


def echo(observer: Observer, topic: str, *, once: bool, field: str, form: str) -> None:
    """Print messages as they arrive, until no publisher is left or the reader of the output closes it.

    Args:
        observer: in the formation's domain.
        topic: name of the topic.
        once: end after the first message.
        field: dotted name of the part to be printed; empty for all of it.
        form: `yaml`, `json` (one line a message) or `csv` (with a line of names first).

    Raises:
        CommandError: there is no such topic or field, or no message arrives within the timeout.
    """
    name, kind = _wait_for_topic(observer, topic)
    waiting: deque[Any] = deque()

    # rclpy inspects the parameters of a callback, which a method of deque does not have.
    def store(message: Any) -> None:
        waiting.append(message)

    observer.node.create_subscription(interface(kind), name, store, quality(observer, name, _QUEUE))
    first = True
    while _next_message(observer, name, waiting, first):
        data = plain(waiting.popleft())
        _print(pick(data, field) if field else data, form, name=field, first=first)
        first = False
        if once:
            return


def rate(observer: Observer, topic: str, *, count: int, as_json: bool) -> None:
    """Print the message rate of a topic once a second, until no publisher is left.

    Args:
        observer: in the formation's domain.
        topic: name of the topic.
        count: lines after which to end; 0 to go on.
        as_json: print lines of JSON.

    Raises:
        CommandError: there is no such topic, or no message arrives within the timeout.
    """
    name, kind = _wait_for_topic(observer, topic)
    moments: deque[float] = deque()
    quality = best_effort(_RATE_QUEUE)
    observer.node.create_subscription(
        interface(kind), name, lambda _: moments.append(time.monotonic()), quality, raw=True
    )
    lines = 0
    last: list[float] = []
    while _next_message(observer, name, moments, not last):
        observer.wait(lambda: False, _REPORT)
        # The interval across two lines counts, too: slow topics have no other.
        window = [*last, *moments]
        last = window[-1:]
        moments.clear()
        found = intervals(window)
        if found is None:
            continue
        lines += 1
        console.as_json_line(found) if as_json else console.line(_rate_text(found))
        sys.stdout.flush()
        if lines == count:
            return


def intervals(moments: list[float]) -> dict[str, float] | None:
    """Rate in 1/s, shortest, longest and standard deviation in s, number of intervals; None for too few."""
    gaps = [later - earlier for earlier, later in itertools.pairwise(moments)]
    if not gaps or sum(gaps) <= 0.0:
        return None
    mean = sum(gaps) / len(gaps)
    deviation = math.sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps))
    return {
        "rate": 1.0 / mean,
        "shortest": min(gaps),
        "longest": max(gaps),
        "deviation": deviation,
        "messages": len(gaps),
    }


def _rate_text(found: dict[str, float]) -> str:
    return (
        f"{found['rate']:.1f} /s of wall-clock time ({found['messages']} messages; intervals "
        f"{1e3 * found['shortest']:.2f} to {1e3 * found['longest']:.2f} ms, "
        f"standard deviation {1e3 * found['deviation']:.2f} ms)"
    )


def _wait_for_topic(observer: Observer, topic: str) -> tuple[str, str]:
    """Full name and type of a topic, as soon as a publisher has been discovered."""
    if not topic.startswith("/"):
        observer.require_formation()
    name = full_name(observer, topic)
    if not observer.wait(
        lambda: bool(observer.node.get_publishers_info_by_topic(name)), min(2.0, observer.timeout)
    ):
        observer.find_formation()
    return known_topic(observer, topic)


def _next_message(observer: Observer, topic: str, waiting: deque[Any], first: bool) -> bool:
    """Wait for a message; False once no publisher is left."""

    def received_or_ended() -> bool:
        return bool(waiting) or not (first or observer.node.get_publishers_info_by_topic(topic))

    # After the first message there is no timeout: the formation may be paused or wait for a process.
    while not observer.wait(received_or_ended, observer.timeout):
        if first:
            raise CommandError(
                f"no message on {topic} within {observer.timeout:g} s; --timeout SECONDS waits longer"
            )
    return bool(waiting)


def quality(observer: Observer, topic: str, depth: int) -> QoSProfile:
    """Best effort, or latched where all publishers latch: those publish rarely."""
    publishers = observer.node.get_publishers_info_by_topic(topic)
    latches = all(entry.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for entry in publishers)
    return latched(depth) if publishers and latches else best_effort(depth)


def _print(data: Any, form: str, *, name: str, first: bool) -> None:
    if form == "json":
        console.as_json_line(data)
    elif form == "csv":
        _print_csv(data, name, first)
    else:
        print(yaml.safe_dump(data, sort_keys=False, allow_unicode=True).removesuffix("...\n") + "---")
    sys.stdout.flush()


def _print_csv(data: Any, name: str, first: bool) -> None:
    cells = list(flat(data, name))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    if first:
        writer.writerow(heading for heading, _ in cells)
    writer.writerow(value for _, value in cells)
    print(text.getvalue(), end="")
