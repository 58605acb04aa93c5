# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Requests from a page that cannot be sent, and responses that make no sense, are answered by a sentence."""

from types import SimpleNamespace
from typing import Any

import pytest
from rcl_interfaces.msg import ListParametersResult, ParameterDescriptor, ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.serialization import serialize_message
from rclpy.task import Future

from satform_tools.live import ros_hands
from satform_tools.live.ros_hands import RosHands

SET = {"kind": "set", "satellite": "sat1", "name": "controller.gain", "value": [1.0]}
NAMES = ["controller.gain", "controller.width"]
DESCRIPTORS = [ParameterDescriptor(name=name, type=ParameterType.PARAMETER_DOUBLE) for name in NAMES]


class Client:
    """Of a service that gives one response, or none."""

    def __init__(self, response: Any) -> None:
        self.response = response
        self.sent: list[Future] = []

    def service_is_ready(self) -> bool:
        return True

    def call_async(self, request: Any) -> Future:
        serialize_message(request)
        future: Future = Future()
        if self.response is not None:
            future.set_result(self.response)
        self.sent.append(future)
        return future

    def remove_pending_request(self, future: Future) -> None:
        self.sent.remove(future)


class Answered:
    """Calls of services with prepared responses, by the type of the service."""

    def __init__(self, responses: dict[Any, Any]) -> None:
        self.clients: dict[Any, Client] = {}
        self.replies: list[dict[str, Any]] = []

        def client(kind: Any, _service: str) -> Client:
            return self.clients.setdefault(kind, Client(responses.get(kind)))

        observer: Any = SimpleNamespace(
            node=SimpleNamespace(create_client=client), full_name=str, poll=lambda: None
        )
        monitor: Any = SimpleNamespace(status=SimpleNamespace(satellites=["sat1"]))
        self.calls = RosHands(observer, monitor)

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """What a request is answered."""
        self.calls.ask(request, lambda **outcome: self.replies.append(outcome))
        for _ in range(4):
            self.calls.update()
        (reply,) = self.replies
        return reply


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"name": "controller.\ud800"}, "does not change in flight"),
        ({"name": "controller.gain\u00e9"}, "does not change in flight"),
        ({"value": [10**400]}, "finite numbers"),
        ({"value": [True]}, "finite numbers"),
        ({"value": [float("inf")]}, "finite numbers"),
    ],
)
def test_what_is_no_name_and_no_value_of_a_parameter_is_not_sent(
    change: dict[str, Any], sentence: str
) -> None:
    answered = Answered({})
    reply = answered.ask({**SET, **change})
    assert not reply["success"]
    assert sentence in reply["text"]
    assert answered.clients == {}


def test_a_response_with_another_number_of_values_is_answered_by_a_sentence() -> None:
    reply = Answered({SetParameters: SetParameters.Response()}).ask(SET)
    assert not reply["success"]
    assert "set_parameters failed" in reply["text"]
    listed = ListParameters.Response(result=ListParametersResult(names=NAMES))
    described = DescribeParameters.Response(descriptors=DESCRIPTORS)
    responses = {
        ListParameters: listed,
        DescribeParameters: described,
        GetParameters: GetParameters.Response(),
    }
    reply = Answered(responses).ask({"kind": "parameters", "satellite": "sat1"})
    assert not reply["success"]
    assert "get_parameters failed" in reply["text"]


def test_a_request_that_cannot_be_sent_is_answered_by_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def unsendable(_client: Client, _request: Any) -> Future:
        raise RuntimeError("the participant is gone")

    monkeypatch.setattr(Client, "call_async", unsendable)
    reply = Answered({}).ask(SET)
    assert not reply["success"]
    assert "the participant is gone" in reply["text"]


def test_a_call_without_reply_is_given_up_and_its_client_does_not_keep_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ros_hands, "TIMEOUT", 0.0)
    answered = Answered({})
    reply = answered.ask(SET)
    assert not reply["success"]
    assert "does not reply" in reply["text"]
    assert answered.clients[SetParameters].sent == []
