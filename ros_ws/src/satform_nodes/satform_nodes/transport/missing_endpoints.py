# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnosis of a start that times out: missing nodes, publishers and subscriptions, and incompatible QoS."""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from satform.common.name_list import listed
from satform.communication.topic_table import RECORDER, Channel, relative
from satform_nodes.transport import topic_types
from satform_nodes.transport.message_definitions import type_hash, type_name
from satform_nodes.transport.node_names import local_name

_NOT_LATCHED = ("diagnostics", "recorder_progress")
"""Kinds of topics with occasional messages that late subscriptions need not receive."""

_EXTERNAL = ", which is external: somebody else starts it"
"""What is said of a missing node that is not started with the others."""

_NO_HASH = "INVALID"
"""Text of a type hash that a middleware does not carry."""

_HASH_SHOWN = 15
"""Characters of a type hash that tell two definitions apart for a reader."""

_MOST_NAMED = 3
"""Number of shortcomings that an error message lists; the rest are counted."""


@dataclass(frozen=True)
class Shortcoming:
    """What a node lacks.

    Attributes:
        node: its name.
        sentence: what it lacks, or has too much of.
        kind: what does not fit: the endpoint is not there (or there twice), or it has another type, another
            definition of the type, or another quality of service.
    """

    node: str
    sentence: str
    kind: Literal["endpoint", "type", "definition", "QoS"] = "endpoint"


def shortcomings(
    node: Node, channels: Sequence[Channel], *, recorded: bool, external: Collection[str] = ()
) -> list[Shortcoming]:
    """Compare the publishers and subscribers that are there with those that the flight needs.

    Args:
        node: through which it is looked.
        channels: of the flight.
        recorded: whether a recorder takes part.
        external: names of the satellites whose nodes somebody else starts.

    Returns:
        Nodes that are not there at all first; then each missing or unfit endpoint in the channels' order.
    """
    here = {name for name, space in node.get_node_names_and_namespaces() if space == node.get_namespace()}
    needed = [
        channel
        for channel in channels
        if not channel.optional and (recorded or channel.publishers != (RECORDER,))
    ]
    names = dict.fromkeys(
        name
        for channel in needed
        for name in (*channel.publishers, *channel.subscribers_in(recorded=recorded))
        if recorded or name != RECORDER
    )
    absent = [
        Shortcoming(name, f"there is no node {name}{_EXTERNAL if name in external else ''}")
        for name in names
        if name not in here
    ]
    gone = {shortcoming.node for shortcoming in absent}
    found = [*absent]
    for channel in needed:
        present = [name for name in channel.publishers if name in names and name not in gone]
        found += _publishers(node, channel, present)
        subscribers = [name for name in channel.subscribers_in(recorded=recorded) if name not in gone]
        found += _subscribers(node, channel, subscribers)
    return list({(each.node, each.sentence): each for each in found}.values())


def in_words(found: Sequence[Shortcoming], unready: Sequence[str]) -> str:
    """Shortcomings in one sentence.

    Args:
        found: as `shortcomings` gives them.
        unready: names of the nodes that have not reported that they can fly.

    Returns:
        The first few of them; where none is found, who has not reported.
    """
    if not found:
        return f"{listed(unready)} has discovered all its topics and has not reported that it is ready"
    named = "; ".join(each.sentence for each in found[:_MOST_NAMED])
    rest = len(found) - _MOST_NAMED
    return f"{named}; and {rest} more" if rest > 0 else named


def _publishers(node: Node, channel: Channel, names: Iterable[str]) -> list[Shortcoming]:
    topic = node.resolve_topic_name(relative(channel.topic))
    there = node.get_publishers_info_by_topic(topic)
    namespace = node.get_namespace()
    count = Counter(local_name(other, namespace) for other in there)
    found = []
    for name in names:
        if not count[name]:
            found.append(Shortcoming(name, f"{name} does not publish {topic}"))
        elif count[name] > 1:
            sentence = f"{count[name]} nodes are called {name}, and all of them publish {topic}"
            found.append(Shortcoming(name, sentence))
        else:
            (own,) = [other for other in there if local_name(other, namespace) == name]
            found += _unfit(name, "publishes", topic, channel, own)
    return found


def _subscribers(node: Node, channel: Channel, names: Iterable[str]) -> list[Shortcoming]:
    topic = node.resolve_topic_name(relative(channel.topic))
    there = node.get_subscriptions_info_by_topic(topic)
    own = {local_name(other, node.get_namespace()): other for other in there}
    found = []
    for name in names:
        if name not in own:
            found.append(Shortcoming(name, f"{name} does not subscribe to {topic}"))
        else:
            found += _unfit(name, "subscribes to", topic, channel, own[name])
    return found


def _unfit(name: str, verb: str, topic: str, channel: Channel, own: Any) -> list[Shortcoming]:
    """What of an endpoint does not fit the others of its topic: its type, or its quality of service."""
    wanted = type_name(topic_types.TYPES[channel.kind])
    if _type(own) != wanted:
        return [Shortcoming(name, f"{name} {verb} {topic} as {_type(own)}, not as {wanted}", "type")]
    changed = _changed_type(name, verb, topic, channel, own)
    if changed:
        return changed
    found = _unfit_qos(channel, own.qos_profile, publishes=verb == "publishes")
    return [Shortcoming(name, f"{name} {verb} {topic} as {found}", "QoS")] if found else []


def _unfit_qos(channel: Channel, profile: QoSProfile, *, publishes: bool) -> str:
    """How the quality of service of an endpoint differs from that of its topic; empty when it fits."""
    others = "its readers want" if publishes else "it has to be"
    if profile.reliability == ReliabilityPolicy.BEST_EFFORT:
        return f"best effort, and {others} reliable"
    latched = channel.rhythm == "occasional" and channel.kind not in _NOT_LATCHED
    if latched and profile.durability == DurabilityPolicy.VOLATILE:
        return f"volatile, and {others} transient local"
    each_step = channel.rhythm != "occasional"
    if not publishes and each_step and profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
        return "transient local, and its publishers offer volatile"
    return ""


def changed_types(node: Node, channels: Sequence[Channel], names: Collection[str]) -> list[Shortcoming]:
    """Endpoints of some nodes whose message type has the right name and another definition.

    Args:
        node: through which it is looked.
        channels: of the flight.
        names: of the nodes that are looked at.

    Returns:
        What is found at present; an endpoint that is not discovered yet is not looked at.
    """
    found: list[Shortcoming] = []
    for channel in channels:
        topic = node.resolve_topic_name(relative(channel.topic))
        for verb, wanted, endpoints in (
            ("publishes", channel.publishers, node.get_publishers_info_by_topic),
            ("subscribes to", channel.subscribers, node.get_subscriptions_info_by_topic),
        ):
            if not set(wanted).isdisjoint(names):
                for endpoint in endpoints(topic):
                    name = local_name(endpoint, node.get_namespace())
                    if name in names and name in wanted:
                        found += _changed_type(name, verb, topic, channel, endpoint)
    return found


def _changed_type(name: str, verb: str, topic: str, channel: Channel, own: Any) -> list[Shortcoming]:
    """A message type of the same name that was built from another definition, by the hashes of both.

    A middleware that does not carry the hash is not judged.
    """
    wanted = topic_types.TYPES[channel.kind]
    found, here = str(own.topic_type_hash), type_hash(wanted)
    if _type(own) != type_name(wanted) or found in (_NO_HASH, here):
        return []
    sentence = (
        f"{name} {verb} {topic} with another definition of {type_name(wanted)} ({found[:_HASH_SHOWN]}..., "
        f"here {here[:_HASH_SHOWN]}...); build it with the messages of this satform"
    )
    return [Shortcoming(name, sentence, "definition")]


def _type(endpoint: Any) -> str:
    return str(endpoint.topic_type)
