# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Takes serialised messages together with the GID of their DDS writer, which rclpy does not return.

Every DDS sample has the globally unique identifier of its writer, and rcl passes it on;
`get_publishers_info_by_topic` returns the same identifier for an endpoint.
"""

import ctypes
from typing import Any

GID_BYTES = 16
"""Length of a writer's identifier in ROS 2 Jazzy, bytes."""

_OK, _NOTHING_THERE = 0, 401
"""Return codes of rcl: success, and RCL_RET_SUBSCRIPTION_TAKE_FAILED."""

_ROOM = 1024
"""Initial bytes of the buffer; rcl enlarges it for longer messages."""


class _Allocator(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_void_p) for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    ]


class _Bytes(ctypes.Structure):
    """`rcutils_uint8_array_t`."""

    _fields_ = [
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    ]


class _Information(ctypes.Structure):
    """`rmw_message_info_t`."""

    _fields_ = [
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_sequence_number", ctypes.c_uint64),
        ("reception_sequence_number", ctypes.c_uint64),
        ("implementation", ctypes.c_void_p),
        ("gid", ctypes.c_ubyte * GID_BYTES),
        ("from_intra_process", ctypes.c_bool),
    ]


class SerializedTaker:
    """Takes serialised messages, one after another, into the same buffer."""

    def __init__(self) -> None:
        tools = ctypes.CDLL("librcutils.so")
        self._take = ctypes.CDLL("librcl.so").rcl_take_serialized_message
        self._take.argtypes = [ctypes.c_void_p] * 4
        self._forget_error = tools.rcutils_reset_error
        tools.rcutils_get_default_allocator.restype = _Allocator
        tools.rcutils_uint8_array_init.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
        allocator = tools.rcutils_get_default_allocator()
        self._bytes, self._information = _Bytes(), _Information()
        if tools.rcutils_uint8_array_init(ctypes.byref(self._bytes), _ROOM, ctypes.byref(allocator)) != _OK:
            raise MemoryError("no room for a message")
        self._outputs = (ctypes.byref(self._bytes), ctypes.byref(self._information), None)

    def take(self, subscription: Any) -> tuple[bytes, bytes] | None:
        """The next message and the identifier of its writer; None when there is none.

        Args:
            subscription: rclpy's, not destroyed.
        """
        code = self._take(subscription.handle.pointer, *self._outputs)
        if code != _OK:
            if code != _NOTHING_THERE:
                self._forget_error()
            return None
        return ctypes.string_at(self._bytes.buffer, self._bytes.length), bytes(self._information.gid)
