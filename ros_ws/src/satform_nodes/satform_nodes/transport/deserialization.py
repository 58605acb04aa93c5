# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Deserialisation of messages of varying size by rclpy; those of a fixed size are read by `cdr_codec`."""

from typing import Any

from rclpy.serialization import deserialize_message

from satform.communication.message_validator import RejectionCounter


def deserialize_or_reject(data: bytes, kind: Any, topic: str, rejections: RejectionCounter) -> Any:
    """Deserialise a message of varying size; None, and counted as rejected, if that fails."""
    try:
        return deserialize_message(data, kind)
    except (RuntimeError, ValueError, MemoryError):
        rejections.add(topic, "another form")
        return None
