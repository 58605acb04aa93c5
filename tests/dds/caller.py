# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A hostile caller: requests of every kind to every service of some nodes, well-formed or not.

usage: caller.py SEED NODE...; it prints a line when it has found all nodes, and ends with its parent.
"""

import importlib
import os
import random
import sys
import time
from contextlib import suppress
from typing import Any

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

COMMANDS = ("/formation/stop", "/formation/pause", "/formation/step")
"""Services without anything in their requests: each is a command of the user's, whatever its bytes."""

PARENT = os.getppid()
"""When it has ended nobody is left to end this process."""

TEXTS = ("", "controller.switching_gain", "scenario", "use_sim_time", "\x00", "ß" * 50, "a" * 300, "..", "x")
WHOLE = (0, 1, 2, 5, 9, 10, 77, 127, 255)
FLOATS = (0.0, -1.0, 1e300, float("nan"), float("inf"), -float("inf"))


def value(kind: str, draw: random.Random) -> Any:
    """Something of a type as rosidl names it, for the most part of the kind that nobody expects."""
    if kind.startswith("sequence<"):
        inner = kind.removeprefix("sequence<").removesuffix(">").partition(",")[0]
        return [value(inner, draw) for _ in range(draw.choice((0, 1, 3, 9)))]
    if "/" in kind:
        package, name = kind.split("/")
        return filled(getattr(importlib.import_module(f"{package}.msg"), name)(), draw)
    if kind in ("float", "double"):
        return draw.choice(FLOATS)
    if kind == "boolean":
        return draw.random() < 0.5
    if kind == "octet":
        return bytes([draw.randrange(256)])
    return draw.choice(TEXTS) if kind.startswith("string") else draw.choice(WHOLE[:-1])


def filled(message: Any, draw: random.Random) -> Any:
    """The message with other fields."""
    for name, kind in message.get_fields_and_field_types().items():
        if kind.endswith("[16]"):
            setattr(message, name, list(draw.randbytes(16)))
        elif "/" in kind and not kind.startswith("sequence<"):
            filled(getattr(message, name), draw)
        else:
            setattr(message, name, value(kind, draw))
    return message


def harmless(message: Any) -> Any:
    """The same without what a node may accept: a gain of the right type, or a graph of as many satellites."""
    for parameter in getattr(message, "parameters", []):
        if parameter.value.type in (2, 3, 8):
            parameter.value.type = 77
    if hasattr(message, "adjacency"):
        message.adjacency = message.adjacency[:3]
    return message


def service_type(name: str) -> Any:
    """The class of a service, such as `std_srvs/srv/Trigger`, or `p/action/A_SendGoal` of an action."""
    package, folder, kind = name.split("/")
    module = importlib.import_module(f"{package}.{folder}")
    if folder == "srv":
        return getattr(module, kind)
    action, _, own = kind.rpartition("_")
    return getattr(getattr(module, action).Impl, f"{own}Service")


def found(node: Node, name: str) -> dict[str, Any]:
    """Services of a node with their types, once it has them."""
    while True:
        try:
            there = node.get_service_names_and_types_by_node(name, "/")
        except RuntimeError:
            there = []
        if any(service.endswith("set_parameters_atomically") for service, _ in there):
            return {service: service_type(kinds[0]) for service, kinds in there if service not in COMMANDS}
        if os.getppid() != PARENT:
            sys.exit(1)
        time.sleep(0.05)  # polls: another process does not notify this one


def main(seed: int, names: list[str]) -> None:
    draw = random.Random(seed)
    rclpy.init()
    node = rclpy.create_node("caller")
    services = {name: kind for own in names for name, kind in found(node, own).items()}
    clients = {name: node.create_client(kind, name) for name, kind in services.items()}
    bytes_of_requests = {}
    for name, kind in services.items():
        kind.Request.__class__.__import_type_support__()
        # As DDS names the topic of a service's requests.
        bytes_of_requests[name] = node.create_publisher(
            kind.Request, f"rq{name}Request", QoSProfile(depth=10, avoid_ros_namespace_conventions=True)
        )
    sys.stdout.write(f"calling {len(services)} services\n")
    sys.stdout.flush()
    while os.getppid() == PARENT:
        name, kind = draw.choice(list(services.items()))
        request = harmless(filled(kind.Request(), draw))
        if draw.random() < 0.5:
            clients[name].call_async(request)
        else:
            for parameter in getattr(request, "parameters", []):
                # A bit that flips must not make a gain of it.
                parameter.name = "x"
            data = bytearray(serialize_message(request))
            for _ in range(draw.randrange(1, 5)):
                data[draw.randrange(len(data))] = draw.randrange(256)
            short = bytes(data[: draw.randrange(len(data))]) if draw.random() < 0.5 else bytes(data)
            # What is longer than any request of its kind does not leave this process.
            with suppress(RCLError):
                bytes_of_requests[name].publish(draw.choice((short, draw.randbytes(draw.randrange(200)))))
        rclpy.spin_once(node, timeout_sec=0.0)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
