# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Validation of received messages with lists of numbers, by the rules of `message_validator`."""

from typing import Any, NamedTuple

import numpy as np

from satform.communication.array_layout import ArrayLayout
from satform.communication.message_validator import LARGEST, Reason, RejectionCounter
from satform.communication.sim_time import Stamps


class ArrayMessage(NamedTuple):
    """A valid message: seconds and nanoseconds of its stamp, step, all fields by name, lists as arrays."""

    seconds: int
    nanoseconds: int
    step: int
    fields: Any


class ArrayValidator:
    """Validates the messages of one topic.

    Attributes:
        repeated: number of messages that were received again after a retransmission; they are not rejected.
    """

    def __init__(
        self, topic: str, form: ArrayLayout, rejections: RejectionCounter, stamps: Stamps, *, exact: bool
    ) -> None:
        """Nothing has been validated yet.

        Args:
            topic: its name.
            form: of its messages.
            rejections: counts the rejected messages.
            stamps: of the scenario's steps.
            exact: whether a message has the stamp of its step; else it may have that of an earlier one.
        """
        self.repeated = 0
        self._topic = topic
        self._form = form
        self._rejections = rejections
        self._stamps = stamps
        self._exact = exact

    def validate(self, data: bytes, first: int, last: int) -> ArrayMessage | None:
        """A message; None if it is rejected or a repetition.

        Args:
            data: its bytes.
            first: earliest step that is due; an earlier one is a repetition.
            last: latest step that can be due.
        """
        fields = self._form.unpack(data)
        reason = Reason.FORM if fields is None else self._fault(fields, last)
        if reason is not None:
            self._rejections.add(self._topic, reason)
            return None
        step = int(fields["step"])
        if step < first:
            self.repeated += 1
            return None
        return ArrayMessage(
            int(fields["header.stamp.sec"]), int(fields["header.stamp.nanosec"]), step, fields
        )

    def _fault(self, fields: Any, last: int) -> Reason | None:
        """Why a message is rejected; None if it is not."""
        seconds, nanoseconds = int(fields["header.stamp.sec"]), int(fields["header.stamp.nanosec"])
        step = int(fields["step"])
        if step > last:
            return Reason.NOT_DUE
        if self._stamps.contradict(seconds, nanoseconds, step, exact=self._exact):
            return Reason.CONTRADICTION
        for name in self._form.lists:
            values = fields[name]
            largest = max(abs(float(values.max())), abs(float(values.min())))
            if not largest <= LARGEST:
                return Reason.RANGE if np.isfinite(largest) else Reason.NOT_FINITE
        return None
