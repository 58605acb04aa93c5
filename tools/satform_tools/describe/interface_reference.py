# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The reference page of the interface: every topic with its QoS, every message with its fields and type hash.

It follows from the topic table, the QoS profiles and the message definitions, from which the nodes are made.
"""

import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, get_args

from rclpy.qos import DurabilityPolicy, QoSProfile

from satform.communication.satellite_groups import SatelliteGroups
from satform.communication.topic_table import (
    INTERFACE_VERSION,
    Channel,
    Equipment,
    TopicPlan,
    channels,
    group_channels,
)
from satform.consensus.arc_length import Announces
from satform.consensus.graph import Graph
from satform_nodes.transport import qos
from satform_nodes.transport.message_definitions import definition, type_hash, type_name
from satform_nodes.transport.topic_types import TYPES

_OWN, _NEIGHBOUR = "<satellite>", "<neighbour>"

_PACKAGE = "satform_msgs"

_SEPARATOR = "=" * 80

_WHEN = {
    "states": "at every step, and for the state after the last",
    "steps": "at every step",
    "occasional": "at times",
}

_DEFINITION = re.compile(r"(?P<type>\S+)\s+(?P<name>\w+)(?:=(?P<value>\S+))?\s*(?:#\s*(?P<text>.*))?$")

_INTRODUCTION = """# Interface reference

Every topic of a flight with its quality of service, and every message with its fields. The rules of how they
are used are on the page [interface](interface.md). This page is generated from the topic table and the
message definitions:

    ./tools/satform interface > docs/interface_reference.md
"""


_FLAGS = [field.name for field in fields(Equipment) if field.name not in ("name", "sensor_topics")]
"""What a satellite may have; standard messages of sensors, for which no node waits, are not on the page."""


_FIELDS_OF = {
    "thruster": "`thruster`",
    "sensor": "`sensor` or `navigation`",
    "filter": "`filter` or `navigation`",
    "attitude": "`attitude`",
    "attitude_filter": "`attitude` with `filter`",
    "links": "`links` with a `channel`",
    "readings": "`sensors`",
    "estimated": "`navigation` with `estimates: formation`",
}
"""Of what a satellite may have, the fields of the scenario by which it has it."""


def text() -> str:
    """The page.

    Raises:
        OSError: a message's package is not installed.
    """
    return "\n".join([_INTRODUCTION, *_topics(), *_group_topics(), *_qualities(), *_messages()]) + "\n"


def _table() -> list[Channel]:
    """Every topic of a satellite with all equipment and a neighbour, and those of the formation."""
    whole: dict[str, Any] = dict.fromkeys(_FLAGS, True)
    satellites = (Equipment(name=_OWN, **whole), Equipment(name=_NEIGHBOUR))
    graph = Graph.of_edges(2, [0, 1], [1, 0])
    tables = [channels(TopicPlan(satellites, announces, graph)) for announces in get_args(Announces)]
    found = {
        channel.topic: channel
        for table in tables
        for channel in table
        if not channel.topic.startswith(f"/{_NEIGHBOUR}/")
    }
    return list(found.values())


def _conditions() -> dict[str, str]:
    """On what of a satellite a kind of topic depends; nothing for a kind that every satellite has."""
    graph = Graph.of_edges(1, [], [])

    def kinds(**equipment: Any) -> set[str]:
        plan = TopicPlan((Equipment(name=_OWN, **equipment),), "arc_length", graph)
        return {channel.kind for channel in channels(plan)}

    flags = [name for name in _FLAGS if name != "external"]
    found = {kind: _FIELDS_OF.get(flag, flag) for flag in flags for kind in kinds(**{flag: True}) - kinds()}
    return {
        **found,
        "arc_length": "consensus on the phase",
        "motion": "consensus `kind: motion`",
        "orbit_state": "`publish_orbits`",
    }


def _topics() -> Iterator[str]:
    yield f"Interface version: {INTERFACE_VERSION}.\n"
    yield "## Topics\n"
    yield (
        "Names are those in the root namespace. The columns *publishes* and *subscribes* name the nodes; "
        "*optional* is what the node of an external satellite may do without. *If there is* names the "
        "fields of the satellite or the scenario without which there is no such topic. "
        "With `--no-record` there is no recorder.\n"
    )
    yield "| topic | type | if there is | a message | publishes | subscribes | optional | QoS |"
    yield "|---|---|---|---|---|---|---|---|"
    conditions = _conditions()
    for channel in _table():
        kind = type_name(TYPES[channel.kind]).replace("/msg/", "/")
        yield (
            f"| `{channel.topic}` | `{kind.removeprefix(_PACKAGE + '/')}` "
            f"| {conditions.get(channel.kind, '')} | {_WHEN[channel.rhythm]} "
            f"| {_names(channel.publishers)} | {_names(channel.subscribers)} "
            f"| {'yes' if channel.optional else ''} | {_quality(channel)} |"
        )
    yield ""


def _group_topics() -> Iterator[str]:
    yield "## Topics of groups\n"
    yield (
        "With `--arrays`, satellites that share a process have no topics of their own. Their group has "
        "these, with one message for all its satellites; `<other>` is each group with out-neighbours of "
        "them. The topics of the formation stay, with the groups in place of the satellites.\n"
    )
    yield "| topic | type | a message | publishes | subscribes | QoS |"
    yield "|---|---|---|---|---|---|"
    for channel in _group_table():
        kind = type_name(TYPES[channel.kind]).rpartition("/")[2]
        yield (
            f"| `{_of_any_group(channel.topic)}` | `{kind}` | {_WHEN[channel.rhythm]} "
            f"| {_of_any_group(_names(channel.publishers))} | {_of_any_group(_names(channel.subscribers))} "
            "| `ARRAYS` |"
        )
    yield ""


def _group_table() -> list[Channel]:
    """The topics of the first of two groups."""
    groups = SatelliteGroups(((0,), (1,)), Graph.of_edges(2, [0, 1], [1, 0]))
    return [channel for channel in group_channels(groups) if channel.topic.startswith("/group0/")]


def _of_any_group(text: str) -> str:
    return text.replace("group0", "<group>").replace("group1", "<other>")


def _names(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in dict.fromkeys(names) if name != _NEIGHBOUR or len(names) < 3)


def _quality(channel: Channel) -> str:
    own = {"diagnostics": "OBSERVER", "recorder_progress": "LOCKSTEP"}
    latched = qos.PUBLISHER_BY_RHYTHM[channel.rhythm] is qos.LATCHED
    return f"`{own.get(channel.kind, 'LATCHED' if latched else 'LOCKSTEP')}`"


def _qualities() -> Iterator[str]:
    yield "## QoS\n"
    yield (
        "All publishers are reliable and keep the last messages of their depth. A subscription asks for no "
        "more than the publisher offers: reliable; transient local for a latched topic; its own depth is at "
        "least that of the table, or 1 in real time, where only the newest message counts.\n"
    )
    yield "| QoS | reliability | durability | depth of the publisher | least depth of a subscription |"
    yield "|---|---|---|---|---|"
    for name in ("LOCKSTEP", "ARRAYS", "LATCHED", "OBSERVER"):
        profile: QoSProfile = getattr(qos, name)
        lasting = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        yield (
            f"| `{name}` | reliable | {'transient local' if lasting else 'volatile'} | {profile.depth} "
            f"| {profile.depth} |"
        )
    yield ""


def _messages() -> Iterator[str]:
    yield "## Messages\n"
    yield (
        "Types without a package are of `satform_msgs`. The hash is that of the type description (REP 2016), "
        "which discovery carries with each endpoint: a node that was built with another definition has "
        "another hash.\n"
    )
    known = dict.fromkeys(TYPES[channel.kind] for channel in (*_table(), *_group_table()))
    waiting = [kind for kind in known if type_name(kind).startswith(_PACKAGE)]
    for kind in waiting:
        waiting += [inner for inner in _contained(kind) if inner not in waiting]
    for kind in waiting:
        yield from _message(kind)


def _contained(kind: Any) -> list[Any]:
    """Messages of the same package of which a message has fields."""
    module = __import__(f"{_PACKAGE}.msg", fromlist=["msg"])
    names = (match["type"].partition("[")[0] for _, match in _lines(kind))
    return [getattr(module, name) for name in dict.fromkeys(names) if hasattr(module, name)]


def _lines(kind: Any) -> Iterator[tuple[str, re.Match[str]]]:
    """Each line of a definition that has a field or a constant, with the comment lines above it."""
    above: list[str] = []
    for line in definition(kind).partition(_SEPARATOR)[0].splitlines():
        match = _DEFINITION.match(line.strip())
        if line.startswith("#"):
            above.append(line.lstrip("# ").strip())
        elif match:
            yield " ".join(above), match
            above = []
        else:
            above = []


def _message(kind: Any) -> Iterator[str]:
    head = [line.lstrip("# ") for line in definition(kind).partition("\n\n")[0].splitlines()]
    about = " ".join(line for line in head if not line.startswith(("Copyright", "SPDX")))
    name = type_name(kind).rpartition("/")[2]
    yield f"### {name}\n"
    yield f"{about}\n"
    yield f"`{type_hash(kind)}`\n"
    yield "| field | type | meaning |"
    yield "|---|---|---|"
    for above, match in _lines(kind):
        above = "" if above and above in " ".join(head) else above  # noqa: PLW2901
        field = f"{match['name']} = {match['value']}" if match["value"] else match["name"]
        meaning = ". ".join(filter(None, (above.rstrip("."), match["text"] or ""))).replace("|", "\\|")
        yield f"| `{field}` | `{match['type']}` | {meaning} |"
    yield ""
