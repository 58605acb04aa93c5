# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Lists nodes and topics of a running formation, with their publishers, subscriptions and services."""

import difflib
from typing import Any

from satform_tools import console
from satform_tools.console import Table
from satform_tools.errors import CommandError
from satform_tools.inspect.observer_node import Observer

_OBSERVER_PREFIX = "_observer_"
"""Prefix of the names of observer nodes, which are no part of the formation."""

_SERVICES = 3.0
"""Wall-clock time within which the service of a known node is discovered, s."""


def list_topics(observer: Observer, *, as_json: bool) -> None:
    """Print each topic with its type and its numbers of publishers and subscriptions."""
    observer.find_formation()
    entries = [
        {
            "topic": name,
            "type": ", ".join(types),
            "publishers": len(_publishers(observer, name)),
            "subscriptions": len(_subscriptions(observer, name)),
        }
        for name, types in sorted(observer.node.get_topic_names_and_types())
    ]
    if as_json:
        console.as_json(entries)
        return
    rows = [tuple(str(value) for value in entry.values()) for entry in entries]
    console.table(Table(("topic", "type", "publishers", "subscriptions"), rows, frozenset({2, 3})))


def topic_info(observer: Observer, topic: str, *, as_json: bool) -> None:
    """Print the type of a topic, and every publisher and subscription with its quality of service."""
    observer.find_formation()
    name, kind = known_topic(observer, topic)
    endpoints = [
        {"node": _full_name(entry), "role": role, **_quality(entry.qos_profile)}
        for role, entries in (
            ("publisher", _publishers(observer, name)),
            ("subscription", _subscriptions(observer, name)),
        )
        for entry in entries
    ]
    if as_json:
        console.as_json({"topic": name, "type": kind, "endpoints": endpoints})
        return
    console.line(f"{name}: {kind}", "bold")
    rows = [tuple(entry.values()) for entry in endpoints]
    console.table(Table(("node", "role", "reliability", "durability", "history"), rows))


def list_nodes(observer: Observer, *, as_json: bool) -> None:
    """Print the names of all nodes."""
    observer.find_formation()
    nodes = _node_names(observer)
    if as_json:
        console.as_json(nodes)
    else:
        for name in nodes:
            console.line(name)


def node_info(observer: Observer, node: str, *, as_json: bool) -> None:
    """Print what a node publishes, what it subscribes to and which services it has."""
    observer.find_formation()
    full = known_node(observer, node)
    space, _, name = full.rpartition("/")
    asked = (name, space or "/")
    found = {
        "publishers": observer.node.get_publisher_names_and_types_by_node(*asked),
        "subscriptions": observer.node.get_subscriber_names_and_types_by_node(*asked),
        "services": observer.node.get_service_names_and_types_by_node(*asked),
        "clients": observer.node.get_client_names_and_types_by_node(*asked),
    }
    parts = {
        part: {topic: ", ".join(kinds) for topic, kinds in sorted(entries)} for part, entries in found.items()
    }
    if as_json:
        console.as_json({"node": full, **parts})
        return
    console.line(full, "bold")
    for part, entries in parts.items():
        console.line(f"  {part}" + ("" if entries else ": none"))
        for topic, kind in entries.items():
            console.line(f"    {topic}: {kind}")


def known_topic(observer: Observer, topic: str) -> tuple[str, str]:
    """Full name and type of a topic that has an endpoint.

    Raises:
        CommandError: there is none of that name.
    """
    there = dict(observer.node.get_topic_names_and_types())
    name = full_name(observer, topic)
    if name not in there:
        raise CommandError(f"there is no topic {name} on domain {observer.domain}; {_near(name, there)}")
    return name, there[name][0]


def known_node(observer: Observer, node: str) -> str:
    """Full name of a node.

    Raises:
        CommandError: there is none of that name.
    """
    there, name = _node_names(observer), full_name(observer, node)
    if name not in there:
        raise CommandError(f"there is no node {name} on domain {observer.domain}; {_near(name, there)}")
    return name


def known_service(observer: Observer, service: str) -> tuple[str, str]:
    """Full name and type of a service.

    Raises:
        CommandError: there is none of that name.
    """
    name = full_name(observer, service)
    # Discovery of a node's topics does not include its services.
    observer.wait(lambda: name in dict(observer.node.get_service_names_and_types()), _SERVICES)
    there = dict(observer.node.get_service_names_and_types())
    if name not in there:
        raise CommandError(f"there is no service {name} on domain {observer.domain}; {_near(name, there)}")
    return name, there[name][0]


def full_name(observer: Observer, name: str) -> str:
    """A name from the root of all names, as the graph has it; one without a slash is the formation's own."""
    return name if name.startswith("/") else observer.full_name(f"/{name}")


def _near(name: str, there: Any) -> str:
    close = difflib.get_close_matches(name, there, n=1)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(sorted(there)) or 'none'}"


def _node_names(observer: Observer) -> list[str]:
    pairs = observer.node.get_node_names_and_namespaces()
    return sorted(
        f"{space.rstrip('/')}/{name}" for name, space in pairs if not name.startswith(_OBSERVER_PREFIX)
    )


def _publishers(observer: Observer, topic: str) -> list[Any]:
    return _others(observer.node.get_publishers_info_by_topic(topic))


def _subscriptions(observer: Observer, topic: str) -> list[Any]:
    return _others(observer.node.get_subscriptions_info_by_topic(topic))


def _others(endpoints: list[Any]) -> list[Any]:
    others = [entry for entry in endpoints if not entry.node_name.startswith(_OBSERVER_PREFIX)]
    return sorted(others, key=_full_name)


def _full_name(endpoint: Any) -> str:
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


def _quality(profile: Any) -> dict[str, str]:
    # DDS does not transmit the depth of a queue, and rmw then gives the history as unknown.
    known = profile.depth > 0
    return {
        "reliability": profile.reliability.short_key,
        "durability": profile.durability.short_key,
        "history": f"{profile.history.short_key} {profile.depth}" if known else "unknown",
    }
