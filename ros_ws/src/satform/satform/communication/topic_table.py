# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Topic graph: every topic of a flight with its publishers and subscribers, from the scenario.

The nodes, the recorder, the permissions and what is shown of a scenario all go by this one table. Observers
such as the display are not in it: no node waits for them. Names are those of a formation in the
root namespace; `relative` and `in_namespace` are for one in another.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from satform.communication.satellite_groups import SatelliteGroups
from satform.consensus.arc_length import Announces
from satform.consensus.graph import Graph

PLANT = "plant"
"""Name of the node that moves all satellites."""

RECORDER = "recorder"
"""Name of the node that keeps the flight; a flight may go without."""

INERTIAL_FRAME = "gcrf"
"""Frame of the inertial states: the Geocentric Celestial Reference Frame, in metres."""

FRAME = "lvlh"
"""The chief's rotating frame, in metres (REP 103): x radial outward, y along-track, z orbit normal."""

INTERFACE_VERSION = 1
"""Version of the rules of `docs/interface.md`; one more when a node that follows the former rules cannot take
part any more. A change of a message needs no new version: nodes compare the hashes of message types."""

RECORDER_WINDOW = 256
"""Steps by which the plant may be ahead of the recorder."""

LOCKSTEP_DEPTH = 2 * RECORDER_WINDOW
"""Messages that a publisher of one message a step keeps for its subscribers."""

_MOST_UNRECORDED = 64_000_000
"""Bytes that are kept at most for a recorder where groups exchange arrays."""

_FEWEST_AHEAD = 8
"""Steps by which the plant may be ahead of it however large the formation is."""

CLOCK = "/clock"
STATUS = "/formation/status"
NODE_READY = "/formation/node_ready"
RECORDER_PROGRESS = "/formation/recorder_progress"
DIAGNOSTICS = "/diagnostics"
MARKERS = "/formation/markers"

TF = "/tf"

OF_ALL_NAMESPACES = frozenset({CLOCK, DIAGNOSTICS, TF})
"""Topics whose names are fixed for a whole domain: by rcl's use_sim_time, by REP 107, and by tf2."""

KINDS_OF_A_SATELLITE = (
    "state",
    "arc_length",
    "motion",
    "truth",
    "orbit_state",
    "attitude",
    "link_conditions",
    "measurements",
    "navigation_estimate",
    "command",
    "tracking",
    "estimate",
    "attitude_estimate",
    "propulsion",
    "parameter_changes",
)
"""Kinds of all topics that are about one satellite; the recorder subscribes to each of them."""

OPTIONAL = frozenset({"diagnostics", "parameter_changes"})
"""Kinds of topics whose publishers nobody waits for."""

OPTIONAL_OF_EXTERNAL = OPTIONAL | {"tracking", "estimate", "link_conditions"}
"""Kinds of topics about an external satellite that its node need not have."""

Rhythm = Literal["states", "steps", "occasional"]
"""When there is a message: at every state, also at that after the last step; at every step; at times."""


@dataclass(frozen=True)
class Channel:
    """A topic.

    Attributes:
        topic: its name.
        kind: of its messages: the last part of the name.
        publishers: names of the nodes that publish there.
        subscribers: names of the nodes that subscribe and have to be there, the recorder last.
        rhythm: when there is a message.
        optional: whether a satellite need not have it: neither as its publisher nor as its subscriber.
        watchers: names of the nodes that subscribe only while a step does not go on; nobody waits for them.
        satellites: of an array, of how many satellites each message is; 0 for a message that is no array.
        depth: messages that a publisher of one message a step keeps for its subscribers.
    """

    topic: str
    kind: str
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    rhythm: Rhythm
    optional: bool = False
    watchers: tuple[str, ...] = ()
    satellites: int = 0
    depth: int = LOCKSTEP_DEPTH

    def subscribers_in(self, *, recorded: bool) -> tuple[str, ...]:
        """Names of the subscribers in a flight with or without a recorder."""
        return self.subscribers if recorded else tuple(name for name in self.subscribers if name != RECORDER)

    def required_subscribers(self, *, recorded: bool) -> tuple[str, ...]:
        """Names of the subscribers for which the plant waits: of an optional topic the recorder alone."""
        names = self.subscribers_in(recorded=recorded)
        return tuple(name for name in names if name == RECORDER) if self.optional else names


_KINDS_OF_A_GROUP: tuple[tuple[str, str, tuple[str, ...], Rhythm], ...] = (
    ("group_state", PLANT, ("",), "states"),
    ("group_command", "", (PLANT,), "steps"),
    ("group_tracking", "", (), "steps"),
)
"""Topics of a group beside its phases: kind, publisher, subscribers beside the recorder, rhythm; an empty
name is that of the group."""

NUMBERS_OF_A_SATELLITE: dict[str, dict[str, int]] = {
    "group_state": {"position": 3, "velocity": 3, "applied_acceleration": 3},
    "group_command": {"acceleration": 3, "announced_arc_length": 1, "announced_rate": 1},
    "group_phase": {"arc_length": 1, "rate": 1},
    "group_tracking": {
        "reference_position": 3,
        "reference_velocity": 3,
        "reference_acceleration": 3,
        "sliding_variable": 3,
    },
}
"""By the kind of an array, its lists, and how many numbers each has for a satellite."""


def lengths_of(kind: str, plan: "TopicPlan", index: int) -> tuple[tuple[str, int], ...]:
    """Length of each array of variable length in the messages of a kind about a satellite.

    Args:
        kind: of the topic.
        plan: of the flight.
        index: of the satellite.
    """
    own, count = plan.satellites[index], len(plan.satellites)
    size = own.estimated
    return {
        "link_conditions": (("loss", count), ("light_time", count)),
        "measurements": (("values", own.readings),),
        "navigation_estimate": (("mean", size), ("covariance", size * (size + 1) // 2)),
    }.get(kind, ())


def frame_of(kind: str) -> str:
    """Frame of the messages of a kind."""
    return INERTIAL_FRAME if kind == "orbit_state" else FRAME


def topic_name(kind: str, satellite: str) -> str:
    """Name of a satellite's topic of a kind."""
    return f"/{satellite}/{kind}"


def relative(topic: str) -> str:
    """Name by which a node makes an endpoint on a topic, so that it moves with the node's namespace.

    Args:
        topic: name in the root namespace.
    """
    return topic if topic in OF_ALL_NAMESPACES else topic.removeprefix("/")


def in_namespace(topic: str, namespace: str) -> str:
    """Full name of a topic or service of a formation in a namespace.

    Args:
        topic: name in the root namespace.
        namespace: of the formation, such as `/f1`.
    """
    return topic if topic in OF_ALL_NAMESPACES else f"{namespace.rstrip('/')}{topic}"


@dataclass(frozen=True)
class SensorTopic:
    """A topic with the readings of one channel as messages of sensor_msgs.

    Attributes:
        name: last part of the topic's name.
        kind: of its messages: range, imu, orientation or fix.
        first: index of the channel's first number among the readings of the satellite.
        numbers: of the channel.
        latency: of its readings, steps.
        variance: of each number, where a message has it.
    """

    name: str
    kind: str
    first: int
    numbers: int
    latency: int = 0
    variance: tuple[float, ...] = ()


@dataclass(frozen=True)
class Equipment:
    """What a satellite has that takes topics of its own, or fields of others.

    Attributes:
        name: of the satellite.
        thruster: whether what its thrusters apply is modelled.
        sensor: whether it knows its motion by measurements alone.
        filter: whether it estimates its motion.
        plans: whether its control law makes plans.
        attitude: whether it has an attitude.
        attitude_filter: whether it estimates its attitude.
        links: whether it receives over radio or optical links.
        orbit: whether its inertial state and relative elements are published.
        readings: numbers that its sensors measure; 0 without sensors.
        navigates: whether it knows its motion by the readings of its sensors alone.
        estimated: numbers of the state of the whole formation, which it estimates; 0 for one that does not.
        exchanges: whether its neighbours use that estimate.
        external: whether its node is somebody else's program.
        sensor_topics: with its readings as messages of sensor_msgs.
    """

    name: str
    thruster: bool = False
    sensor: bool = False
    filter: bool = False
    plans: bool = False
    attitude: bool = False
    attitude_filter: bool = False
    links: bool = False
    orbit: bool = False
    readings: int = 0
    navigates: bool = False
    estimated: int = 0
    exchanges: bool = False
    external: bool = False
    sensor_topics: tuple[SensorTopic, ...] = ()


@dataclass(frozen=True, eq=False)
class TopicPlan:
    """From what the topics of a flight follow.

    Attributes:
        satellites: all of them, in order.
        announces: what they exchange.
        graph: every edge that the communication graph has at some time of the flight.
        groups: of satellites that exchange arrays; None where each satellite has its own topics.
    """

    satellites: tuple[Equipment, ...]
    announces: Announces
    graph: Graph
    groups: SatelliteGroups | None = None


def satellite_channels(plan: TopicPlan, index: int) -> list[Channel]:
    """The topics that are about one satellite.

    Args:
        plan: of the flight.
        index: of the satellite.

    Returns:
        A channel for each, with the receivers that the graph has at some time of the flight.
    """
    equipment = plan.satellites[index]
    own = equipment.name
    receiving = [plan.satellites[receiver].name for receiver in plan.graph.receivers(index)]
    found = [
        _channel("state", own, PLANT, [own], "states"),
        _channel(plan.announces, own, own, receiving, "states"),
    ]
    if equipment.estimated:
        neighbours = receiving if equipment.exchanges else []
        found.append(_channel("navigation_estimate", own, own, neighbours, "states"))
    found += [
        *_optional_channels_of_plant(equipment),
        _channel("command", own, own, [PLANT], "steps"),
        _channel("tracking", own, own, [], "steps"),
    ]
    if equipment.filter:
        found.append(_channel("estimate", own, own, [], "steps"))
    if equipment.attitude_filter:
        found.append(_channel("attitude_estimate", own, own, [], "steps"))
    if equipment.thruster:
        found.append(_channel("propulsion", own, PLANT, [], "steps"))
    found.append(_channel("parameter_changes", own, own, [], "occasional"))
    optional = OPTIONAL_OF_EXTERNAL if equipment.external else OPTIONAL
    return [
        replace(
            channel,
            optional=channel.kind in optional,
            watchers=(PLANT,) if channel.kind in (plan.announces, "navigation_estimate") else (),
        )
        for channel in found
    ]


def watched_channels(plan: TopicPlan, index: int) -> list[Channel]:
    """The topics of a satellite for whose messages other nodes wait, which the plant watches in a stall."""
    return [channel for channel in satellite_channels(plan, index) if channel.watchers]


def _optional_channels_of_plant(equipment: Equipment) -> list[Channel]:
    """What the plant publishes at each state about a satellite with some equipment."""
    own = equipment.name
    kinds: list[tuple[object, str, list[str]]] = [
        (equipment.readings, "measurements", [own]),
        (equipment.sensor, "truth", []),
        (equipment.orbit, "orbit_state", []),
        (equipment.attitude, "attitude", [own]),
        (equipment.links, "link_conditions", [own]),
    ]
    return [
        *(_channel(kind, own, PLANT, subscribers, "states") for has, kind, subscribers in kinds if has),
        *(
            Channel(topic_name(topic.name, own), topic.kind, (PLANT,), (), "states")
            for topic in equipment.sensor_topics
        ),
    ]


def formation_channels(plan: TopicPlan) -> list[Channel]:
    """The topics that are about no satellite in particular."""
    groups = plan.groups
    names = tuple(satellite.name for satellite in plan.satellites) if groups is None else groups.names
    everyone = (*names, RECORDER)
    return [
        Channel(STATUS, "status", (PLANT,), everyone, "occasional"),
        Channel(NODE_READY, "node_ready", everyone, (PLANT,), "occasional"),
        Channel(RECORDER_PROGRESS, "recorder_progress", (RECORDER,), (PLANT,), "occasional"),
        Channel(CLOCK, "clock", (PLANT,), (RECORDER,), "states"),
        Channel(DIAGNOSTICS, "diagnostics", (PLANT, *everyone), (RECORDER,), "occasional", optional=True),
    ]


def group_channels(groups: SatelliteGroups) -> list[Channel]:
    """The topics of groups of satellites that exchange arrays.

    Args:
        groups: of a flight.
    """
    found: list[Channel] = []
    depth = 2 * array_window(len(groups.graph))
    for index, (name, members) in enumerate(zip(groups.names, groups.members, strict=True)):
        count = len(members)
        for kind, publisher, subscribers, rhythm in _KINDS_OF_A_GROUP:
            found.append(
                Channel(
                    topic_name(kind, name),
                    kind,
                    (publisher or name,),
                    (*(own or name for own in subscribers), RECORDER),
                    rhythm,
                    satellites=count,
                    depth=depth,
                )
            )
        for receiver in groups.receivers_of(index):
            other, halo = groups.names[receiver], groups.halos[index, receiver]
            found.append(
                Channel(
                    phase_topic(name, other),
                    "group_phase",
                    (name,),
                    (other,),
                    "states",
                    satellites=len(halo),
                    depth=depth,
                )
            )
    return found


def array_bytes(satellites: int) -> int:
    """Bytes that a step of so many satellites takes in a bag, where groups exchange arrays."""
    recorded = ("group_state", "group_command", "group_tracking")
    return 8 * satellites * sum(sum(NUMBERS_OF_A_SATELLITE[kind].values()) for kind in recorded)


def array_window(satellites: int) -> int:
    """Steps by which the plant may be ahead of the recorder, where groups exchange arrays.

    Fewer for a large formation: what is not recorded is kept by its publishers.
    """
    return min(RECORDER_WINDOW, max(_FEWEST_AHEAD, _MOST_UNRECORDED // array_bytes(satellites)))


def phase_topic(sender: str, receiver: str) -> str:
    """Name of the topic on which a group publishes phases for another one."""
    return f"/{sender}/to_{receiver}/group_phase"


def channels(plan: TopicPlan) -> list[Channel]:
    """Every topic of a flight: those of each satellite or group in order, then those of the formation."""
    if plan.groups is not None:
        return [*group_channels(plan.groups), *formation_channels(plan)]
    own = [satellite_channels(plan, index) for index in range(len(plan.satellites))]
    return [*(channel for satellite in own for channel in satellite), *formation_channels(plan)]


def published_by(name: str, table: Iterable[Channel]) -> list[Channel]:
    """The topics that a node publishes."""
    return [channel for channel in table if name in channel.publishers]


def subscribed_by(name: str, table: Iterable[Channel]) -> list[Channel]:
    """The topics to which a node subscribes."""
    return [channel for channel in table if name in channel.subscribers]


def _channel(kind: str, satellite: str, publisher: str, subscribers: list[str], rhythm: Rhythm) -> Channel:
    """A topic about a satellite; the recorder subscribes to all of them."""
    return Channel(topic_name(kind, satellite), kind, (publisher,), (*subscribers, RECORDER), rhythm)
