# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said on a topic, and how often."""

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
from satform_tools.inspect.observer_node import Looker, latched, passing

_QUEUE = 10
"""Messages that wait here at most; what passes faster than it can be printed is left out."""

_RATE_QUEUE = 100
"""Messages that wait to be counted; they are only counted, so that none is to be left out."""

_REPORT = 1.0
"""Wall-clock time between two lines of a rate, s."""


def echo(looker: Looker, topic: str, *, once: bool, field: str, form: str) -> None:
    """Print messages as they pass, until the publishers are gone or the reader goes.

    Args:
        looker: in the formation's domain.
        topic: name of the topic.
        once: end after the first message.
        field: dotted name of the part to be printed; empty for all of it.
        form: `yaml`, `json` (one line a message) or `csv` (with a line of names first).

    Raises:
        CommandError: there is no such topic or field, or nothing is said for too long.
    """
    name, kind = _wait_for_topic(looker, topic)
    waiting: deque[Any] = deque()

    # rclpy asks a callback for its parameters, which a method of deque cannot tell.
    def keep(message: Any) -> None:
        waiting.append(message)

    looker.node.create_subscription(interface(kind), name, keep, _quality(looker, name, _QUEUE))
    first = True
    while _next_message(looker, name, waiting, first):
        data = plain(waiting.popleft())
        _print(pick(data, field) if field else data, form, name=field, first=first)
        first = False
        if once:
            return


def rate(looker: Looker, topic: str, *, count: int, as_json: bool) -> None:
    """Print how often something is said on a topic, once a second, until the publishers are gone.

    Args:
        looker: in the formation's domain.
        topic: name of the topic.
        count: lines after which to end; 0 to go on.
        as_json: print a line of JSON instead of words.

    Raises:
        CommandError: there is no such topic, or nothing is said for too long.
    """
    name, kind = _wait_for_topic(looker, topic)
    moments: deque[float] = deque()
    quality = passing(_RATE_QUEUE)
    looker.node.create_subscription(
        interface(kind), name, lambda _: moments.append(time.monotonic()), quality, raw=True
    )
    lines = 0
    last: list[float] = []
    while _next_message(looker, name, moments, not last):
        looker.wait(lambda: False, _REPORT)
        # The interval across two lines counts, too: of what is said slowly there is no other.
        window = [*last, *moments]
        last = window[-1:]
        moments.clear()
        found = intervals(window)
        if found is None:
            continue
        lines += 1
        console.as_json_line(found) if as_json else console.line(_rate_words(found))
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


def _rate_words(found: dict[str, float]) -> str:
    return (
        f"{found['rate']:.1f} /s of wall-clock time ({found['messages']} messages; intervals "
        f"{1e3 * found['shortest']:.2f} to {1e3 * found['longest']:.2f} ms, "
        f"standard deviation {1e3 * found['deviation']:.2f} ms)"
    )


def _wait_for_topic(looker: Looker, topic: str) -> tuple[str, str]:
    """Full name and type of a topic, as soon as someone who speaks there has been found."""
    if not topic.startswith("/"):
        looker.require_formation()
    name = full_name(looker, topic)
    if not looker.wait(
        lambda: bool(looker.node.get_publishers_info_by_topic(name)), min(2.0, looker.patience)
    ):
        looker.find_formation()
    return known_topic(looker, topic)


def _next_message(looker: Looker, topic: str, waiting: deque[Any], first: bool) -> bool:
    """Wait for a message; False once nobody is left to say anything."""

    def heard_or_over() -> bool:
        return bool(waiting) or not (first or looker.node.get_publishers_info_by_topic(topic))

    # After the first message a silence may last: a formation may be held, or be waiting for someone.
    while not looker.wait(heard_or_over, looker.patience):
        if first:
            raise CommandError(
                f"nothing is said on {topic} within {looker.patience:g} s; --timeout SECONDS waits longer"
            )
    return bool(waiting)


def _quality(looker: Looker, topic: str, depth: int) -> QoSProfile:
    """Best effort, except where all that is said is kept for latecomers: there little is said."""
    publishers = looker.node.get_publishers_info_by_topic(topic)
    kept = all(entry.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for entry in publishers)
    return latched(depth) if publishers and kept else passing(depth)


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
