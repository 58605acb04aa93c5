# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What no quantity of a flight may exceed: beyond it a flight has diverged, and ends."""

from satform.common.spec import Complaint, Number, Positive, Spec


class LimitsSpec(Spec):
    """Limits at which a flight ends early; the defaults are far beyond what a formation does."""

    distance: Positive = 1e7
    """Largest distance of a satellite, of its estimate or of its reference from the chief, m."""
    speed: Positive = 2e4
    """Largest speed of any of these in the rotating LVLH frame, m/s."""
    acceleration: Positive = 1e4
    """Largest acceleration that is commanded, applied or part of a reference, m/s^2."""
    angular_rate: Positive = 100.0
    """Largest angular rate of a satellite's body, rad/s."""
    altitude: Number = 0.0
    """Lowest altitude of a satellite above the Earth's equatorial radius, m; the ground when left out. It is
    not looked at where the chief's own orbit lies below the ground, which no real one does."""

    def complaints(self, altitude: float) -> list[Complaint]:
        """What is wrong with these limits, each with the path of its field.

        Args:
            altitude: of the chief's orbit, m.
        """
        if altitude < 0.0 or altitude > self.altitude:
            return []
        sentence = (
            f"no flight can stay above {self.altitude:g} m: the chief's orbit is {altitude:.0f} m high; give "
            "a lower altitude"
        )
        return [(("limits", "altitude"), sentence)]
