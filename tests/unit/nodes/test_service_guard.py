# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A service refuses what it cannot handle with an answer; no status of the formation raises anything."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rcl_interfaces.msg import Parameter, SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from satform_msgs.msg import Command, FormationStatus
from satform_msgs.srv import SetGraph
from std_srvs.srv import Trigger

from flights import shipped
from satform.flight.compile import compile_scenario
from satform.protocol.formation_view import FormationView
from satform_nodes.runtime.service_guard import guarded


def raises(_request: Any, _reply: Any) -> Any:
    raise ZeroDivisionError("division  by\nzero")


@pytest.mark.parametrize("service", [Trigger, SetGraph])
def test_a_reply_with_success_and_message_says_what_went_wrong(service: Any) -> None:
    noted: list[Exception] = []
    reply = guarded(service, raises, noted.append)(service.Request(), service.Response(success=True))
    assert not reply.success
    assert reply.message == "the request was rejected: division by zero (ZeroDivisionError)"
    assert [type(error) for error in noted] == [ZeroDivisionError]


def test_a_reply_without_such_fields_is_empty() -> None:
    reply = guarded(GetParameters, raises, lambda _: None)(GetParameters.Request(), GetParameters.Response())
    assert reply == GetParameters.Response()


def test_parameters_that_are_set_together_are_refused_together() -> None:
    answer = guarded(SetParametersAtomically, raises, lambda _: None)
    reply = answer(SetParametersAtomically.Request(), SetParametersAtomically.Response())
    assert not reply.result.successful
    assert "division by zero" in reply.result.reason


def test_of_parameters_that_are_set_one_by_one_only_the_bad_one_is_refused() -> None:
    def takes_all_but_b(request: SetParameters.Request, reply: SetParameters.Response) -> Any:
        for parameter in request.parameters:
            if parameter.name == "b":
                raise ValueError("no b")
            reply.results.append(SetParametersResult(successful=True))
        return reply

    noted: list[Exception] = []
    request = SetParameters.Request(parameters=[Parameter(name=name) for name in "abc"])
    reply = guarded(SetParameters, takes_all_but_b, noted.append)(request, SetParameters.Response())
    assert [result.successful for result in reply.results] == [True, False, True]
    assert reply.results[1].reason == "b: the value was rejected: no b (ValueError)"
    assert len(noted) == 1


names = st.lists(st.sampled_from(["sat1", "sat2", "sat3", "sat9", ""]), max_size=4)
whole = st.sampled_from([0, 1, 2, 3, 2**31, 2**63 - 1, 2**64 - 1])


@settings(max_examples=40)
@given(
    status=st.builds(
        FormationStatus,
        step=whole,
        version=whole,
        phase=st.integers(0, 255),
        last_step=whole,
        satellites=st.one_of(names, st.just(["sat1", "sat2", "sat3"])),
        alive=st.lists(st.booleans(), min_size=2, max_size=4),
        edge_receivers=st.lists(st.integers(0, 2**32 - 1) | st.integers(0, 3), max_size=5),
        edge_senders=st.lists(st.integers(0, 2**32 - 1) | st.integers(0, 3), max_size=5),
        lost=names,
        final_commands=st.lists(st.builds(Command, step=whole), max_size=4),
        rejoined=names,
        rejoin_checkpoints=st.lists(st.integers(-(2**63), 2**63 - 1), max_size=4),
        reason=st.text(max_size=20),
    )
)
def test_whatever_is_said_of_a_formation_is_taken_or_refused_without_an_exception(
    status: FormationStatus,
) -> None:
    assert FormationView(compile_scenario(shipped("triangle"))).take(status) in (True, False)
