# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Why a flight ended before its last step: a quantity that is not finite or beyond a limit."""

import math
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class EarlyEnd:
    """The first quantity of a flight that was not finite or beyond its limit.

    Attributes:
        satellite: name of the satellite.
        quantity: which quantity of it.
        step: at which it was found; the flight ends there.
        time: simulated time of that step, s.
        value: its length or value; not a number where it was not finite.
        limit: that it must not exceed, or, of an altitude, must not fall below.
        unit: of value and limit.
        cause: the likely one, in words.
    """

    satellite: str
    quantity: str
    step: int
    time: float
    value: float
    limit: float
    unit: str
    cause: str

    @property
    def sentence(self) -> str:
        """All of it in one sentence, without a full stop."""
        when = f"at step {self.step} ({self.time:g} s)"
        if math.isnan(self.value):
            found = f"{self.quantity} of {self.satellite} is not finite {when}"
        else:
            beyond = "below" if self.value < self.limit else "beyond"
            found = (
                f"{self.quantity} of {self.satellite} is {self.value:.4g} {self.unit} {when}, {beyond} the "
                f"limit of {self.limit:g} {self.unit}"
            )
        return f"{found}; likely cause: {self.cause}"

    @classmethod
    def of_message(cls, status: Any, step: float) -> "EarlyEnd | None":
        """Why a flight ended before its last step, from a status of the plant; None where it has nothing.

        Args:
            status: satform_msgs/msg/FormationStatus, of rclpy or decoded from a bag.
            step: control period, s.
        """
        for end in status.early_end:
            return cls(
                satellite=str(end.satellite),
                quantity=str(end.quantity),
                step=int(end.step),
                time=int(end.step) * step,
                value=float(end.value),
                limit=float(end.limit),
                unit=str(end.unit),
                cause=str(end.cause),
            )
        return None

    def data(self) -> dict[str, Any]:
        """As plain data, with the sentence."""
        return {**asdict(self), "sentence": self.sentence}

    @classmethod
    def of(cls, data: dict[str, Any]) -> "EarlyEnd":
        """From what `data` gave, read again from JSON, where what is not a number may have become null.

        Raises:
            KeyError: something is missing.
            TypeError: a number is none.
            ValueError: likewise.
        """
        value = data["value"]
        return cls(
            satellite=str(data["satellite"]),
            quantity=str(data["quantity"]),
            step=int(data["step"]),
            time=float(data["time"]),
            value=math.nan if value is None else float(value),
            limit=float(data["limit"]),
            unit=str(data["unit"]),
            cause=str(data["cause"]),
        )
