# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The class of every node: its services never raise, and its parameters take numbers as a scenario does."""

import os
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.parameter import Parameter

from satform.communication.message_validator import RejectionCounter
from satform_nodes import LEAN
from satform_nodes.runtime.parameter_values import Forms, as_declared
from satform_nodes.runtime.service_guard import error_sentence, guarded

SIM_TIME = "use_sim_time"
"""Parameter that every ROS node has: whether the node's clock follows `/clock`."""

NO_SIM_TIME = (
    "satform's nodes take simulated time from the messages of each step, never from /clock; "
    f"leave {SIM_TIME} false for them, and set it for observers only"
)


class FormationNode(Node):
    """A node whose reply to a parameter change says when it takes effect.

    rclpy drops the reason that a callback gives for accepting a change; here it reaches the caller.
    """

    _lean = False

    def __init__(self, name: str, *, log_topic: bool = True, lean: bool = False) -> None:
        """A node.

        Args:
            name: of the node.
            log_topic: whether its log is published on `/rosout`, too.
            lean: whether it does without what costs most where there are many nodes: the services by which
                its parameters can be read and set from outside, the log topic, and the warning about others
                whose quality of service does not fit. Where the environment has `LEAN`, all nodes do.
        """
        self.sentence = ""
        # Before the parent class, which makes services that may be called at once.
        self.rejections = RejectionCounter()
        self._lean = lean = lean or LEAN in os.environ
        # With the services for parameters goes the one that describes message types.
        bare = [Parameter("start_type_description_service", value=False)] if lean else []
        super().__init__(
            name,
            enable_rosout=log_topic and not lean,
            start_parameter_services=not lean,
            parameter_overrides=bare,
        )

        self.add_on_set_parameters_callback(_keep_wall_clock)

    def note_fault(self, name: str, error: BaseException) -> None:
        """Log and count what a callback raised because of a request or an event from outside.

        Args:
            name: of the service or topic.
            error: that was raised.
        """
        reason = f"not handled: {type(error).__name__}"
        self.rejections.add(name, reason)
        if self.rejections.counts[name, reason] == 1:
            self.get_logger().warning(f"{name}: rejected, and counted from now on: {error_sentence(error)}")

    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[[Any, Any], Any], **options: Any
    ) -> Any:
        """As in rclpy; a request that makes the callback raise is refused, logged and counted."""
        name = self.resolve_service_name(srv_name)

        def note(error: Exception) -> None:
            self.note_fault(name, error)

        return super().create_service(srv_type, srv_name, guarded(srv_type, callback, note), **options)

    def create_publisher(self, *arguments: Any, **options: Any) -> Any:
        """As in rclpy; a lean node gets no events about incompatible quality of service."""
        if self._lean:
            options.setdefault("event_callbacks", PublisherEventCallbacks(use_default_callbacks=False))
        return super().create_publisher(*arguments, **options)

    def create_subscription(self, *arguments: Any, **options: Any) -> Any:
        """As in rclpy; a lean node gets no events about incompatible quality of service."""
        if self._lean:
            options.setdefault("event_callbacks", SubscriptionEventCallbacks(use_default_callbacks=False))
        return super().create_subscription(*arguments, **options)

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Change parameters together; the result's reason is the text from the change's acceptor."""
        self.sentence = ""
        try:
            parameter_list = [self._as_declared(parameter) for parameter in parameter_list]
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        result = super().set_parameters_atomically(parameter_list)
        if result.successful:
            result.reason = self.sentence
        return result

    def _as_declared(self, parameter: Parameter) -> Parameter:
        """A parameter's new value in the type with which it was declared.

        Raises:
            ValueError: it is of another type.
        """
        if not self.has_parameter(parameter.name):
            return parameter
        declared = self.get_parameter(parameter.name)
        return as_declared(parameter, declared, self.forms.get(parameter.name, Forms()))

    @cached_property
    def forms(self) -> dict[str, Forms]:
        """In which other forms parameters take numbers, by the parameters' names."""
        return {}


def _keep_wall_clock(parameters: Sequence[Parameter]) -> SetParametersResult:
    """Refuse to have a node's clock go by `/clock`, which the plant makes from the steps."""
    asked = any(parameter.name == SIM_TIME and parameter.value for parameter in parameters)
    return SetParametersResult(successful=not asked, reason=NO_SIM_TIME if asked else "")
