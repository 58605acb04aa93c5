# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Simulated time as message stamps, in whole nanoseconds from the step, and back to the same bits."""

NANOSECONDS = 1_000_000_000


class Stamps:
    """Stamps of the steps of one scenario.

    Attributes:
        step_nanoseconds: length of a step in whole nanoseconds.
    """

    def __init__(self, step: float, step_nanoseconds: int) -> None:
        """Stamps of steps of a given length.

        Args:
            step: length of a step as the flight software computes with it, s.
            step_nanoseconds: the same in whole nanoseconds.
        """
        self._step = step
        self.step_nanoseconds = step_nanoseconds

    def at(self, step: int) -> tuple[int, int]:
        """Seconds and nanoseconds at the beginning of a step."""
        return divmod(step * self.step_nanoseconds, NANOSECONDS)

    def at_time(self, time: float) -> tuple[int, int]:
        """Seconds and nanoseconds of a simulated moment in s, which lies on the grid of steps."""
        return self.at(round(time / self._step))

    def step(self, seconds: int, nanoseconds: int) -> int:
        """The step nearest to a stamp."""
        return round((seconds * NANOSECONDS + nanoseconds) / self.step_nanoseconds)

    def contradict(self, seconds: int, nanoseconds: int, step: int, *, exact: bool) -> bool:
        """Whether a message of a step cannot have a stamp.

        Args:
            seconds: of the stamp.
            nanoseconds: of the stamp.
            step: of the message.
            exact: whether the stamp is that of the step; else it may also be that of an earlier one, as of
                a measurement that arrives late.
        """
        stamp, due = seconds * NANOSECONDS + nanoseconds, step * self.step_nanoseconds
        if stamp == due:
            return False
        return exact or not 0 <= stamp < due or stamp % self.step_nanoseconds != 0

    def time(self, seconds: int, nanoseconds: int) -> float:
        """Simulated moment of a stamp, s; on the grid of steps with the bits of step number times length."""
        total = seconds * NANOSECONDS + nanoseconds
        step, rest = divmod(total, self.step_nanoseconds)
        return step * self._step if rest == 0 else total / NANOSECONDS
