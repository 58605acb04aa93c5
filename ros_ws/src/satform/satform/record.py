"""What is kept of a flight: plain arrays, the same from an in-process run and from a bag."""

from dataclasses import dataclass

import numpy as np

from satform.elementwise import Array


@dataclass(frozen=True)
class FlightRecord:
    """A whole flight of N satellites over K control steps.

    Quantities known at the start of a step have K + 1 rows (the last is the state after the last
    step); quantities decided in a step have K rows. Vectors are in the chief's LVLH frame.

    Attributes:
        satellites: names, in the order of the columns.
        step: control period, s.
        position: m, shape (K + 1, N, 3).
        velocity: in the rotating frame, m/s, shape (K + 1, N, 3).
        acceleration: commanded, m/s^2, shape (K, N, 3).
        arc_length: generalised, as announced to the neighbours, m, shape (K + 1, N).
        rate: of the generalised arc length, m/s, shape (K + 1, N).
        reference_position: m, shape (K, N, 3).
        reference_velocity: m/s, shape (K, N, 3).
        reference_acceleration: feed-forward used in the step, m/s^2, shape (K, N, 3).
        sliding_variable: m/s, shape (K, N, 3).
    """

    satellites: tuple[str, ...]
    step: float
    position: Array
    velocity: Array
    acceleration: Array
    arc_length: Array
    rate: Array
    reference_position: Array
    reference_velocity: Array
    reference_acceleration: Array
    sliding_variable: Array

    @property
    def steps(self) -> int:
        """Number of control steps flown."""
        return len(self.acceleration)

    @property
    def time(self) -> Array:
        """Simulated time of every state, s, shape (K + 1,)."""
        time: Array = np.arange(self.steps + 1, dtype=np.float64) * self.step
        return time

    @property
    def position_error(self) -> Array:
        """Position minus reference, m, shape (K, N, 3)."""
        error: Array = self.position[:-1] - self.reference_position
        return error

    @property
    def tracking_error(self) -> Array:
        """Length of the position error, m, shape (K, N)."""
        error: Array = np.linalg.norm(self.position_error, axis=-1)
        return error

    @property
    def control(self) -> Array:
        """Length of the commanded acceleration, m/s^2, shape (K, N)."""
        length: Array = np.linalg.norm(self.acceleration, axis=-1)
        return length

    def differences(self, other: "FlightRecord") -> list[str]:
        """Where two records of the same flight are not the same to the last bit.

        Args:
            other: the record to compare with.

        Returns:
            A sentence for each quantity that differs, naming the first step at which it does;
            empty when every number of both records has the same bits.
        """
        found = []
        if self.satellites != other.satellites:
            found.append(f"satellites: {self.satellites} and {other.satellites}")
        for name in QUANTITIES:
            mine, theirs = getattr(self, name), getattr(other, name)
            if mine.shape != theirs.shape:
                found.append(f"{name}: shapes {mine.shape} and {theirs.shape}")
                continue
            unequal = mine.view(np.uint64) != theirs.view(np.uint64)
            if unequal.any():
                first = int(np.argwhere(unequal)[0][0])
                found.append(f"{name}: {int(unequal.sum())} numbers differ, the first at step {first}")
        return found


QUANTITIES = tuple(name for name in FlightRecord.__annotations__ if name not in {"satellites", "step"})
"""Names of the arrays of a record."""
