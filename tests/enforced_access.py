# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Has every node try to write and to read on every topic, and compares with what is permitted."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from formation_access import DISCOVERY, Permitted
from secured_participants import Endpoints, Participant, Participants, Program, exchange

SAMPLES = 5
"""That each writer writes in each of two turns."""

STRANGERS = ("stranger", "accomplice")
"""Participants without keys, which can exchange everything with each other and nothing with the nodes."""

_KINDS = {"publish": "subscribe", "subscribe": "publish"}


def all_topics(nodes: Mapping[str, Permitted]) -> list[str]:
    """Every topic that some node may use, in the order in which endpoints are made on them.

    Everybody may use the last one. Participants announce their endpoints in this order, so that those who
    have met on the last one have decided on all others.
    """
    topics = set().union(*(node.publish | node.subscribe for node in nodes.values()))
    return [*sorted(topics - {DISCOVERY}), DISCOVERY]


def refused_by(nodes: Mapping[str, Permitted], name: str) -> set[tuple[str, str]]:
    """Endpoints that a node may not have."""
    return {
        (kind, topic) for kind in _KINDS for topic in all_topics(nodes) if topic not in nodes[name].of(kind)
    }


def endpoints_of(nodes: Mapping[str, Permitted], name: str) -> Endpoints:
    """A writer and a reader on each topic, with the number of remote endpoints that they may reach."""
    if name in STRANGERS:
        return {(kind, topic): 1 for kind in _KINDS for topic in all_topics(nodes)}
    return {
        (kind, topic): sum(
            topic in nodes[name].of(kind) and topic in node.of(_KINDS[kind])
            for peer, node in nodes.items()
            if peer != name
        )
        for kind in _KINDS
        for topic in all_topics(nodes)
    }


def samples_permitted(nodes: Mapping[str, Permitted], reader: str) -> dict[tuple[str, str], int]:
    """Number of samples by topic and writer that a reader on every topic receives."""
    if reader in STRANGERS:
        (other,) = set(STRANGERS) - {reader}
        return {(topic, other): 2 * SAMPLES for topic in all_topics(nodes)}
    return {
        (topic, writer): 2 * SAMPLES
        for writer, node in nodes.items()
        for topic in node.publish & nodes[reader].subscribe
        if writer != reader
    }


def all_at_once(
    participants: Participants,
    program: Program,
    keystore: Path,
    nodes: Mapping[str, Permitted],
    *,
    own_checks: bool,
) -> list[Participant]:
    """Every node, and two strangers without keys, try to write and to read on every topic.

    Args:
        participants: of the domain.
        program: of the participants.
        keystore: with the nodes' keys.
        nodes: what each may do.
        own_checks: whether the DDS of each node keeps it to its permissions.

    Returns:
        The nodes in their order, then the strangers.
    """
    enclaves = keystore / "enclaves" / "formation"
    variables = {name: program.variables(enclaves / name, own_checks=own_checks) for name in nodes}
    variables |= {name: program.variables(None) for name in STRANGERS}
    flying = [participants.start(program.executable, name, variables[name]) for name in variables]
    assert [participant.joined() for participant in flying] == [True] * len(flying)
    exchange(flying, [endpoints_of(nodes, participant.name) for participant in flying], SAMPLES)
    return flying


def assert_enforced(nodes: Mapping[str, Permitted], flying: Sequence[Participant]) -> None:
    """Every permitted pair of a writer and a reader has met and has all samples, no other pair has any."""
    for participant in flying:
        wanted = endpoints_of(nodes, participant.name)
        made = {endpoint: peers for endpoint, peers in wanted.items() if endpoint not in participant.refused}
        assert participant.matched == made
        assert participant.received == samples_permitted(nodes, participant.name)
