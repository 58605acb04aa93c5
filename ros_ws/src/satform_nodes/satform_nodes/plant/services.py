# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Services of the plant: pause, resume, take one step, stop, set the communication graph."""

import os
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from satform_msgs.srv import SetGraph
from std_srvs.srv import Trigger

import satform_nodes
from satform.communication.topic_table import relative
from satform.consensus.graph import Graph
from satform.flight.compile import FormationPlan
from satform.membership.formation import Event, TopologyChanged
from satform_nodes.plant.permitted_edges import permitted_graph

PAUSE = "/formation/pause"
RESUME = "/formation/resume"
STEP = "/formation/step"
STOP = "/formation/stop"
SET_GRAPH = "/formation/set_graph"


class FlightControl(Protocol):
    """What the services need of the plant's node."""

    plan: FormationPlan
    names: list[str]
    flying: bool
    stop_asked: bool

    @property
    def paused(self) -> bool:
        """Whether steps are taken only when asked for."""

    @property
    def paused_before(self) -> int | None:
        """The step before which a paused flight stands; None while a step is under way, or to be taken."""

    @property
    def last_step_taken(self) -> bool:
        """Whether no step follows in which something could take effect."""

    def pause(self) -> int:
        """Take no more steps; the number of the first one that is not taken."""

    def resume(self) -> int:
        """Take steps again; the number of the first one."""

    def single_step(self) -> int:
        """Take one step and pause again; the number of the step that is taken.

        Raises:
            ValueError: there is no such step.
        """

    def schedule_event(self, event: Event) -> int:
        """Schedule an event for the next step; returns the step."""


class FormationServices:
    """The services of the plant's node."""

    def __init__(self, node: Node, control: FlightControl) -> None:
        self._control = control
        self._permitted = permitted_graph(control.plan)
        possible = control.plan.membership.possible_graph
        self._discovered = possible if satform_nodes.EDGES_OF_SCENARIO in os.environ else None
        node.create_service(Trigger, relative(PAUSE), self._pause)
        node.create_service(Trigger, relative(RESUME), self._resume)
        node.create_service(Trigger, relative(STEP), self._step)
        node.create_service(Trigger, relative(STOP), self._stop)
        node.create_service(SetGraph, relative(SET_GRAPH), self._set_graph)

    def _pause(self, _request: Any, reply: Any) -> Any:
        if self._control.paused:
            step = self._control.paused_before
            where = "and takes a step" if step is None else f"before step {step}"
            return _failed(reply, f"the flight is paused already, {where}")
        if not self._control.flying:
            return _failed(reply, "the flight has not begun")
        return _done(reply, f"pauses before step {self._control.pause()}")

    def _resume(self, _request: Any, reply: Any) -> Any:
        if not self._control.paused:
            return _failed(reply, "the flight is not paused")
        return _done(reply, f"continues with step {self._control.resume()}")

    def _step(self, _request: Any, reply: Any) -> Any:
        if not self._control.flying:
            return _failed(reply, "the flight has not begun")
        try:
            step = self._control.single_step()
        except ValueError as error:
            return _failed(reply, str(error))
        return _done(reply, f"takes step {step} and pauses")

    def _stop(self, _request: Any, reply: Any) -> Any:
        self._control.stop_asked = True
        return _done(reply, "stops")

    def _set_graph(self, request: Any, reply: Any) -> Any:
        if self._control.plan.groups is not None:
            return _failed(
                reply, "groups that exchange arrays keep their graph; fly without --arrays to set it"
            )
        if not self._control.flying:
            return _failed(reply, "the flight has not begun")
        if self._control.last_step_taken:
            return _failed(reply, "the last step has been taken")
        try:
            graph = wanted_graph(request.adjacency, self._control.plan, self._permitted, self._discovered)
        except ValueError as error:
            return _failed(reply, str(error))
        reply.step = self._control.schedule_event(
            TopologyChanged(graph, "the graph was changed by a service")
        )
        return _done(reply, f"takes effect at step {reply.step}")


def wanted_graph(
    adjacency: Any, plan: FormationPlan, permitted: Graph | None = None, discovered: Graph | None = None
) -> Graph:
    """Validate the graph of a request.

    Args:
        adjacency: row-major, of zeros and ones, shape (N * N,).
        plan: of the flight's parts.
        permitted: edges for which satellites have permissions; None when they need none.
        discovered: edges between satellites that have discovered each other; None when all have.

    Returns:
        The graph.

    Raises:
        ValueError: it is not a graph of this formation, or cannot be had in flight.
    """
    count = len(plan.names)
    numbers = np.array(adjacency, dtype=np.float64)
    if numbers.size != count * count:
        raise ValueError(f"adjacency has {numbers.size} entries; {count} satellites have {count * count}")
    matrix = numbers.reshape(count, count)
    if not np.isin(matrix, (0.0, 1.0)).all():
        raise ValueError("adjacency has entries other than 0 and 1")
    if np.diagonal(matrix).any():
        raise ValueError("adjacency has a 1 on its diagonal: a satellite is not its own neighbour")
    if plan.announces == "motion":
        raise ValueError("a satellite that follows a neighbour needs its messages at every step")
    _require_possible(matrix > plan.membership.possible_graph.adjacency, plan)
    if discovered is not None:
        _require_discovered(matrix > discovered.adjacency, plan)
    if permitted is not None:
        _require_permitted(matrix > permitted.adjacency, plan)
    return Graph(matrix)


def _require_possible(new: NDArray[np.bool_], plan: FormationPlan) -> None:
    """Raise if edges that the scenario has at no time are wanted and cannot be had."""
    if not new.any():
        return
    if plan.points_at_satellites:
        raise ValueError(
            "satellites that point at each other need the edges of the scenario: only edges that the "
            "scenario has at some time can be used"
        )
    if plan.links.links is not None:
        receiver, sender = _ends_of_first(new, plan)
        raise ValueError(
            f"{receiver} has no link from {sender} in this scenario, which has a field "
            "links: only edges that the scenario has at some time can be used"
        )


def _require_discovered(new: NDArray[np.bool_], plan: FormationPlan) -> None:
    """Raise if edges are wanted between satellites that have not discovered each other."""
    if new.any():
        receiver, sender = _ends_of_first(new, plan)
        raise ValueError(
            f"{receiver} has not discovered {sender}: in a run of many processes only edges can be used that "
            "the scenario has at some time; add it to the field graph_schedule"
        )


def _require_permitted(new: NDArray[np.bool_], plan: FormationPlan) -> None:
    """Raise if edges are wanted for which the keys have no permissions."""
    if new.any():
        receiver, sender = _ends_of_first(new, plan)
        raise ValueError(
            f"{receiver} has no permission to read what {sender} publishes: make the keystore with "
            "--possible-graph, with all edges that the flight may need"
        )


def _ends_of_first(new: NDArray[np.bool_], plan: FormationPlan) -> tuple[str, str]:
    """Names of receiver and sender of the first of some edges."""
    receiver, sender = (int(index) for index in np.argwhere(new)[0])
    return plan.names[receiver], plan.names[sender]


def _done(reply: Any, sentence: str) -> Any:
    reply.success, reply.message = True, sentence
    return reply


def _failed(reply: Any, sentence: str) -> Any:
    reply.success, reply.message = False, sentence
    return reply
