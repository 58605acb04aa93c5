# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Service callbacks that answer whatever they are asked: a request that makes one raise is refused.

Without this the exception would end the node, and the caller would wait in vain.
"""

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters

Callback = Callable[[Any, Any], Any]
"""Takes a request and a reply to fill, and returns the reply."""

_LONGEST = 300
"""Characters of a sentence about what went wrong."""


def guarded(service: Any, callback: Callback, note: Callable[[Exception], None]) -> Callback:
    """A callback that does not raise.

    Args:
        service: type of the service.
        callback: answers requests, and may raise.
        note: called with each exception.

    Returns:
        A callback that replies with a refusal where the given one raises, in the reply's own fields.
        Parameters that are set one by one are refused one by one.
    """

    def answer(request: Any, reply: Any) -> Any:
        try:
            return callback(request, reply)
        except Exception as error:
            note(error)
            return refused(service.Response(), f"the request was rejected: {error_sentence(error)}")

    def answer_each(request: SetParameters.Request, reply: SetParameters.Response) -> SetParameters.Response:
        for parameter in request.parameters:
            single = SetParameters.Request(parameters=[parameter])
            try:
                reply.results.extend(callback(single, SetParameters.Response()).results)
            except Exception as error:
                note(error)
                reason = f"{parameter.name}: the value was rejected: {error_sentence(error)}"
                reply.results.append(SetParametersResult(successful=False, reason=reason))
        return reply

    return answer_each if service is SetParameters else answer


def refused(reply: Any, sentence: str) -> Any:
    """Have a reply say that nothing was done, where it has a field for that.

    Args:
        reply: empty.
        sentence: why.

    Returns:
        The reply.
    """
    if hasattr(reply, "success") and hasattr(reply, "message"):
        reply.success, reply.message = False, sentence
    if isinstance(getattr(reply, "result", None), SetParametersResult):
        reply.result = SetParametersResult(successful=False, reason=sentence)
    return reply


def error_sentence(error: BaseException) -> str:
    """An exception in one line of bounded length."""
    text = " ".join(str(error).split()) or "no reason given"
    return f"{text[:_LONGEST]} ({type(error).__name__})"
