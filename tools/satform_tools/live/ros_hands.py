# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Control of a flight from the live page, by the services and parameters that `ros2` uses, too."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import parameter_value_to_python
from satform_msgs.srv import SetGraph
from std_srvs.srv import Trigger

from satform_nodes.plant import services
from satform_tools.inspect.monitor import FormationMonitor
from satform_tools.inspect.observer_node import Observer
from satform_tools.live.source import Reply

TIMEOUT = 10.0
"""Wall-clock time within which a service has to reply, s."""

_MOST_PENDING = 16
_MOST_NUMBERS = 64
_TRIGGERS = {
    "pause": services.PAUSE,
    "resume": services.RESUME,
    "step": services.STEP,
    "stop": services.STOP,
}
_PREFIXES = ("controller.", "attitude_controller.", "curve.", "phase.")
"""How names of parameters begin that can change in flight."""


@dataclass(eq=False)
class _Call:
    """A service call under way.

    Attributes:
        service: its name.
        client: of the service.
        request: to be sent as soon as the service is there.
        then: takes the response.
        reply: to the page, where there is none.
        deadline: s of the monotonic clock.
        future: of the response; None before the request is sent.
    """

    service: str
    client: Any
    request: Any
    then: Callable[[Any], None]
    reply: Reply
    deadline: float
    future: Any = None


class RosHands:
    """Calls services for pages, several at a time, without waiting."""

    def __init__(self, observer: Observer, monitor: FormationMonitor) -> None:
        self._observer, self._monitor = observer, monitor
        self._names = [str(name) for name in monitor.status.satellites]
        self._clients: dict[str, Any] = {}
        self._pending: list[_Call] = []

    def ask(self, request: dict[str, Any], reply: Reply) -> None:
        """Begin what a page asks for; every mistake in a request is answered by a sentence."""
        if len(self._pending) >= _MOST_PENDING:
            reply(success=False, text=f"{_MOST_PENDING} requests are under way already")
            return
        try:
            match request["kind"]:
                case "pause" | "resume" | "step" | "stop":
                    self._trigger(_TRIGGERS[request["kind"]], reply)
                case "edge":
                    self._edge(request, reply)
                case "parameters":
                    self._parameters(self._satellite(request), reply)
                case "set":
                    self._set(self._satellite(request), request, reply)
                case other:
                    raise ValueError(f"there is no request {str(other)[:40]!r}")
        except (ValueError, KeyError, TypeError) as error:
            missing = f"the request has no {error}" if isinstance(error, KeyError) else str(error)
            reply(success=False, text=missing)

    def update(self) -> None:
        """Send what waits for its service, and take responses."""
        if not self._pending:
            return
        self._observer.poll()
        for call in list(self._pending):
            try:
                over = _advance(call)
            except Exception as error:  # whatever another node answers, the server goes on
                over = True
                call.reply(success=False, text=f"the call of {call.service} failed: {str(error)[:200]}")
            if over:
                self._pending.remove(call)

    def _call(self, kind: Any, service: str, request: Any, reply: Reply, then: Callable[[Any], None]) -> None:
        if service not in self._clients:
            self._clients[service] = self._observer.node.create_client(kind, service)
        client = self._clients[service]
        self._pending.append(_Call(service, client, request, then, reply, time.monotonic() + TIMEOUT))

    def _trigger(self, service: str, reply: Reply) -> None:
        def done(response: Any) -> None:
            reply(success=bool(response.success), text=str(response.message))

        self._call(Trigger, self._observer.full_name(service), Trigger.Request(), reply, done)

    def _edge(self, request: dict[str, Any], reply: Reply) -> None:
        """Set the graph in force with one edge more or less."""
        count = len(self._names)
        receiver, sender, wanted = request["receiver"], request["sender"], request["on"]
        for index in (receiver, sender):
            if type(index) is not int or not 0 <= index < count:
                raise ValueError(f"an edge is between two of {count} satellites, by their indices")
        if type(wanted) is not bool:
            raise ValueError("on is true or false")
        status = self._monitor.status
        adjacency = np.zeros((count, count), dtype=np.uint8)
        adjacency[list(status.edge_receivers), list(status.edge_senders)] = 1
        adjacency[receiver, sender] = wanted

        def done(response: Any) -> None:
            edge = f"{self._names[receiver]} receives from {self._names[sender]}: {'on' if wanted else 'off'}"
            reply(success=bool(response.success), text=f"{edge}, {response.message}")

        asked = SetGraph.Request(adjacency=adjacency.ravel().tolist())
        self._call(SetGraph, self._observer.full_name(services.SET_GRAPH), asked, reply, done)

    def _satellite(self, request: dict[str, Any]) -> str:
        name = request["satellite"]
        if name not in self._names:
            raise ValueError(f"there is no satellite {str(name)[:40]!r}")
        return self._observer.full_name(f"/{name}")

    def _parameters(self, node: str, reply: Reply) -> None:
        """Answer with the parameters of a satellite that can change in flight, and their bounds."""

        def listed(response: Any) -> None:
            names = sorted(name for name in response.result.names if name.startswith(_PREFIXES))
            request = DescribeParameters.Request(names=names)
            self._call(DescribeParameters, f"{node}/describe_parameters", request, reply, described)

        def described(response: Any) -> None:
            numeric = (ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_DOUBLE_ARRAY)
            found = [one for one in response.descriptors if one.type in numeric and not one.read_only]
            request = GetParameters.Request(names=[one.name for one in found])

            def got(answer: Any) -> None:
                values = [parameter_value_to_python(value) for value in answer.values]
                data = [_described(one, value) for one, value in zip(found, values, strict=True)]
                reply(success=True, text=f"{len(data)} parameters of {node}", data={"parameters": data})

            self._call(GetParameters, f"{node}/get_parameters", request, reply, got)

        self._call(ListParameters, f"{node}/list_parameters", ListParameters.Request(), reply, listed)

    def _set(self, node: str, request: dict[str, Any], reply: Reply) -> None:
        name, numbers = request["name"], request["value"]
        if not isinstance(name, str) or not name.startswith(_PREFIXES) or not name.isascii():
            raise ValueError("such a parameter does not change in flight")
        if (
            not isinstance(numbers, list)
            or not 0 < len(numbers) <= _MOST_NUMBERS
            or not all(map(_finite, numbers))
        ):
            raise ValueError(f"a value is a list of 1 to {_MOST_NUMBERS} finite numbers")
        value = (
            ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=float(numbers[0]))
            if len(numbers) == 1
            else ParameterValue(
                type=ParameterType.PARAMETER_DOUBLE_ARRAY, double_array_value=[float(one) for one in numbers]
            )
        )

        def done(response: Any) -> None:
            (result,) = response.results
            reply(success=bool(result.successful), text=f"{node} {name}: {result.reason or 'changed'}")

        asked = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
        self._call(SetParameters, f"{node}/set_parameters", asked, reply, done)


def _advance(call: _Call) -> bool:
    """Send a request as soon as its service is there, or take the response; whether the call is over."""
    if call.future is None and call.client.service_is_ready():
        call.future = call.client.call_async(call.request)
    if call.future is not None and call.future.done():
        call.then(call.future.result())
        return True
    if time.monotonic() <= call.deadline:
        return False
    what = "is not there"
    if call.future is not None:
        what = "does not reply"
        call.client.remove_pending_request(call.future)
    call.reply(success=False, text=f"the service {call.service} {what} within {TIMEOUT:g} s")
    return True


def _described(descriptor: Any, value: Any) -> dict[str, Any]:
    """A parameter as the page takes it."""
    limits = [(one.from_value, one.to_value) for one in descriptor.floating_point_range] or [(None, None)]
    return {
        "name": descriptor.name,
        "value": float(value) if isinstance(value, int | float) else [float(one) for one in value],
        "low": limits[0][0],
        "high": limits[0][1],
        "description": descriptor.description,
        "constraints": descriptor.additional_constraints,
    }


def _finite(number: Any) -> bool:
    if not isinstance(number, int | float) or isinstance(number, bool):
        return False
    try:
        return math.isfinite(number)
    except OverflowError:
        return False  # a whole number beyond the range of float
