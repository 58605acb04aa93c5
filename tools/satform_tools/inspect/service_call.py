# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Services of a running formation: a question, and its answer within a bounded time."""

from typing import Any

import yaml

from satform.scenario import ScenarioError
from satform.scenario.yaml_reader import read_value
from satform_bringup.deployment.local_discovery import MOST_FULL
from satform_nodes.satellite.group_node import LARGEST_FULL_GROUP
from satform_tools import console
from satform_tools.errors import CommandError
from satform_tools.inspect.graph import known_service
from satform_tools.inspect.message_values import fill, interface, plain
from satform_tools.inspect.observer_node import Looker


def call(looker: Looker, service: str, request: str, *, as_json: bool) -> None:
    """Call a service, and print its reply.

    Args:
        looker: in the formation's domain.
        service: its name.
        request: fields and values as YAML, such as `{names: [controller.kind]}`; empty for none.
        as_json: print JSON.

    Raises:
        CommandError: there is no such service, the request is not of its form, or nobody answers.
    """
    looker.find_formation()
    name, type_name = known_service(looker, service)
    kind = interface(type_name)
    reply = plain(ask(looker, kind, name, fill(kind.Request(), _read(request))))
    if as_json:
        console.as_json(reply)
    elif reply:
        print(yaml.safe_dump(reply, sort_keys=False, allow_unicode=True), end="")
    else:
        console.line(f"{name} has answered; its reply has no fields")


def ask(looker: Looker, kind: Any, service: str, request: Any) -> Any:
    """The reply of a service to a request.

    Raises:
        CommandError: the service is not there, or does not answer in time.
    """
    client = looker.node.create_client(kind, service)
    try:
        if not looker.wait(client.service_is_ready, looker.patience):
            raise CommandError(
                f"the service {service} is not there within {looker.patience:g} s{_why_not(service)}"
            )
        future = client.call_async(request)
        if not looker.wait(future.done, looker.patience):
            raise CommandError(f"the service {service} does not answer within {looker.patience:g} s")
        return future.result()
    finally:
        looker.node.destroy_client(client)


def _why_not(service: str) -> str:
    """Why a service may not be there at all, to be said after that it is not."""
    if not service.endswith("parameters"):
        return ""
    return (
        f"; parameter services are off in a run of more than {MOST_FULL} processes, and in a process of more "
        f"than {LARGEST_FULL_GROUP} satellites (see run --satellites-per-process)"
    )


def _read(request: str) -> Any:
    try:
        data = read_value(request, "the request")
    except ScenarioError as error:
        raise CommandError(f"the request {request!r} {error.problems[0].sentence}") from None
    return {} if data is None else data
