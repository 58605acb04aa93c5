# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Discovery ports of the processes of a large run: each process calls only those that it shares a topic with.

By default every participant calls every other one, each announces all its endpoints to all others, and
start-up time grows faster than with the square of the number of processes. Here each process is given a port
of its own and a list of ports to call: those of its partners, and all that no process of the run has, where
observers and external satellites are. They find all processes as usual.

A participant whose port is taken by another program takes a free one above it. Its partners still find it,
since it calls them. The lowest free ports are left to observers that start at the same time, so that they do
not take those of the run.
"""

import errno
import socket
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from satform.communication.topic_table import PLANT, channels
from satform.flight.compile import FormationPlan
from satform_bringup.deployment import domain_lock, middleware
from satform_bringup.deployment.node_processes import NodeProcess
from satform_nodes import EDGES_OF_SCENARIO

FEWEST_PROCESSES = 25
"""Processes of a run from which on they have lists of ports: in smaller ones nothing was gained by them, and
all can become neighbours in flight."""

FOLDER = "middleware"
"""In a run's folder: settings of each process's middleware."""

_LEFT_TO_OBSERVERS = 2
"""Free ports below those of the run, for observers that start at the same time."""

_ABSTRACT = "\0satform/port/"
"""Beginning of the abstract socket names by which runs that share a domain hold ports."""


@contextmanager
def assigned(
    nodes: Sequence[NodeProcess], plan: FormationPlan, domain: int, folder: Path
) -> Iterator[list[NodeProcess]]:
    """Give each process of a run on one machine a port, and a list of ports to call.

    Other runs in the same domain take no port of this run while the context is open.

    Args:
        nodes: processes of the run.
        plan: of the flight.
        domain: DDS domain of the flight.
        folder: existing folder of the run; gets the middleware's settings.

    Yields:
        The processes with their settings. Small runs, and those for which there are not enough free ports,
        are left as they are.

    Raises:
        OSError: the folder cannot be written to.
    """
    spare = _LEFT_TO_OBSERVERS + len(plan.external)
    with ExitStack() as holds:
        ports = _free_ports(len(nodes), spare, domain, holds) if len(nodes) >= FEWEST_PROCESSES else []
        if len(ports) < len(nodes):
            yield list(nodes)
            return
        own = dict(zip((node.name for node in nodes), ports, strict=True))
        foreign = sorted(set(domain_lock.discovery_ports(domain, middleware.PORTS)) - set(ports))
        (folder / FOLDER).mkdir(exist_ok=True)
        found = []
        for node, partners in zip(nodes, _partners(nodes, plan), strict=True):
            settings = middleware.write_profile(
                folder / FOLDER,
                middleware.heartbeat(len(plan.names if plan.groups is None else plan.groups.members)),
                middleware.on_loopback(own[node.name], [*sorted(own[name] for name in partners), *foreign]),
                response=middleware.RESPONSE_ON_LOOPBACK,
                name=f"{node.name}.xml",
            )
            if node.name == PLANT:
                # It rejects edges between satellites that do not call each other.
                settings = {**settings, EDGES_OF_SCENARIO: "1"}
            found.append(replace(node, environment=settings))
        yield found


def _free_ports(count: int, spare: int, domain: int, holds: ExitStack) -> list[int]:
    """Discovery ports that no program has and no other run holds; this run then holds them.

    Args:
        count: of the ports.
        spare: free ports below them.
        domain: DDS domain.
        holds: ends the holds.

    Returns:
        The ports; fewer than wanted if there are no more.
    """
    bound = domain_lock.bound_ports()
    free = [port for port in domain_lock.discovery_ports(domain, middleware.PORTS) if port not in bound]
    ports: list[int] = []
    for port in free[spare:]:
        if len(ports) < count and _holds(port, holds):
            ports.append(port)
    return ports


def _holds(port: int, holds: ExitStack) -> bool:
    """Hold a port against other runs in its domain; False where one of them has it."""
    held = holds.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
    try:
        held.bind(f"{_ABSTRACT}{port}")
    except OSError as error:
        if error.errno != errno.EADDRINUSE:
            raise
        return False
    return True


def _partners(nodes: Sequence[NodeProcess], plan: FormationPlan) -> list[set[str]]:
    """Of each process the other processes with which it shares a topic; of an observer all."""
    process_of = {}
    for node in nodes:
        satellites = node.parameters.get("satellites")
        for name in satellites if isinstance(satellites, list) else [node.name]:
            process_of[name] = node.name
    shared: dict[str, set[str]] = {}
    for channel in channels(plan.topics):
        subscribers = (*channel.subscribers, *channel.watchers)
        receiving = {process_of[name] for name in subscribers if name in process_of}
        for publisher in {process_of[name] for name in channel.publishers if name in process_of}:
            for subscriber in receiving:
                shared.setdefault(publisher, set()).add(subscriber)
                shared.setdefault(subscriber, set()).add(publisher)
    names = {node.name for node in nodes}
    return [shared.get(node.name, names) - {node.name} for node in nodes]
