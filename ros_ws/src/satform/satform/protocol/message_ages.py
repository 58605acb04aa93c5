# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Ages of neighbours' messages on the wall clock, where the newest ones are used."""

from dataclasses import dataclass


@dataclass
class MessageAges:
    """Ages of the neighbours' messages when they were used.

    Attributes:
        count: of messages.
        total: of their ages, simulated time, s.
        largest: of their ages, s.
    """

    count: int = 0
    total: float = 0.0
    largest: float = 0.0

    def note(self, age: float) -> None:
        """Count one message."""
        self.count += 1
        self.total += age
        self.largest = max(self.largest, age)

    def data(self) -> dict[str, float]:
        """Mean and largest age, simulated time, s."""
        return {"age_mean": self.total / self.count if self.count else 0.0, "age_largest": self.largest}
