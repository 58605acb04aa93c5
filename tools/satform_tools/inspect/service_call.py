# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Calls services of a running formation, with a timeout."""

from typing import Any

import yaml

from satform.scenario import ScenarioError
from satform.scenario.yaml_reader import read_value
from satform_bringup.deployment.local_discovery import MAX_FULL_PROCESSES
from satform_nodes.satellite.group_node import LARGEST_FULL_GROUP
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.inspect.graph import known_service
from satform_tools.inspect.message_values import fill, interface, plain
from satform_tools.inspect.observer_node import Observer


def call(observer: Observer, service: str, request: str, *, as_json: bool) -> None:
    """Call a service, and print its reply.

    Args:
        observer: in the formation's domain.
        service: its name.
        request: fields and values as YAML, such as `{names: [controller.kind]}`; empty for none.
        as_json: print JSON.

    Raises:
        CommandError: there is no such service, the request is not of its form, or no reply arrives in time.
    """
    observer.find_formation()
    name, type_name = known_service(observer, service)
    kind = interface(type_name)
    reply = plain(ask(observer, kind, name, fill(kind.Request(), _read(request))))
    if as_json:
        console.as_json(reply)
    elif reply:
        print(yaml.safe_dump(reply, sort_keys=False, allow_unicode=True), end="")
    else:
        console.line(f"{name} has replied; its reply has no fields")


def ask(observer: Observer, kind: Any, service: str, request: Any) -> Any:
    """The reply of a service to a request.

    Raises:
        CommandError: the service is not there, or does not reply in time.
    """
    client = observer.node.create_client(kind, service)
    try:
        if not observer.wait(client.service_is_ready, observer.timeout):
            raise CommandError(
                f"the service {service} is not there within {observer.timeout:g} s{_why_not(service)}"
            )
        future = client.call_async(request)
        if not observer.wait(future.done, observer.timeout):
            raise CommandError(f"the service {service} does not reply within {observer.timeout:g} s")
        return future.result()
    finally:
        observer.node.destroy_client(client)


def _why_not(service: str) -> str:
    """Why a service may not exist at all; a clause to append."""
    if not service.endswith("parameters"):
        return ""
    return (
        f"; parameter services are off in a run of more than {MAX_FULL_PROCESSES} processes, and in a "
        f"process of more than {LARGEST_FULL_GROUP} satellites (see run --satellites-per-process)"
    )


def _read(request: str) -> Any:
    try:
        data = read_value(request, "the request")
    except ScenarioError as error:
        raise CommandError(f"the request {request!r} {error.problems[0].sentence}") from None
    return {} if data is None else data
